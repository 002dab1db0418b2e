"""Digests of the code that makes a result, so that no old result passes for a new one.

A run goes on where it stopped; but what was reached with other code must be reached
again, or a developer who edits a tracker and repeats the command sees old numbers.
"""

from __future__ import annotations

import hashlib
import importlib.util
from functools import cache
from pathlib import Path

__all__ = ["filming_code", "module_code", "tracking_code"]

_SUFFIXES = {".py", ".glsl", ".vert", ".frag", ".json"}
_BOTH = (
    "box.py",
    "camera.py",
    "frame.py",
    "mask.py",
    "sequence.py",
    "tracker.py",
    "trajectories.py",
    "datasets",
)
_FILMING = (*_BOTH, "generation.py", "scenarios", "render")
_TRACKING = (*_BOTH, "trackers", "tracking.py", "measures.py", "scores.py")


def filming_code() -> str:
    """Return a digest of the code that makes sequences."""
    return _digest(_FILMING)


def tracking_code() -> str:
    """Return a digest of the code that makes and scores tracks."""
    return _digest(_TRACKING)


@cache
def module_code(module: str) -> str:
    """Return a digest of the code that a tracker's module lies in.

    Parameters
    ----------
    module : str
        Dotted name. Its whole top-level package counts, or the one file.
    """
    top = module.partition(".")[0]
    found = importlib.util.find_spec(top)
    if found is None or found.origin is None:
        return ""
    origin = Path(found.origin)
    files = origin.parent.rglob("*.py") if origin.name == "__init__.py" else [origin]
    return _digest_files(sorted(files))


@cache
def _digest(names: tuple[str, ...]) -> str:
    home = Path(__file__).parents[1]
    files: list[Path] = []
    for path in (home / name for name in names):
        # the rooms are links in a checkout: look into what they lead to
        inside = path.resolve().rglob("*") if path.is_dir() else [path]
        files += (p for p in inside if p.suffix in _SUFFIXES)
    return _digest_files(sorted(files))


def _digest_files(files: list[Path]) -> str:
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
