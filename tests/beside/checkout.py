"""Checks an earlier commit out beside the present one."""

from __future__ import annotations

import subprocess
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from packaging.requirements import Requirement

__all__ = [
    "ROOT",
    "checked_out",
    "full_commit",
    "is_changed",
    "require_dependencies",
]

ROOT: Final = Path(__file__).resolve().parents[2]
"""The present sources."""


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """Check a commit out beside the present one, as long as it is needed."""
    git = ["git", "-C", str(ROOT), "worktree"]
    with tempfile.TemporaryDirectory(prefix="simbench-base-") as parent:
        folder = Path(parent) / "base"
        subprocess.run([*git, "add", "-q", "--detach", str(folder), commit], check=True)
        try:
            yield folder
        finally:
            subprocess.run([*git, "remove", "--force", str(folder)], check=True)


def full_commit(commit: str) -> str:
    """Return the full name of a commit.

    Raises
    ------
    SystemExit
        If there is none.
    """
    named = f"{commit}^{{commit}}"
    git = ["git", "-C", str(ROOT), "rev-parse", "--verify", "--quiet", named]
    found = subprocess.run(git, capture_output=True, text=True)
    if found.returncode:
        raise SystemExit(f"expected a commit, got {commit!r}")
    return found.stdout.strip()


def is_changed() -> bool:
    """Return whether the present sources differ from their commit."""
    git = ["git", "-C", str(ROOT), "status", "--porcelain"]
    return bool(subprocess.run(git, capture_output=True, check=True).stdout)


def require_dependencies(base: Path) -> None:
    """Require that the present environment serves a base, too.

    Raises
    ------
    SystemExit
        If it lacks something that the base needs, or has another version of it.
    """
    project = tomllib.loads((base / "pyproject.toml").read_text())["project"]
    for need in map(Requirement, project["dependencies"]):
        if need.marker is not None and not need.marker.evaluate():
            continue
        try:
            found = version(need.name)
        except PackageNotFoundError:
            found = "none"
        if found == "none" or not need.specifier.contains(found, prereleases=True):
            raise SystemExit(f"{base.name}: expected {need} installed, got {found}")
