"""Files of a user's SUMO network: paths, options and digests."""

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
    "open_text",
    "read_files",
    "with_absolute_paths",
    "with_file_digests",
]

NOT_XML = (ET.ParseError, OSError, EOFError, LookupError, ValueError, zlib.error)
"""Errors of reading XML that is damaged, compressed or in an unknown encoding."""

_LIBRARY = "library:"
_PATH_KEYS = ("sumo", "routes")

_FILE_OPTIONS = ("net-file", "route-files", "additional-files")
_SYNONYMS = {
    "net": "net-file",
    "routes": "route-files",
    "additional": "additional-files",
}
_TRAFFIC_OPTIONS = (
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
"""Options of a configuration that influence the traffic; others (windows, outputs, step
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
    digest = hashlib.sha256()
    for name in _FILE_OPTIONS:
        for part in _listed(options.get(name, "")):
            content = _content(path.parent / part)
            digest.update(hashlib.sha256(content).digest())
    _require_network(path.parent / options["net-file"])
    traffic = {key: value for key, value in options.items() if key not in _FILE_OPTIONS}
    digest.update(json.dumps(traffic, sort_keys=True).encode())
    return SumoFiles(path.parent, options, digest.hexdigest())


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


def open_text(path: Path) -> IO[bytes]:
    """Open a file for reading, decompressed if its name ends in ``.gz``."""
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
        if value is not None and name in (*_FILE_OPTIONS, *_TRAFFIC_OPTIONS):
            options[name] = ",".join(_listed(value)) if name in _FILE_OPTIONS else value
    if "net-file" not in options:
        raise ValueError(f"{path}: net-file is missing")
    return options


def _listed(value: str) -> list[str]:
    """Split a list of files at commas, as SUMO does: names may contain blanks."""
    return [part.strip() for part in value.split(",") if part.strip()]


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror or error}") from None


def _require_network(path: Path) -> None:
    """Refuse files with which SUMO crashes without a message."""
    try:
        with open_text(path) as file:
            _, root = next(ET.iterparse(file, events=("start",)))
    except NOT_XML as error:
        raise ValueError(f"{path} is not XML: {error}") from None
    if root.tag != "net":
        raise ValueError(f"{path} is no network: expected <net>, got <{root.tag}>")
    if "version" not in root.attrib:
        raise ValueError(f"{path} has no version: expected <net version=...>")
