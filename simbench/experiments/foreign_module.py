"""Whether a tracker's module belongs to the user's project, before it is imported."""

from __future__ import annotations

import sysconfig
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path

from simbench.trackers.find_tracker import ENTRY_POINT_GROUP

__all__ = ["foreign_module"]

_LIBRARIES = ("stdlib", "platstdlib", "purelib", "platlib")


def foreign_module(spec: str) -> str:
    """Return the module of a tracker from outside the project, or an empty string.

    Parameters
    ----------
    spec : str
        As `simbench.trackers.find_tracker.find_tracker` takes it. Nothing is imported.

    Examples
    --------
    >>> foreign_module("still"), foreign_module("mine=os:system@command=ls")
    ('', 'os')
    """
    name = spec.partition("@")[0].rpartition("=")[2]
    module, colon, _ = name.partition(":")
    entries = entry_points(group=ENTRY_POINT_GROUP)
    installed = {entry.name: entry.module for entry in entries}
    is_known = not colon or module.lower() == "opencv" or name in installed
    if is_known or module in installed.values():
        return ""
    return "" if _is_of_project(module.partition(".")[0]) else module


def _is_of_project(package: str) -> bool:
    """Whether a package is in the working directory, and is no installed library."""
    if package == "simbench":
        return True
    try:
        found = find_spec(package)
    except (ImportError, ValueError):
        return False
    if found is None:
        return True  # there is nothing to import
    places = [*(found.submodule_search_locations or [])]
    places += [str(found.origin)] if found.has_location else []
    real = [Path(place).resolve() for place in places]
    libraries = [Path(sysconfig.get_path(name)).resolve() for name in _LIBRARIES]
    project = Path.cwd().resolve()
    return bool(real) and all(
        place.is_relative_to(project)
        and not any(place.is_relative_to(library) for library in libraries)
        for place in real
    )
