"""Files that every layout writes: pictures, CSV, JSON and other text."""

from __future__ import annotations

import collections.abc
import csv
import io
import json
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.datasets.frames import FrameFolder, encoded_png

__all__ = [
    "Entries",
    "IndexFiles",
    "SplitLayout",
    "csv_lines",
    "frame_rate_hz",
    "json_object",
    "name_lines",
    "refuse_iterator",
    "write_pictures",
    "write_text",
    "writing_below",
]

Entries = Iterable[Mapping[str, Any]]
IndexFiles = Iterator[tuple[str, Iterable[str]]]
_DEFAULT_RATE_HZ: Final = 30.0
"""Rate of a sequence of one picture: the VOT toolkit's default."""


@dataclass(frozen=True)
class SplitLayout:
    """A layout whose data sets are divided into splits.

    Attributes
    ----------
    split : str
        ``train``, ``val`` or ``test``: what the sequences belong to.
    """

    split: str = "val"


@contextmanager
def writing_below(root: Path) -> Iterator[None]:
    """Turn errors of the file system into a `DatasetError` that names the file."""
    try:
        yield
    except OSError as error:
        place = error.filename or root
        raise DatasetError(f"{place}: cannot write: {error.strerror}") from None


def refuse_iterator(entries: Iterable[object]) -> None:
    """Refuse an iterator, which would be silently empty when read a second time.

    Raises
    ------
    ValueError
        If ``entries`` is an iterator.
    """
    if isinstance(entries, Iterator):
        raise ValueError("entries are read more than once: give no iterator")


def name_lines(entries: Entries) -> Iterator[str]:
    """Yield the name of each sequence as a line."""
    return (f"{entry['name']}\n" for entry in entries)


def csv_lines(rows: Iterable[Iterable[object]]) -> Iterator[str]:
    r"""Yield the lines of a CSV file; cells with commas, or quotes, are quoted.

    Examples
    --------
    >>> list(csv_lines([("one,two", 3)]))
    ['"one,two",3\n']
    """
    for row in rows:
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(row)
        yield line.getvalue()


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8 with Unix line ends; its folders are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def write_pictures(
    frames: collections.abc.Sequence[Frame], path_of: Callable[[int], Path]
) -> NDArray[np.float64]:
    """Write every picture without loss, one at a time.

    Parameters
    ----------
    frames : sequence of T Frame
        The files of a `FrameFolder` are copied byte by byte and never decoded.
    path_of : callable of int
        File of the picture of that 0-based number; its folder is made. The bytes are
        those of a PNG file whatever the suffix: the readers of layouts that require
        ``.jpg`` look at the first bytes, not at the name.

    Returns
    -------
    (T,) float, s
        Time of each frame.

    Raises
    ------
    DatasetError
        If a picture no longer exists.
    """
    path_of(0).parent.mkdir(parents=True, exist_ok=True)
    if not isinstance(frames, FrameFolder):
        return np.array([_write(path_of(i), frame) for i, frame in enumerate(frames)])
    for index in range(len(frames)):
        source = frames.path(index)
        if not source.is_file():
            raise DatasetError(f"{source}: expected a picture, found none")
        shutil.copyfile(source, path_of(index))
    return frames.times_s


def _write(path: Path, frame: Frame) -> float:
    path.write_bytes(encoded_png(frame.image))
    return frame.time_s


def frame_rate_hz(times_s: NDArray[np.float64]) -> float:
    """Return the usual rate of frames with those times.

    Parameters
    ----------
    times_s : (T,) float, s

    Returns
    -------
    float, 1/s
        One over the median interval, which single lost frames do not change; rounded
        to a millionth, since times are sums of intervals. 30 for a single frame.
    """
    if len(times_s) < 2:
        return _DEFAULT_RATE_HZ
    return round(1.0 / float(np.median(np.diff(times_s))), 6)


def json_object(
    parts: Mapping[str, Mapping[str, Any] | Iterable[Any]],
) -> Iterator[str]:
    r"""Yield the text of a JSON object, the items of its lists one at a time.

    Parameters
    ----------
    parts : mapping from str to mapping or iterable
        An iterable becomes a list; it is read once, while the text is made, so it may
        be longer than memory can hold.

    Yields
    ------
    str
        Parts of one JSON object, in which each item has a line.

    Examples
    --------
    >>> "".join(json_object({"a": {"b": 1}, "c": iter([2, 3]), "d": []}))
    '{"a":{"b":1},\n"c":[\n2,\n3],\n"d":[]}\n'
    """
    between = "{"
    for name, part in parts.items():
        yield f"{between}{_json(name)}:"
        yield from [_json(part)] if isinstance(part, Mapping) else _json_list(part)
        between = ",\n"
    yield "}\n"


def _json_list(items: Iterable[Any]) -> Iterator[str]:
    between = "[\n"
    for item in items:
        yield between + _json(item)
        between = ",\n"
    yield "[]" if between == "[\n" else "]"


def _json(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)
