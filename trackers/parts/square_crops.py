"""Square crops around a target, as Siamese networks see it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "EXEMPLAR_SAMPLES",
    "GROWTH_RANGE",
    "MIN_SIDE_PX",
    "SEARCH_SAMPLES",
    "context_side",
    "inside",
    "sampled_squares",
    "square_crops",
]

EXEMPLAR_SAMPLES: Final = 64
"""Rows and columns of a crop of `context_side`."""
SEARCH_SAMPLES: Final = 128
"""Rows and columns of a search region, at the same scale: twice as large."""
GROWTH_RANGE: Final = (0.2, 8.0)
"""Of a target's sides, relative to the first box."""
MIN_SIDE_PX: Final = 2.0
"""Of the first box."""


def context_side(width: float, height: float) -> float:
    """Return the side of the square that shows a target with context, in its unit.

    With p = (w + h) / 2 it has the area of a box that is larger by p in both
    directions: (w + p) (h + p).

    References
    ----------
    Bertinetto, Valmadre, Henriques, Vedaldi, Torr, "Fully-convolutional Siamese
    networks for object tracking", ECCV workshops 2016, section 3.1, equation 5.

    Examples
    --------
    >>> context_side(20.0, 20.0)
    40.0
    """
    context = (width + height) / 2.0
    return math.sqrt((width + context) * (height + context))


def inside(image: NDArray[np.uint8], x: float, y: float) -> tuple[float, float]:
    """Return a place, px, moved into an image (H, W, 3)."""
    height, width = image.shape[:2]
    return min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)


def square_crops(
    image: NDArray[np.uint8],
    x: float,
    y: float,
    sides: Sequence[float],
    samples: int,
) -> NDArray[np.uint8]:
    """Return square crops of several sides around a point.

    The picture is first shrunk by a whole number, by areas, so that two samples are
    at most 1.5 pixels apart; what is outside it has its mean colour.

    Parameters
    ----------
    image : (H, W, 3) uint8
    x, y : float, px
        Centre of the crops, in the image.
    sides : sequence of K float, px
        About the same, since the smallest decides how far the picture is shrunk.
    samples : int
        Rows and columns of each crop.

    Returns
    -------
    (K, samples, samples, 3) uint8
    """
    height, width = image.shape[:2]
    factor = min(max(math.floor(min(sides) / samples + 0.5), 1), width, height)
    reach = max(sides) / 2.0 + 2.0 * factor
    left, columns = _span(x, reach, width, factor)
    top, rows = _span(y, reach, height, factor)
    fill = cv2.mean(image)[:3]
    part = image[top : top + rows, left : left + columns]
    if factor > 1:
        size = (columns // factor, rows // factor)
        part = cv2.resize(part, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    scales, firsts = np.empty((2, len(sides), 2))
    for number, side in enumerate(sides):
        step = side / samples
        scales[number] = step / factor
        firsts[number, 0] = (x - side / 2.0 + step / 2.0 - left) / factor - 0.5
        firsts[number, 1] = (y - side / 2.0 + step / 2.0 - top) / factor - 0.5
    return sampled_squares(part, scales, firsts, samples, fill)


def sampled_squares(
    image: NDArray[np.uint8],
    scales: NDArray[np.float64],
    firsts: NDArray[np.float64],
    samples: int,
    fill: Sequence[float],
) -> NDArray[np.uint8]:
    """Return squares of as many rows and columns, sampled along the axes of an image.

    Parameters
    ----------
    image : (H, W, 3) uint8
    scales : (K, 2) float, px
        From one sample to the next, along x and y.
    firsts : (K, 2) float, px
        The first sample, x and y; 0 is the middle of the first pixel.
    samples : int
        Rows and columns of each square.
    fill : (3,) float
        Colour outside the image.

    Returns
    -------
    (K, samples, samples, 3) uint8
    """
    squares = np.empty((len(scales), samples, samples, 3), np.uint8)
    matrix = np.zeros((2, 3))
    for square, scale, first in zip(squares, scales, firsts, strict=True):
        matrix[0, 0], matrix[1, 1], matrix[:, 2] = scale[0], scale[1], first
        cv2.warpAffine(
            image,
            matrix,
            (samples, samples),
            dst=square,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=fill,
        )
    return squares


def _span(center: float, reach: float, limit: int, factor: int) -> tuple[int, int]:
    """Return the start and length of what is read of one side of the image, px.

    The length is a multiple of the factor, and at least once the factor.
    """
    start = min(max(math.floor(center - reach), 0), limit - factor)
    stop = min(max(math.ceil(center + reach), start + factor), limit)
    return start, (stop - start) // factor * factor
