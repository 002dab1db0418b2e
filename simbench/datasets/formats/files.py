"""What every layout writes: pictures, copied one by one, and small text files."""

from __future__ import annotations

import collections.abc
import csv
import io
import shutil
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.datasets.frames import FrameFolder, encoded_png

__all__ = [
    "csv_row",
    "frame_rate_hz",
    "require_anew",
    "write_pictures",
    "write_text",
    "writing_below",
]

_UNTOLD_RATE_HZ: Final = 30.0
"""Rate of a sequence of one picture: the VOT toolkit's default."""


@contextmanager
def writing_below(root: Path) -> Iterator[None]:
    """Turn what the file system refuses into a `DatasetError` that names the file."""
    try:
        yield
    except OSError as error:
        place = error.filename or root
        raise DatasetError(f"{place}: cannot write: {error.strerror}") from None


def require_anew(entries: Iterable[object]) -> None:
    """Refuse an iterator: whoever walks twice would find it used up, and say nothing.

    Raises
    ------
    ValueError
        If a second walk would not start anew.
    """
    if isinstance(entries, Iterator):
        raise ValueError("entries are read more than once: give no iterator")


def csv_row(*cells: object) -> str:
    r"""Return one line of a CSV file; cells with commas, or quotes, are quoted.

    Examples
    --------
    >>> csv_row("one,two", 3)
    '"one,two",3\n'
    """
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(cells)
    return line.getvalue()


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8 with Unix line ends; its folders are made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def write_pictures(
    frames: collections.abc.Sequence[Frame], place: Callable[[int], Path]
) -> NDArray[np.float64]:
    """Write every picture without loss, one at a time.

    Parameters
    ----------
    frames : sequence of T Frame
        The files of a `FrameFolder` are copied byte by byte and never decoded.
    place : callable of int
        File for the picture of that 0-based number; its folder is made. The bytes are
        those of a PNG file whatever the name ends in: the readers of layouts that ask
        for ``.jpg`` look at the first bytes, not at the name.

    Returns
    -------
    (T,) float, s
        When the pictures were taken.

    Raises
    ------
    DatasetError
        If a picture is not there any more.
    """
    place(0).parent.mkdir(parents=True, exist_ok=True)
    if not isinstance(frames, FrameFolder):
        return np.array([_write(place(i), frame) for i, frame in enumerate(frames)])
    for index in range(len(frames)):
        source = frames.path(index)
        if not source.is_file():
            raise DatasetError(f"{source}: wanted a picture, found none")
        shutil.copyfile(source, place(index))
    return frames.times_s


def _write(path: Path, frame: Frame) -> float:
    path.write_bytes(encoded_png(frame.image))
    return frame.time_s


def frame_rate_hz(times_s: NDArray[np.float64]) -> float:
    """Return the usual rate of pictures taken at those times.

    Parameters
    ----------
    times_s : (T,) float, s

    Returns
    -------
    float, 1/s
        One over the median interval, which single lost frames do not change; rounded
        to a millionth, since times are sums of intervals. 30 for a single picture.
    """
    if len(times_s) < 2:
        return _UNTOLD_RATE_HZ
    return round(1.0 / float(np.median(np.diff(times_s))), 6)
