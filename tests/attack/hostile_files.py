"""Hostile inputs of every kind, each with a command line of simbench to try.

A command that gets one ends with exit status 0, 1 or 2 within seconds, prints no
traceback, needs no more than a gigabyte, and writes nothing outside of its output.
"""

from __future__ import annotations

import io
import json
import random
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from tests.attack.hostile_input import BAD_FILES, HostileInput
from tests.attack.hostile_networks import hostile_networks
from tests.attack.hostile_scenarios import hostile_scenarios

__all__ = ["HostileInput", "hostile_files"]

_KEY = "0123456789ab"
_ENTRY: dict[str, Any] = {
    "name": "a-0000",
    "key": _KEY,
    "scenario": {},
    "seed": 0,
    "digests": {},
    "summary": {"frames": 2, "made_with": {}},
    "layout": {},
    "files": [],
}
_MANIFEST: dict[str, Any] = {
    "layout": 1,
    "format": "native",
    "split": "",
    "channels": [],
    "licence": "",
    "sequences": 1,
    "productions": [{"command": "as typed", "digest": "0", "finished": True}],
}
_DEEP = "[" * 50_000 + "]" * 50_000
_TEXTS: dict[str, str | bytes] = {
    "empty": "",
    "deep list": _DEEP,
    "deep mapping": '{"a":' * 50_000 + "1" + "}" * 50_000,
    "deep without end": "[" * 100_000,
    "90 levels": "[" * 90 + "]" * 90,
    "many values": "[" + "0," * 3_000_000 + "0]",
    "many lists": "[" + "[]," * 3_000_000 + "[]]",
    "40 MB": '"' + "x" * 40_000_000 + '"',
    "NUL bytes": b"\0" * 100,
    "no Unicode": b'{"a": "\xff"}',
    "UTF-16": '{"a": 1}'.encode("utf-16"),
    "list": "[]",
    "number": "3",
    "null": "null",
    "huge number": "9" * 10_000,
    "infinite": '{"a": 1e999}',
    "NaN": '{"a": NaN}',
    "lone surrogate": '{"a": "\\ud800"}',
    "lone surrogate as key": '{"\\ud800": 1}',
    "key twice": '{"layout": 1, "layout": 1}',
    "cut off": '{"layout": 1',
}
_VALUES: tuple[Any, ...] = (
    None,
    3,
    -1,
    1e300,
    10**30,
    True,
    "",
    "x" * 5000,
    [],
    {},
    [[]],
)


def hostile_files() -> Iterator[HostileInput]:
    """Yield all hostile inputs: scenarios, networks, entries, run files, archives."""
    yield from hostile_scenarios()
    yield from hostile_networks()
    for name, text in _TEXTS.items():
        yield HostileInput(f"entry: {name}", partial(_verify, None, text))
        yield HostileInput(f"manifest: {name}", partial(_verify, text, None))
        yield HostileInput(f"sequence.json: {name}", partial(_verify_sequence, text))
    for key in _ENTRY:
        for number, value in enumerate(random.Random(key).sample(_VALUES, 4)):
            text = json.dumps(_ENTRY | {key: value})
            yield HostileInput(f"entry: {key} {number}", partial(_verify, None, text))
    for key in _MANIFEST:
        for number, value in enumerate(random.Random(key).sample(_VALUES, 4)):
            text = json.dumps(_MANIFEST | {key: value})
            yield HostileInput(
                f"manifest: {key} {number}", partial(_verify, text, None)
            )
    for path in _OUTSIDE:
        text = json.dumps(_ENTRY | {"files": [path]})
        yield HostileInput(f"entry: names {path!r}", partial(_verify, None, text))
    for name, place in _PLACES.items():
        for file in ("dataset.json", f"entries/a-0000.{_KEY}.json", "entries"):
            make = partial(_verify_place, file, place)
            yield HostileInput(f"{file.partition('.')[0]} is a {name}", make)
        yield HostileInput(f"data set is a {name}", partial(_verify_whole, place))
    for name, archive in _ARCHIVES.items():
        yield HostileInput(f"archive: {name}", partial(_verify_archive, archive))
    for address in _ADDRESSES:
        yield HostileInput(
            f"address {address!r:.40}", partial(_verify_address, address)
        )


def _verify(
    manifest: str | bytes | None, entry: str | bytes | None, folder: Path
) -> list[str]:
    place = folder / "set"
    _put(
        place / "dataset.json", json.dumps(_MANIFEST) if manifest is None else manifest
    )
    content = json.dumps(_ENTRY) if entry is None else entry
    _put(place / "entries" / f"a-0000.{_KEY}.json", content)
    _put(folder / "outside" / "secret-name", "secret content")
    return ["verify", str(place), "-j", "1"]


def _verify_sequence(text: str | bytes, folder: Path) -> list[str]:
    _put(folder / "sequence" / "sequence.json", text)
    return ["verify", str(folder / "sequence"), "-j", "1"]


def _put(path: Path, content: str | bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


_OUTSIDE = (
    "../outside/secret-name",
    "/etc/passwd",
    "a/../../outside/secret-name",
    "..",
    ".",
    "",
    "/",
    "a\0b",
    "x" * 5000,
    "a//b",
    "\x1b[31m",
    "entries/../dataset.json",
)


_PLACES = BAD_FILES | {
    "link to a folder outside": lambda path: path.symlink_to("/etc"),
    "link to a file outside": lambda path: path.symlink_to("/etc/passwd"),
}


def _verify_place(
    file: str, place: Callable[[Path], object], folder: Path
) -> list[str]:
    arguments = _verify(None, None, folder)
    path = folder / "set" / file
    path.rename(folder / "moved")
    place(path)
    return arguments


def _verify_whole(place: Callable[[Path], object], folder: Path) -> list[str]:
    place(folder / "set")
    return ["verify", str(folder / "set"), "-j", "1"]


def _zipped(files: dict[str, bytes]) -> bytes:
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in files.items():
            file.writestr(name, content)
    return archive.getvalue()


_DATA_SET = {
    "dataset.json": json.dumps(_MANIFEST).encode(),
    f"entries/a-0000.{_KEY}.json": json.dumps(_ENTRY).encode(),
}
_ARCHIVES: dict[str, Callable[[], bytes]] = {
    "empty": lambda: b"",
    "no archive": lambda: b"PK\x03\x04" + b"\0" * 99,
    "cut off": lambda: _zipped(_DATA_SET)[:-30],
    "data set": lambda: _zipped(_DATA_SET),
    "bomb as manifest": lambda: _zipped({"dataset.json": b" " * 500_000_000}),
    "bomb as entry": lambda: _zipped(
        _DATA_SET | {f"entries/a-0000.{_KEY}.json": b" " * 500_000_000}
    ),
    "deep entry": lambda: _zipped(
        _DATA_SET | {f"entries/a-0000.{_KEY}.json": _DEEP.encode()}
    ),
    "names outside": lambda: _zipped(_DATA_SET | {"../outside/x": b"", "/etc/x": b""}),
    "many files": lambda: _zipped(_DATA_SET | {f"f/{n}": b"" for n in range(20_000)}),
}
_ADDRESSES = (
    "zip://",
    "zip://::",
    "nosuch://x",
    "memory://nothing",
    "file:///nowhere",
    "file://",
    "::",
    "simplecache::file:///nowhere",
    "\0",
    "x" * 5000,
    "",
    "/proc/self",
    "/dev",
)


def _verify_archive(archive: Callable[[], bytes], folder: Path) -> list[str]:
    _put(folder / "set.zip", archive())
    return ["verify", f"zip://::{folder / 'set.zip'}", "-j", "1"]


def _verify_address(address: str, folder: Path) -> list[str]:
    return ["verify", "-j", "1", "--", address]
