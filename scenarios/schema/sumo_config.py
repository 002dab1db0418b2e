"""Files of a user's SUMO network: paths, options and digests."""

from __future__ import annotations

import hashlib
import json
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from simbench.core.bounded_read import path_below, read_regular
from simbench.core.errors import DatasetError
from simbench.scenarios.schema.sumo_scan import (
    LARGEST_XML,
    MOST_VEHICLES,
    SumoScan,
    is_output,
    read_xml,
    scan_xml,
)

__all__ = [
    "SumoFiles",
    "read_files",
    "with_absolute_paths",
    "with_file_digests",
]

_LIBRARY = "library:"
_PATH_KEYS = ("sumo", "routes")
_MOST_FILES = 100

_FILE_OPTIONS = ("net-file", "route-files", "additional-files")
_SYNONYMS = {
    "net": "net-file",
    "routes": "route-files",
    "additional": "additional-files",
}
_NUMBER = r"-?\d+(?:\.\d+)?"
_FLAG = "true or false", r"(?i:true|false|on|off|yes|no|1|0|x|t|f|-)", None
_WORD = "a word", r"[A-Za-z][A-Za-z0-9_.-]*", None
_TIME = "a number of seconds up to 1e7", rf"{_NUMBER}|(?:\d+:){{2,3}}\d+", 1e7
_TRAFFIC_OPTIONS: dict[str, tuple[str, str, float | None]] = {
    "begin": _TIME,
    "collision.action": _WORD,
    "collision.check-junctions": _FLAG,
    "default.action-step-length": _TIME,
    "default.carfollowmodel": _WORD,
    "default.speeddev": ("a number up to 10", _NUMBER, 10.0),
    "ignore-junction-blocker": _TIME,
    "ignore-route-errors": _FLAG,
    "lanechange.duration": _TIME,
    "lateral-resolution": ("a number up to 100", _NUMBER, 100.0),
    "max-depart-delay": _TIME,
    "no-internal-links": _FLAG,
    "scale": ("a number up to 100", r"\d+(?:\.\d+)?", 100.0),
    "step-method.ballistic": _FLAG,
    "time-to-impatience": _TIME,
    "time-to-teleport": _TIME,
}
"""Options of a configuration that influence the traffic, by what is expected of their
values, as text, pattern and largest number. Outputs are refused; others (windows, step
length, seed) are ignored: many exist in SUMO's own programs only."""


@dataclass(frozen=True, slots=True)
class SumoFiles:
    """Folder and options that SUMO is started with.

    Attributes
    ----------
    folder : Path
        Working directory of SUMO: the options name files relative to it.
    options : dict from str to str
        By SUMO's long names, without dashes.
    content : str
        SHA-256, as hex, over options and contents of all files, not their paths.
    """

    folder: Path
    options: dict[str, str]
    content: str

    @property
    def network(self) -> Path:
        """Path of the network file."""
        return self.folder / self.options["net-file"]


def read_files(sumo: str, routes: str | None) -> SumoFiles:
    """Read and check a configuration, or a network with its routes.

    Parameters
    ----------
    sumo : str
        Absolute path or ``library:NAME`` of a ``.sumocfg`` or a ``.net.xml``, which may
        be compressed (``.gz``).
    routes : str or None
        Routes of a network; None for a configuration, which names its own.

    Raises
    ------
    ValueError
        In one line, if a file is missing or of another kind.
    """
    path = _file_at(sumo)
    if path.name.endswith(".sumocfg"):
        if routes is not None:
            raise ValueError(
                f"{path}: a configuration names its routes itself, got routes too"
            )
        options = _configured(path)
    elif path.name.endswith((".net.xml", ".net.xml.gz")):
        if routes is None:
            raise ValueError(f"{path} needs routes: ... for its traffic")
        relative = os.path.relpath(_file_at(routes), path.parent)
        for name in (path.name, relative):
            if "," in name:
                raise ValueError(f"SUMO accepts no comma in a path, got {name!r}")
        options = {"net-file": path.name, "route-files": relative}
    else:
        raise ValueError(f"expected a .sumocfg or a .net.xml, got {str(path)!r}")
    digest = _checked_files(path.parent, options)
    traffic = {key: value for key, value in options.items() if key not in _FILE_OPTIONS}
    digest.update(json.dumps(traffic, sort_keys=True).encode())
    return SumoFiles(path.parent, options, digest.hexdigest())


def _checked_files(folder: Path, options: Mapping[str, str]) -> Any:
    """Check every file that SUMO will read; return the hash of their contents."""
    digest = hashlib.sha256()
    vehicles, count = 0.0, 0
    for option in _FILE_OPTIONS:
        pending = [folder / name for name in _listed(options.get(option, ""))]
        known = {*pending}
        while pending:
            path = pending.pop(0)
            count += 1
            if count > _MOST_FILES:
                raise ValueError(f"{folder}: expected at most {_MOST_FILES} files")
            content = _content(path)
            key = hashlib.sha256(content).digest()
            digest.update(key)
            scan = _scan(path, key)
            vehicles += scan.vehicles
            more = [_included(path, *one) for one in scan.reads]
            pending += [one for one in more if one not in known]
            known.update(more)
            if option == "net-file":
                _require_network(path, scan)
    vehicles *= float(options.get("scale", "1"))
    if vehicles > MOST_VEHICLES:
        raise ValueError(
            f"{folder / options['net-file']}: expected routes of at most "
            f"{MOST_VEHICLES} vehicles, got about {vehicles:.0f}"
        )
    return digest


def _scan(path: Path, key: bytes) -> SumoScan:
    """Scan a file, once for each content."""
    if key not in _scanned:
        while len(_scanned) >= _MOST_FILES:
            del _scanned[next(iter(_scanned))]
        _scanned[key] = scan_xml(path, read_xml(path))
    return _scanned[key]


_scanned: dict[bytes, SumoScan] = {}
"""Scans by the SHA-256 of a file: the same scenario is read many times."""


def _included(path: Path, element: str, name: str) -> Path:
    """Return the path of a file that another one names, inside its folder."""
    try:
        return path_below(path.parent, name)
    except DatasetError as error:
        raise ValueError(f"{path}: {element}: {error}") from None


def with_absolute_paths(road: Any, folder: Path) -> Any:
    """Return the ``road`` of a scenario file with absolute paths.

    Parameters
    ----------
    road : object
        As in the file, with samples; only ``sumo`` and ``routes`` change, unless they
        are ``library:NAME``.
    folder : Path
        To which the paths are relative.

    Raises
    ------
    ValueError
        In one line, if a text cannot be a path.
    """

    def absolute(path: str) -> str:
        if path.startswith(_LIBRARY):
            return path
        try:
            return str((folder / Path(path).expanduser()).resolve())
        except (OSError, RuntimeError, ValueError) as error:
            raise ValueError(f"{path!r} cannot be a path: {error}") from None

    return _with_paths(road, absolute)


def with_file_digests(road: Any) -> Any:
    """Return the ``road`` of a scenario file with files' SHA-256 in place of paths.

    Paths of files that cannot be read stay.
    """
    return _with_paths(road, _digest_at)


def _with_paths(value: Any, change: Callable[[str], str], is_path: bool = False) -> Any:
    """Return a value with every path changed: all texts below a path's key."""
    if isinstance(value, Mapping):
        return {
            key: _with_paths(item, change, is_path or key in _PATH_KEYS)
            for key, item in value.items()
        }
    if isinstance(value, list):
        return [_with_paths(item, change, is_path) for item in value]
    return change(value) if is_path and isinstance(value, str) else value


def _digest_at(path: str) -> str:
    try:
        if path.endswith(".sumocfg"):
            return read_files(path, None).content
        return hashlib.sha256(_content(_file_at(path))).hexdigest()
    except ValueError:
        return path


def _file_at(path: str) -> Path:
    if not path.startswith(_LIBRARY):
        return Path(path)
    shipped = Path(str(resources.files("simbench.scenarios"))) / "library" / "networks"
    return shipped / path.removeprefix(_LIBRARY)


def _configured(path: Path) -> dict[str, str]:
    content = read_xml(path)
    scan_xml(path, content)
    options = {}
    for element in ET.fromstring(content).iter():
        name = _SYNONYMS.get(element.tag, element.tag)
        value = element.get("value", element.get("v"))
        if value is None:
            continue
        if name in _FILE_OPTIONS:
            options[name] = ",".join(_listed(value))
        elif name in _TRAFFIC_OPTIONS:
            options[name] = _option(path, name, value)
        elif is_output(name) and value not in ("", "NUL", "/dev/null"):
            raise ValueError(
                f"{path}: expected nothing that makes SUMO write a file, got "
                f'<{name[:60]} value="{value[:60]}">: remove it'
            )
    if "net-file" not in options:
        raise ValueError(f"{path}: net-file is missing")
    return options


def _option(path: Path, name: str, value: str) -> str:
    """Return the value of an option, which must be of its kind: SUMO would read on."""
    expected, pattern, largest = _TRAFFIC_OPTIONS[name]
    is_valid = re.fullmatch(pattern, value) is not None
    is_number = largest is not None and ":" not in value  # no time of day
    if not is_valid or (largest and is_number and abs(float(value)) > largest):
        raise ValueError(f"{path}: {name}: expected {expected}, got {value[:60]!r}")
    return value


def _listed(value: str) -> list[str]:
    """Split a list of files at commas, as SUMO does: names may contain blanks."""
    names = [part.strip() for part in value.split(",") if part.strip()]
    for name in names:
        if name.startswith("-"):  # SUMO would take it for an option
            raise ValueError(f"expected the name of a file, got {name[:60]!r}")
    return names


def _content(path: Path) -> bytes:
    try:
        return read_regular(path, LARGEST_XML)
    except DatasetError as error:
        raise ValueError(str(error)) from None


def _require_network(path: Path, scan: SumoScan) -> None:
    """Refuse files with which SUMO crashes without a message."""
    if scan.root != "net":
        raise ValueError(f"{path} is no network: expected <net>, got <{scan.root}>")
    if "version" not in scan.root_attributes:
        raise ValueError(f"{path} has no version: expected <net version=...>")
