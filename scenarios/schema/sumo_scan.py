"""Checks of the XML that SUMO reads: of bounded size, and without files to write.

SUMO writes wherever a detector, an edgeData or a parameter in its inputs names a file.
Such files are refused before SUMO starts.
"""

from __future__ import annotations

import gzip
import io
import re
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.parsers import expat

from simbench.core.bounded_read import read_regular
from simbench.core.errors import DatasetError

__all__ = [
    "LARGEST_XML",
    "MOST_VEHICLES",
    "SumoScan",
    "is_output",
    "read_xml",
    "scan_xml",
]

LARGEST_XML: Final = 64 * 2**20
"""Most bytes of a file, also after decompression."""
MOST_VEHICLES: Final = 100_000
"""Most vehicles that the routes of a scenario may contain."""

_MOST_ELEMENTS: Final = 500_000
_MOST_ATTRIBUTES: Final = 5_000_000
_DEEPEST: Final = 50
_PART: Final = 2**19  # bytes parsed at once
_LONGEST_FLOW_S: Final = 28_800.0  # scenarios end before that

_GZIP: Final = b"\x1f\x8b"
_READ: Final = {
    "include": "href",
    "rerouter": "file",
    "variableSpeedSign": "file",
    "calibrator": "file",
}
"""Elements with an attribute that names a file which SUMO reads."""
_NOT_OPENED: Final = {"imgFile", "osgFile"}  # by SUMO's own windows only
_NOWHERE: Final = {"", "NUL", "nul", "NULL", "/dev/null"}
_SINGLE: Final = {"vehicle", "trip", "person", "container"}
_FLOWS: Final = {"flow", "personFlow", "containerFlow"}
_NUMBER: Final = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?")


@dataclass(slots=True)
class SumoScan:
    """What one XML file of SUMO contains.

    Attributes
    ----------
    root : str
        Name of the first element.
    root_attributes : dict from str to str
    reads : list of (str, str)
        Elements that name a file which SUMO reads, and the file.
    vehicles : float
        About how many vehicles its routes and flows insert within hours.
    """

    root: str = ""
    root_attributes: dict[str, str] = field(default_factory=dict)
    reads: list[tuple[str, str]] = field(default_factory=list)
    vehicles: float = 0.0


def read_xml(path: Path) -> bytes:
    """Return the content of an XML file, decompressed if it is compressed.

    Raises
    ------
    ValueError
        In one line, if it is no regular file, damaged, or too large.
    """
    try:
        content = read_regular(path, LARGEST_XML)
    except DatasetError as error:
        raise ValueError(str(error)) from None
    if not content.startswith(_GZIP):  # SUMO looks at the content too, not at the name
        return content
    try:
        plain = gzip.GzipFile(fileobj=io.BytesIO(content)).read(LARGEST_XML + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise ValueError(f"{path}: is not XML: {error}") from None
    if len(plain) > LARGEST_XML:
        raise ValueError(
            f"{path}: expected at most {LARGEST_XML} bytes after decompression, got "
            "more"
        )
    return plain


def scan_xml(path: Path, content: bytes) -> SumoScan:
    """Check one XML file of SUMO.

    Parameters
    ----------
    path : Path
        For messages.
    content : bytes
        Decompressed.

    Raises
    ------
    ValueError
        In one line with the line number, if it is not XML, has a document type (and so
        entities), more than 500,000 elements or 50 levels, or an element that makes
        SUMO write a file.
    """
    scanner = _Scanner()
    parser = expat.ParserCreate()
    parser.StartElementHandler = scanner.start
    parser.EndElementHandler = scanner.end
    parser.StartDoctypeDeclHandler = scanner.doctype
    try:
        _parse(parser, content)
    except expat.ExpatError as error:
        raise ValueError(f"{path}: is not XML: {error}") from None
    except _RefusedError as error:
        raise ValueError(f"{path}:{parser.CurrentLineNumber}: {error}") from None
    except (LookupError, ValueError) as error:  # an unknown encoding
        raise ValueError(f"{path}: is not XML: {error}") from None
    return scanner.found


def _parse(parser: expat.XMLParserType, content: bytes) -> None:
    """Parse in parts: the time for one tag grows with the square of its attributes."""
    for start in range(0, len(content), _PART):
        if start - max(parser.CurrentByteIndex, 0) > 2 * _PART:
            raise _RefusedError(f"expected tags of at most {_PART} bytes, got more")
        parser.Parse(content[start : start + _PART], False)
    parser.Parse(b"", True)


def is_output(name: str) -> bool:
    """Whether an option, attribute or parameter of that name makes SUMO write a file.

    Examples
    --------
    >>> is_output("tripinfo-output"), is_output("device.ssm.file"), is_output("to")
    (True, True, False)
    """
    word = name.lower()
    return (
        word in ("dest", "href", "log", "message-log", "error-log", "save-template")
        or word.endswith(("file", "files", "filename", "output", "output-prefix"))
        or word.startswith(("save-", "output"))
    )


class _RefusedError(ValueError):
    """Something in well-formed XML that is refused."""


class _Scanner:
    """Handlers of expat for one file."""

    def __init__(self) -> None:
        self.found = SumoScan()
        self.elements = self.attributes = self.depth = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Check one element."""
        self.depth += 1
        self.elements += 1
        self.attributes += len(attributes)
        if self.depth > _DEEPEST:
            raise _RefusedError(f"expected at most {_DEEPEST} levels of XML, got more")
        if self.elements > _MOST_ELEMENTS or self.attributes > _MOST_ATTRIBUTES:
            raise _RefusedError(
                f"expected at most {_MOST_ELEMENTS} elements and {_MOST_ATTRIBUTES} "
                "attributes, got more"
            )
        element = tag.rpartition(":")[2]
        if self.elements == 1:
            self.found.root, self.found.root_attributes = element, attributes
        for name, value in attributes.items():
            self._check(element, name.rpartition(":")[2], value)
        if element == "param":
            _check_parameter(attributes)
        self.found.vehicles += _vehicles(element, attributes)

    def end(self, _tag: str) -> None:
        """Leave one element."""
        self.depth -= 1

    def doctype(self, name: str, *_: object) -> None:
        """Refuse what could define entities and default attributes."""
        raise _RefusedError(f"expected XML without <!DOCTYPE>, got {name[:40]}")

    def _check(self, element: str, name: str, value: str) -> None:
        if not is_output(name) or value in _NOWHERE or name in _NOT_OPENED:
            return
        if _READ.get(element) == name:
            self.found.reads.append((f"<{element} {name}>", value))
            return
        raise _RefusedError(
            f"expected nothing that makes SUMO write a file, got <{element} "
            f'{name}="{value[:60]}">'
        )


def _check_parameter(attributes: dict[str, str]) -> None:
    key, value = attributes.get("key", ""), attributes.get("value", "")
    writes = is_output(key) and value not in _NOWHERE
    # a device that writes a file of its own if none is named
    if writes or (key == "has.ssm.device" and value.lower() not in ("false", "0")):
        raise _RefusedError(
            "expected nothing that makes SUMO write a file, got "
            f'<param key="{key[:60]}" value="{value[:60]}">'
        )


def _vehicles(element: str, attributes: dict[str, str]) -> float:
    """Return about how many vehicles an element inserts."""
    if element in _SINGLE:
        return 1.0
    if element not in _FLOWS:
        return 0.0
    if "number" in attributes:
        return _value(attributes["number"], 0.0)
    start, end = _value(attributes.get("begin"), 0.0), attributes.get("end")
    lasts_s = min(_value(end, start + _LONGEST_FLOW_S) - start, _LONGEST_FLOW_S)
    per_hour = attributes.get("vehsPerHour", attributes.get("perHour"))
    rate = _value(per_hour, 0.0) / 3600.0 + _value(attributes.get("probability"), 0.0)
    if "period" in attributes:
        period = attributes["period"]
        # exp(RATE) is a rate, a number the time between two vehicles
        number = _value(period, 1.0)
        rate += number if "exp" in period else 1.0 / max(number, 1e-9)
    return max(lasts_s, 0.0) * max(rate, 0.0)


def _value(text: str | None, default: float) -> float:
    """Return the number in a text, or a default: SUMO itself reports what is wrong."""
    found = _NUMBER.search(text or "")
    return default if found is None or ":" in (text or "") else float(found[0])
