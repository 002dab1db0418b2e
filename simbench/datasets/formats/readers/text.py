"""Text files of annotations: of bounded size, read line by line with their numbers."""

from __future__ import annotations

import configparser
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import read_below
from simbench.core.errors import DatasetError
from simbench.core.text import printable

__all__ = [
    "NumberRows",
    "ini_section",
    "key_values",
    "number_rows",
    "split_numbers",
    "text_lines",
    "value_column",
]

_LARGEST: Final = 64 * 2**20  # bytes
_MOST_LINES: Final = 1_000_000
_LARGEST_NUMBER: Final = 1e6
_BETWEEN: Final = re.compile(r"[,;\s]+")


@dataclass(frozen=True, slots=True)
class NumberRows:
    """Rows of numbers and the lines that they are in.

    Attributes
    ----------
    values : (N, C) float
        NaN where the file says so.
    lines : (N,) int
        From 1.
    """

    values: NDArray[np.float64]
    lines: NDArray[np.int64]


def text_lines(root: Path, relative: str) -> list[str]:
    """Return the lines of a text file, without empty ones at its end.

    Raises
    ------
    DatasetError
        If it cannot be read, is empty, too large, no text, or leads out of ``root``.
    """
    where = root / relative
    content = read_below(root, relative, _LARGEST)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise DatasetError(f"{where}: expected text, got other bytes") from None
    lines = text.rstrip().splitlines()
    if not lines:
        raise DatasetError(f"{where}: expected a line a frame, got an empty file")
    if len(lines) > _MOST_LINES:
        raise DatasetError(
            f"{where}: expected at most {_MOST_LINES} lines, got {len(lines)}"
        )
    return lines


def number_rows(
    root: Path, relative: str, columns: Collection[int], what: str
) -> NumberRows:
    """Return the numbers of a file with the same number of columns in each line.

    Parameters
    ----------
    root : Path
    relative : str
    columns : collection of int
        How many there may be.
    what : str
        What a line holds, for messages, for example ``left,top,width,height``.

    Raises
    ------
    DatasetError
        With file and line, if it is something else.
    """
    rows: list[list[float]] = []
    for number, line in enumerate(text_lines(root, relative), start=1):
        where = f"{root / relative}:{number}"
        numbers = split_numbers(line, where, what)
        if len(numbers) not in columns or len(numbers) != len((rows or [numbers])[0]):
            raise DatasetError(f"{where}: expected {what}, got {_shown(line)}")
        rows.append(numbers)
    return NumberRows(np.array(rows), np.arange(1, len(rows) + 1))


def split_numbers(line: str, where: str, what: str) -> list[float]:
    """Return the numbers of a line, between commas, tabs, semicolons or blanks.

    Raises
    ------
    DatasetError
        If it has anything else, nothing, or a number beyond any picture.
    """
    try:
        numbers = [float(part) for part in _BETWEEN.split(line.strip(" \t,;\r"))]
    except ValueError:
        shown = _shown(line) if line.strip() else "an empty line"
        raise DatasetError(f"{where}: expected {what}, got {shown}") from None
    if any(abs(one) > _LARGEST_NUMBER for one in numbers):
        raise DatasetError(
            f"{where}: expected numbers of at most {_LARGEST_NUMBER:.0f}, "
            f"got {_shown(line)}"
        )
    return numbers


def value_column(root: Path, relative: str, count: int) -> NDArray[np.float64]:
    """Return a file of one number a line, (count,); NaN beyond its end.

    Raises
    ------
    DatasetError
        If it has more lines, or other content.
    """
    values = number_rows(root, relative, {1}, "one number").values[:, 0]
    if len(values) > count:
        raise DatasetError(
            f"{root / relative}:{count + 1}: expected {count} lines, one a frame, "
            f"got {len(values)}"
        )
    return np.concatenate([values, np.full(count - len(values), np.nan)])


def key_values(root: Path, relative: str, separator: str) -> dict[str, str]:
    """Return the lines ``KEY<separator>VALUE`` of a file; others are left out."""
    pairs = (line.partition(separator) for line in text_lines(root, relative))
    return {key.strip(): value.strip() for key, found, value in pairs if found}


def ini_section(root: Path, relative: str, section: str) -> Mapping[str, str]:
    """Return a section of an INI file, keys in lower case.

    Raises
    ------
    DatasetError
        If it is no INI file, or has no such section.
    """
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    try:
        parser.read_string("\n".join(text_lines(root, relative)))
        return dict(parser[section])
    except (configparser.Error, KeyError):
        raise DatasetError(
            f"{root / relative}: expected the section [{section}] of an INI file"
        ) from None


def _shown(line: str) -> str:
    text = printable(line.strip())
    return repr(text if len(text) <= 60 else f"{text[:57]}...")
