"""A user's own SUMO network: which files it is made of, and what they hold."""

from __future__ import annotations

import gzip
import hashlib
import json
import os
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import IO, Any, cast

__all__ = [
    "NOT_XML",
    "SumoFiles",
    "by_content",
    "located",
    "open_text",
    "placed",
    "read_files",
]

NOT_XML = (ET.ParseError, OSError, EOFError, LookupError, ValueError, zlib.error)
"""What reading XML, compressed or in an unknown encoding, may raise."""

_LIBRARY = "library:"
_PATHS = ("sumo", "routes")
"""What a road says of files."""

_FILES = ("net-file", "route-files", "additional-files")
_SYNONYMS = {
    "net": "net-file",
    "routes": "route-files",
    "additional": "additional-files",
}
_DRIVING = (
    "begin",
    "collision.action",
    "collision.check-junctions",
    "default.action-step-length",
    "default.carfollowmodel",
    "default.speeddev",
    "ignore-junction-blocker",
    "ignore-route-errors",
    "lanechange.duration",
    "lateral-resolution",
    "max-depart-delay",
    "no-internal-links",
    "scale",
    "step-method.ballistic",
    "time-to-impatience",
    "time-to-teleport",
)
"""Options of a configuration that decide how vehicles drive; the others (windows,
outputs, step length, seed) are left out: many exist in SUMO's own programs only."""


@dataclass(frozen=True, slots=True)
class SumoFiles:
    """What SUMO is started with.

    Attributes
    ----------
    folder : Path
        In which SUMO must run: the options name files relative to it.
    options : dict from str to str
        By SUMO's long names, without dashes.
    content : str
        SHA-256, as hex, over options and contents of all files, wherever they lie.
    """

    folder: Path
    options: dict[str, str]
    content: str

    @property
    def network(self) -> Path:
        """The network's file."""
        return self.folder / self.options["net-file"]


def read_files(path: Path, routes: Path | None) -> SumoFiles:
    """Read a configuration, or a network with its routes.

    Parameters
    ----------
    path : Path
        A ``.sumocfg`` or a ``.net.xml``, which may be compressed (``.gz``).
    routes : Path or None
        Routes of a network; a configuration names its own.

    Raises
    ------
    ValueError
        In one line, if a file is missing or is not what it should be.
    """
    if path.name.endswith(".sumocfg"):
        if routes is not None:
            raise ValueError(
                f"routes belong into the configuration {path}, or beside a .net.xml"
            )
        options = _configured(path)
    elif path.name.endswith((".net.xml", ".net.xml.gz")):
        if routes is None:
            raise ValueError(f"{path} needs routes: ..., or nobody drives on it")
        there = os.path.relpath(routes, path.parent)
        for name in (path.name, there):
            if "," in name:
                raise ValueError(f"SUMO takes no comma in a path, found {name!r}")
        options = {"net-file": path.name, "route-files": there}
    else:
        raise ValueError(f"wanted a .sumocfg or a .net.xml, found {str(path)!r}")
    digest = hashlib.sha256()
    for name in _FILES:
        for part in _listed(options.get(name, "")):
            file = path.parent / part
            digest.update(hashlib.sha256(_content(file)).digest())
    _require_network(path.parent / options["net-file"])
    driving = {key: value for key, value in options.items() if key not in _FILES}
    digest.update(json.dumps(driving, sort_keys=True).encode())
    return SumoFiles(path.parent, options, digest.hexdigest())


def placed(told: Any, folder: Path) -> Any:
    """Return what a scenario file says of its road, with absolute paths.

    Parameters
    ----------
    told : object
        As in the file, where it may hold draws; only ``sumo`` and ``routes`` change,
        if they are paths and not ``library:NAME``.
    folder : Path
        To which the paths are relative.

    Raises
    ------
    ValueError
        In one line, if a text can be no path.
    """

    def absolute(path: str) -> str:
        if path.startswith(_LIBRARY):
            return path
        try:
            return str((folder / Path(path).expanduser()).resolve())
        except (OSError, RuntimeError, ValueError) as error:
            raise ValueError(f"{path!r} can be no path: {error}") from None

    return _with_paths(told, absolute)


def by_content(told: Any) -> Any:
    """Return what a scenario file says of its road, draws and all, without paths.

    Parameters
    ----------
    told : object
        As in the file: mappings, lists and plain values.

    Returns
    -------
    object
        The same with, in place of each path, the SHA-256 of what it leads to; the path
        itself where nothing can be read.
    """
    return _with_paths(told, _digest_at)


def _with_paths(
    told: Any, change: Callable[[str], str], *, is_path: bool = False
) -> Any:
    """Return the same with every path in it changed: all texts below such a key."""
    if isinstance(told, Mapping):
        return {
            key: _with_paths(one, change, is_path=is_path or key in _PATHS)
            for key, one in told.items()
        }
    if isinstance(told, list):
        return [_with_paths(one, change, is_path=is_path) for one in told]
    return change(told) if is_path and isinstance(told, str) else told


def _digest_at(path: str) -> str:
    file = located(path)
    try:
        if file.name.endswith(".sumocfg"):
            return read_files(file, None).content
        return hashlib.sha256(_content(file)).hexdigest()
    except ValueError:
        return path


def located(path: str) -> Path:
    """Return the file that a kept path means."""
    if not path.startswith(_LIBRARY):
        return Path(path)
    shipped = Path(str(resources.files("simbench.scenarios"))) / "library" / "networks"
    return shipped / path.removeprefix(_LIBRARY)


def open_text(path: Path) -> IO[bytes]:
    """Open a file for reading, decompressed where its name ends in ``.gz``."""
    if path.suffix == ".gz":
        return cast("IO[bytes]", gzip.open(path, "rb"))
    return path.open("rb")


def _configured(path: Path) -> dict[str, str]:
    content = _content(path)
    try:
        root = ET.fromstring(content)
    except NOT_XML as error:
        raise ValueError(f"{path} is not XML: {error}") from None
    options = {}
    for element in root.iter():
        name = _SYNONYMS.get(element.tag, element.tag)
        value = element.get("value", element.get("v"))
        if value is not None and name in (*_FILES, *_DRIVING):
            options[name] = ",".join(_listed(value)) if name in _FILES else value
    if "net-file" not in options:
        raise ValueError(f"{path} names no net-file")
    return options


def _listed(value: str) -> list[str]:
    """Take a list of files apart: at commas as SUMO does, for names may hold blanks."""
    return [part.strip() for part in value.split(",") if part.strip()]


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror or error}") from None


def _require_network(path: Path) -> None:
    """Refuse what makes SUMO crash instead of complaining."""
    try:
        with open_text(path) as file:
            _, root = next(ET.iterparse(file, events=("start",)))
    except NOT_XML as error:
        raise ValueError(f"{path} is not XML: {error}") from None
    if root.tag != "net":
        raise ValueError(f"{path} is no network: wanted <net>, found <{root.tag}>")
    if "version" not in root.attrib:
        raise ValueError(f"{path} has no version: wanted <net version=...>")
