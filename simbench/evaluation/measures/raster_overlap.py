"""Overlap of boxes on the grid of pixels, as the VOT toolkit computes it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["raster_overlap"]


def raster_overlap(
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    size: tuple[int, int],
) -> NDArray[np.float64]:
    """Return the intersection over union of boxes in whole pixels, row by row.

    Parameters
    ----------
    first, second : (T, 4) float, px
        ``left, top, width, height``, finite. A box without area is empty.
    size : (width, height) of int, px
        Image outside which pixels do not count.

    Returns
    -------
    (T,) float, in [0, 1]
        1 where the joint extent is at most one pixel in a direction, so where both are
        empty (and, an accident, for two boxes in the same column or row of pixels).

    Notes
    -----
    Numbers are rounded to even as 32-bit floats, as in vot-toolkit 0.9.0
    (``region/raster.py``), with pixels from 0 to ``width - 1``.
    """
    boxes = [
        np.round(one.astype(np.float32)).astype(np.float64) for one in (first, second)
    ]
    low = [one[:, :2] for one in boxes]
    high = [one[:, :2] + one[:, 2:] - 1.0 for one in boxes]  # the last pixel
    union_low, union_high = np.minimum(*low), np.maximum(*high)
    is_nothing = (union_low >= union_high).any(axis=1)
    union_low = np.maximum(union_low, 0.0)
    union_high = np.minimum(union_high, np.array(size) - 1.0)
    is_outside = (union_low >= union_high).any(axis=1)
    counts = [
        _pixels(np.maximum(a, union_low), np.minimum(b, union_high))
        for a, b in zip(low, high, strict=True)
    ]
    shared = _pixels(
        np.maximum.reduce([*low, union_low]), np.minimum.reduce([*high, union_high])
    )
    union = counts[0] + counts[1] - shared
    ratio = shared / np.where(union > 0.0, union, 1.0)
    return np.where(is_nothing, 1.0, np.where(is_outside, 0.0, ratio))


def _pixels(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the numbers of pixels between corners, both included."""
    return np.asarray(np.prod(np.maximum(high - low + 1.0, 0.0), axis=1))
