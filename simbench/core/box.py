"""Axis-aligned boxes in the image, single or as arrays of rows.

Image coordinates are continuous pixels with the origin at the outer corner of the
top-left pixel, x to the right and y down: the pixel in column ``c`` spans
``[c, c + 1]``. A box is ``left, top, width, height``, without the ``- 1`` of pixel
indices. Absent is NaN.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Box", "area", "centers", "clip", "gap", "overlap"]


@dataclass(frozen=True, slots=True)
class Box:
    """One box in continuous pixels.

    Attributes
    ----------
    left, top : float, px
        Outer top-left corner; may be outside the image.
    width, height : float, px
        Extent; at least 0.

    Examples
    --------
    >>> from simbench import Box
    >>> Box(left=10.0, top=20.0, width=30.0, height=40.0).center
    (25.0, 40.0)
    """

    left: float
    top: float
    width: float
    height: float

    @classmethod
    def from_array(cls, row: ArrayLike) -> Box:
        """Make a box from four numbers ``left, top, width, height``."""
        left, top, width, height = np.asarray(row, dtype=np.float64).tolist()
        return cls(left, top, width, height)

    @classmethod
    def from_center(cls, x: float, y: float, width: float, height: float) -> Box:
        """Make a box from its centre and extent in pixels."""
        return cls(x - width / 2.0, y - height / 2.0, width, height)

    @property
    def center(self) -> tuple[float, float]:
        """Centre ``x, y`` in px."""
        return self.left + self.width / 2.0, self.top + self.height / 2.0

    @property
    def is_finite(self) -> bool:
        """Whether all four numbers are finite."""
        return all(map(math.isfinite, (self.left, self.top, self.width, self.height)))

    def to_array(self) -> NDArray[np.float64]:
        """Return ``left, top, width, height`` as a (4,) float array."""
        return np.array([self.left, self.top, self.width, self.height])


def centers(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centres of boxes.

    Parameters
    ----------
    boxes : (..., 4) float, px
        ``left, top, width, height``; NaN rows give NaN centres.

    Returns
    -------
    (..., 2) float, px
        ``x, y``.
    """
    return boxes[..., :2] + boxes[..., 2:] / 2.0


def area(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the area of boxes, (..., 4) to (...,), in px^2."""
    product: NDArray[np.float64] = boxes[..., 2] * boxes[..., 3]
    return product


def overlap(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the intersection over union of boxes, row by row.

    Parameters
    ----------
    first, second : (..., 4) float, px
        ``left, top, width, height``; shapes must broadcast.

    Returns
    -------
    (...,) float, in [0, 1]
        Continuous-area overlap. NaN where either box is NaN. Two empty boxes
        (no area) overlap by 0.

    Examples
    --------
    >>> overlap(np.array([0.0, 0, 2, 2]), np.array([1.0, 0, 2, 2])).round(3).tolist()
    0.333
    """
    low, high = _common_corners(first, second)
    extent = np.maximum(high - low, 0.0)
    intersection = extent[..., 0] * extent[..., 1]
    union = area(first) + area(second) - intersection
    ratio: NDArray[np.float64] = intersection / np.where(union == 0.0, 1.0, union)
    return np.minimum(ratio, 1.0)


def clip(boxes: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """Return the part of boxes inside an image of ``width`` by ``height`` pixels.

    Parameters
    ----------
    boxes : (..., 4) float, px
        ``left, top, width, height``.
    width, height : int, px
        Image size.

    Returns
    -------
    (..., 4) float, px
        Boxes cut to the image; NaN where no area remains.
    """
    size = np.array([width, height], dtype=np.float64)
    low = np.clip(boxes[..., :2], 0.0, size)
    high = np.clip(boxes[..., :2] + boxes[..., 2:], 0.0, size)
    clipped = np.concatenate([low, high - low], axis=-1)
    clipped[~np.all(high > low, axis=-1)] = np.nan
    return clipped


def gap(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance between the edges of boxes, 0 where they touch or overlap.

    Parameters
    ----------
    first, second : (..., 4) float
        ``left, top, width, height``; shapes must broadcast.

    Returns
    -------
    (...) float
        NaN where either box is NaN.

    Examples
    --------
    >>> float(gap(np.array([0.0, 0, 10, 10]), np.array([13.0, 14, 5, 5])))
    5.0
    """
    low, high = _common_corners(first, second)
    distance: NDArray[np.float64] = np.linalg.norm(np.maximum(low - high, 0.0), axis=-1)
    return distance


def _common_corners(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return both corners of the intersection, (..., 2) px; swapped where disjoint."""
    low = np.maximum(first[..., :2], second[..., :2])
    high = np.minimum(
        first[..., :2] + first[..., 2:], second[..., :2] + second[..., 2:]
    )
    return low, high
