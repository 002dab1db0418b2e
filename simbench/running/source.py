"""Digests of the code that makes a result, so that no old result passes for a new one.

A run goes on where it stopped; but what was reached with other code must be reached
again, or a developer who edits a tracker and repeats the command sees old numbers.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from simbench.environment import versions

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
_FILMING = (
    *_BOTH,
    "generation.py",
    "takes.py",
    "provenance.py",
    "dialling",
    "scenarios",
    "render",
)
_TRACKING = (
    *_BOTH,
    "trackers",
    "tracking.py",
    "measures.py",
    "scores.py",
    "score_rows.py",
    "score_tables.py",
)
_NOT_FOLLOWED = sys.stdlib_module_names | {"simbench"}
_INSTALLED = {"site-packages", "dist-packages"}


def filming_code() -> str:
    """Return a digest of the code that makes sequences, and of what it stands on."""
    return _digest(_FILMING)


def tracking_code() -> str:
    """Return a digest of the code that makes and scores tracks, as `filming_code`."""
    return _digest(_TRACKING)


@cache
def module_code(*modules: str) -> str:
    """Return a digest of the code that a user's own tracker is made of.

    Parameters
    ----------
    *modules : str
        Dotted names. The top-level package or file of each counts, and whatever these
        import in turn, so far as it is not installed: an installed package changes by
        its version, a user's own code under their hands. simbench itself is left
        out, see `tracking_code`.
    """
    wanted = [_top(module) for module in modules]
    found: dict[str, list[Path]] = {}
    while wanted:
        name = wanted.pop()
        if name in found or name in _NOT_FOLLOWED:
            continue
        found[name] = _files(name)
        for imported in set(_imports(found[name])):
            if imported not in _NOT_FOLLOWED and not _is_installed(imported):
                wanted.append(imported)
    return _digest_files(sorted(path for paths in found.values() for path in paths))


@cache
def _digest(names: tuple[str, ...]) -> str:
    home = Path(__file__).parents[1]
    files: list[Path] = []
    for path in (home / name for name in names):
        # the rooms are links in a checkout: look into what they lead to
        inside = path.resolve().rglob("*") if path.is_dir() else [path]
        files += (p for p in inside if p.suffix in _SUFFIXES)
    return _digest_files(sorted(files), json.dumps(versions(), sort_keys=True))


def _digest_files(files: Iterable[Path], beside: str = "") -> str:
    digest = hashlib.sha256(beside.encode())
    for path in files:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _top(module: str) -> str:
    return module.partition(".")[0]


def _places(name: str) -> list[Path]:
    """Return the folders of a top-level package, or the file of a module."""
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return []
    if spec is None:
        return []
    if spec.submodule_search_locations is not None:  # has an __init__.py or not
        return [Path(folder) for folder in spec.submodule_search_locations]
    return [Path(spec.origin)] if spec.has_location and spec.origin else []


def _files(name: str) -> list[Path]:
    files: list[Path] = []
    for place in _places(name):
        files += place.rglob("*.py") if place.is_dir() else [place]
    return [path for path in files if path.is_file()]


def _is_installed(name: str) -> bool:
    """Whether a top-level module came with Python or through an installer."""
    standard = Path(sysconfig.get_path("stdlib"))
    return any(
        _INSTALLED & set(place.parts) or place.is_relative_to(standard)
        for place in _places(name)
    )


def _imports(files: Iterable[Path]) -> Iterator[str]:
    """Return the top-level names that Python files import, at any depth."""
    for path in files:
        if path.suffix != ".py":
            continue
        try:
            tree = ast.parse(path.read_bytes())
        except (SyntaxError, ValueError):  # not one that was imported, then
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                yield from (_top(alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                yield _top(node.module)
