"""Boxes as layouts write them: rectangles, polygons, masks, and what marks absence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.text import printable
from simbench.datasets.formats.readers.text import (
    NumberRows,
    number_rows,
    split_numbers,
)

__all__ = [
    "LEFT_TOP_WIDTH_HEIGHT",
    "is_without_area",
    "mask_box",
    "polygon_box",
    "read_boxes",
    "region_box",
    "require_count",
    "valid_boxes",
]

LEFT_TOP_WIDTH_HEIGHT: Final = "left,top,width,height"
_MOST_PIXELS: Final = 2**24
_NOWHERE: Final = (math.nan,) * 4


def read_boxes(
    root: Path, relative: str, nan: Literal["refused", "absent"] = "refused"
) -> NumberRows:
    """Return a file of boxes, one a line, NaN where the target is absent.

    Parameters
    ----------
    root : Path
    relative : str
    nan : {"refused", "absent"}
        What not-a-number means in the layout.

    Raises
    ------
    DatasetError
        See `valid_boxes`.
    """
    rows = number_rows(root, relative, {4}, LEFT_TOP_WIDTH_HEIGHT)
    return valid_boxes(rows, root / relative, nan)


def valid_boxes(
    rows: NumberRows, where: Path, nan: Literal["refused", "absent"] = "refused"
) -> NumberRows:
    """Return boxes with NaN where the target is absent: those without area.

    Raises
    ------
    DatasetError
        With file and line, if a number is missing, or a width or height negative.
    """
    boxes = rows.values
    is_nan = np.asarray(np.isnan(boxes).any(axis=1))
    is_wrong = np.asarray((boxes[:, 2:] < 0.0).any(axis=1))
    if nan == "refused":
        is_wrong |= is_nan
    if is_wrong.any():
        first = int(is_wrong.argmax())
        got = "not a number" if is_nan[first] else _shown(boxes[first])
        raise DatasetError(
            f"{where}:{rows.lines[first]}: expected {LEFT_TOP_WIDTH_HEIGHT} of a box, "
            f"got {got}"
        )
    gone = is_nan | is_without_area(boxes)
    return NumberRows(np.where(gone[:, None], np.nan, boxes), rows.lines)


def is_without_area(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which boxes mark an absent target: width or height is 0, (T,) bool."""
    return np.asarray((boxes[:, 2:] == 0.0).any(axis=1))


def require_count(rows: NumberRows, pictures: int, where: Path) -> None:
    """Refuse a file with another number of boxes than there are pictures.

    Raises
    ------
    DatasetError
        It names the line after the last box.
    """
    if len(rows.values) != pictures:
        last = int(rows.lines[-1])
        raise DatasetError(
            f"{where}:{last}: expected {pictures} boxes, one a picture, "
            f"got {len(rows.values)}"
        )


def region_box(line: str, where: str) -> tuple[tuple[float, ...], bool]:
    """Return the box of a region of the VOT toolkit, and whether the target is absent.

    Parameters
    ----------
    line : str
        A rectangle, a polygon, a mask ``m LEFT,TOP,WIDTH,HEIGHT,RUN,...``, or a code.
    where : str
        File and line, for messages.

    Returns
    -------
    box : (left, top, width, height), px
        NaN where the target is absent, or its region is not known (a code, NaN).
    is_absent : bool
        Whether the region has no area, which tells that the target is not there.

    Raises
    ------
    DatasetError
        If it is something else.
    """
    if line.startswith("m"):
        numbers = split_numbers(line[1:], where, "a mask")
        box = mask_box(numbers, where)
        return (_NOWHERE, True) if box is None else (box, False)
    what = "a rectangle, a polygon, a mask or a code"
    numbers = split_numbers(line, where, what)
    if len(numbers) == 1 or any(map(math.isnan, numbers)):
        return _NOWHERE, False
    if len(numbers) == 4:
        rows = NumberRows(np.array([numbers]), np.zeros(1, np.int64))
        if min(numbers[2:]) < 0.0:
            shown = _shown(rows.values[0])
            raise DatasetError(
                f"{where}: expected {LEFT_TOP_WIDTH_HEIGHT} of a box, got {shown}"
            )
        gone = bool(is_without_area(rows.values)[0])
        return (_NOWHERE, True) if gone else (tuple(numbers), False)
    if len(numbers) < 6 or len(numbers) % 2:
        raise DatasetError(f"{where}: expected {what}, got {len(numbers)} numbers")
    box = polygon_box(np.array(numbers).reshape(-1, 2))
    return (_NOWHERE, True) if box is None else (box, False)


def polygon_box(corners: NDArray[np.float64]) -> tuple[float, ...] | None:
    """Return the upright box of equal area around the centre of a polygon.

    Parameters
    ----------
    corners : (N, 2) float, px
        In order, clockwise or not.

    Returns
    -------
    (left, top, width, height), px, or None
        Its sides have the proportions of the polygon's bounding box. None for a
        polygon without area.

    Notes
    -----
    As the VOT toolkits of other trackers convert rotated rectangles (pysot,
    pytracking), without the pixel that they add to each side. The bounding box of a
    square on its corner has twice its area: overlaps with it would say little.

    Examples
    --------
    >>> polygon_box(np.array([[1.0, 0.0], [2.0, 1.0], [1.0, 2.0], [0.0, 1.0]]))[2] ** 2
    2.0000000000000004
    """
    low, high = corners.min(axis=0), corners.max(axis=0)
    from_low = corners - low
    nxt = np.roll(from_low, -1, axis=0)
    cross = from_low[:, 0] * nxt[:, 1] - nxt[:, 0] * from_low[:, 1]
    area = float(cross.sum()) / 2.0
    extent = high - low
    if abs(area) < 1e-9:
        return None
    center = low + ((from_low + nxt) * cross[:, None]).sum(axis=0) / (6.0 * area)
    size = extent * math.sqrt(abs(area) / float(extent.prod()))
    return (*(center - size / 2.0).tolist(), *size.tolist())


def mask_box(numbers: Sequence[float], where: str) -> tuple[float, ...] | None:
    """Return the box around the pixels of a mask, None where it has none.

    Parameters
    ----------
    numbers : sequence of float
        Left, top, width and height of the part that is encoded, then the lengths of
        alternating runs in row-major order, the first of zeros.
    where : str

    Raises
    ------
    DatasetError
        If they are no mask.
    """
    whole = np.array(numbers)
    if len(whole) < 4 or not (np.isfinite(whole) & (whole == whole.round())).all():
        raise DatasetError(f"{where}: expected a mask of whole numbers, got others")
    left, top, width, height = whole[:4].astype(np.int64).tolist()
    runs = whole[4:].astype(np.int64)
    if not 0 <= width * height <= _MOST_PIXELS or min(width, height) < 0:
        raise DatasetError(
            f"{where}: expected a mask of at most {_MOST_PIXELS} pixels, "
            f"got {width} x {height}"
        )
    if (runs < 0).any() or runs.sum() > width * height:
        raise DatasetError(
            f"{where}: expected runs of at most {width * height} pixels in all"
        )
    flat = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    pixels = np.zeros(width * height, np.bool_)
    pixels[: len(flat)] = flat
    box = box_around(pixels.reshape(height, width))
    if box is None:
        return None
    return (box[0] + left, box[1] + top, *box[2:])


def box_around(pixels: NDArray[np.bool_]) -> tuple[float, ...] | None:
    """Return left, top, width and height of the pixels that are set, (H, W) bool.

    None where there are none.

    Examples
    --------
    >>> box_around(np.array([[False, False], [False, True]]))
    (1.0, 1.0, 1.0, 1.0)
    """
    columns, rows = (np.flatnonzero(pixels.any(axis=axis)) for axis in (0, 1))
    if not len(columns):
        return None
    left, top = float(columns[0]), float(rows[0])
    return left, top, float(columns[-1]) - left + 1.0, float(rows[-1]) - top + 1.0


def _shown(box: NDArray[np.float64]) -> str:
    return printable(",".join(f"{value:g}" for value in box.tolist()))
