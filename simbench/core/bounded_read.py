"""Reading of files that others wrote: regular files only, of bounded size and depth.

A pipe, a device or a folder in place of a file is refused before it is opened, and a
file that is too large before it is read, so that no input makes a command wait, or
fills the memory.
"""

from __future__ import annotations

import json
import math
import os
import stat
from collections import Counter
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO, Final

from simbench.core.errors import DatasetError

__all__ = [
    "LARGEST_JSON",
    "open_below",
    "open_regular",
    "parse_json",
    "path_below",
    "read_below",
    "read_regular",
    "require_below",
]

_PIECE: Final = 2**16  # bytes
LARGEST_JSON: Final = 32 * 2**20
"""Most bytes of a JSON file."""
_DEEPEST: Final = 64  # levels of JSON
_MOST_VALUES: Final = 2_000_000  # of one JSON file

_KINDS: Final = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
# Not every system has all of them. A pipe that takes the place of the file between the
# two checks is opened without waiting for its writer.
_FLAGS: Final = (
    os.O_RDONLY
    | getattr(os, "O_NONBLOCK", 0)
    | getattr(os, "O_NOCTTY", 0)
    | getattr(os, "O_CLOEXEC", 0)
    | getattr(os, "O_BINARY", 0)
)


def open_regular(path: Path, most_bytes: int) -> BinaryIO:
    """Open a regular file of bounded size for reading.

    Parameters
    ----------
    path : Path
        A symbolic link is followed.
    most_bytes : int
        Largest accepted size; a file may grow after it was opened.

    Raises
    ------
    DatasetError
        If it is missing, unreadable, larger, or no regular file.
    """
    try:
        _require_regular(path, path.stat().st_mode)
        handle = os.open(path, _FLAGS)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        raise DatasetError(f"{path}: cannot be read: {reason}") from None
    try:
        opened = os.fstat(handle)
        _require_regular(path, opened.st_mode)
        _require_size(path, opened.st_size, most_bytes)
        return os.fdopen(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def read_regular(path: Path, most_bytes: int) -> bytes:
    """Return the content of a regular file of bounded size.

    Raises
    ------
    DatasetError
        As `open_regular`.
    """
    with open_regular(path, most_bytes) as file:
        return _read(file, path, most_bytes)


def path_below(root: Path, relative: str) -> Path:
    """Return the path of a file below a folder, links resolved.

    Parameters
    ----------
    root : Path
    relative : str
        Parts separated by ``/``.

    Raises
    ------
    DatasetError
        If the path, or a symbolic link on it, leads out of the folder.
    """
    require_below(relative, root)
    try:
        real = (root / relative).resolve()
        is_below = real.is_relative_to(root.resolve())
    except (OSError, RuntimeError, ValueError):  # RuntimeError: links in a circle
        is_below = False
    if not is_below:
        raise DatasetError(
            f"{root}: expected {relative} inside this folder, got a link that leads "
            "out of it"
        )
    return real


def read_below(root: Path, relative: str, most_bytes: int) -> bytes:
    """Return the content of a file below a folder, see `path_below`.

    Raises
    ------
    DatasetError
        As `open_below`.
    """
    with open_below(root, relative, most_bytes) as file:
        return _read(file, root / relative, most_bytes)


def open_below(root: Path, relative: str, most_bytes: int) -> BinaryIO:
    """Open a file below a folder, see `path_below`.

    Raises
    ------
    DatasetError
        As `path_below` and `open_regular`; it names the path inside the folder.
    """
    try:
        return open_regular(path_below(root, relative), most_bytes)
    except DatasetError as error:
        reason = str(error).partition(": ")[2]
        raise DatasetError(f"{root / relative}: {reason}") from None


def require_below(relative: str, root: object) -> None:
    """Refuse a path that leads out of a folder, or is none.

    Parameters
    ----------
    relative : str
        Parts separated by ``/``.
    root : object
        The folder or store, for the message.

    Raises
    ------
    DatasetError
        If it is empty or absolute, or has a part ``..``, or a NUL.
    """
    path = PurePosixPath(relative)
    is_inside = path.parts and not path.is_absolute() and ".." not in path.parts
    if not is_inside or "\0" in relative:
        raise DatasetError(
            f"{root}: expected a path inside this folder, got {relative[:80]!r}"
        )


def parse_json(content: bytes, where: object) -> Any:
    """Return the value of a JSON text that others wrote.

    Parameters
    ----------
    content : bytes
    where : object
        The file, for messages.

    Raises
    ------
    DatasetError
        If it is not JSON, has over 64 levels or 2 million values, a key twice, a
        number that is not finite, or text that is not Unicode.
    """
    _require_size(where, len(content), LARGEST_JSON)
    if sum(map(content.count, (b",", b"[", b"{"))) > _MOST_VALUES:
        raise DatasetError(
            f"{where}: expected at most {_MOST_VALUES} values of JSON, got more"
        )
    try:
        value = json.loads(content, object_pairs_hook=_unique)
        _require_plain(value)
    except RecursionError:
        raise DatasetError(
            f"{where}: expected JSON of at most {_DEEPEST} levels, got more"
        ) from None
    except ValueError as error:  # UnicodeDecodeError is one
        raise DatasetError(f"{where}: not valid JSON: {error}") from None
    return value


def _read(file: BinaryIO, path: Path, most_bytes: int) -> bytes:
    content = bytearray()
    try:
        # never more at a time than the size it tells: memory is taken before reading
        size = os.fstat(file.fileno()).st_size
        while piece := file.read(max(size + 1 - len(content), _PIECE)):
            content += piece
            if len(content) > most_bytes:  # it hides its size, or has grown
                _require_size(path, math.inf, most_bytes)
    except OSError as error:
        reason = error.strerror or error
        raise DatasetError(f"{path}: cannot be read: {reason}") from None
    if piece is None:  # of the kernel's own files, which wait for more
        raise DatasetError(f"{path}: cannot be read: it has no content yet")
    return bytes(content)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        twice = next(
            key for key, count in Counter(k for k, _ in pairs).items() if count > 1
        )
        raise ValueError(f"expected each key once, got {twice[:40]!r} more than once")
    return found


def _require_plain(value: Any) -> None:
    """Refuse values that other code cannot store, print or walk through."""
    pending = [(value, 1)]
    while pending:
        one, level = pending.pop()
        if isinstance(one, dict | list):
            if level > _DEEPEST:
                raise RecursionError
            parts = [*one, *one.values()] if isinstance(one, dict) else one
            pending.extend((part, level + 1) for part in parts)
        elif isinstance(one, float) and not math.isfinite(one):
            raise ValueError(f"expected finite numbers, got {one}")
        elif isinstance(one, str) and not one.isascii():
            one.encode()  # half of a surrogate pair cannot be


def _require_regular(path: Path, mode: int) -> None:
    if stat.S_ISREG(mode):
        return
    kind = next((name for is_kind, name in _KINDS if is_kind(mode)), "something else")
    raise DatasetError(f"{path}: cannot be read: expected a regular file, got {kind}")


def _require_size(path: object, size: float, most_bytes: int) -> None:
    if size > most_bytes:
        raise DatasetError(
            f"{path}: cannot be read: expected at most {most_bytes} bytes, got "
            f"{'more' if math.isinf(size) else size}"
        )
