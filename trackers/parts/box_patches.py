"""Patches around many boxes of a picture, each box stretched to the same square."""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.square_crops import sampled_squares

__all__ = ["BOX_SAMPLES", "PATCH_SAMPLES", "box_patches"]

PATCH_SAMPLES: Final = 64
"""Rows and columns of a patch."""
BOX_SAMPLES: Final = 44
"""Rows and columns of the box in the middle of it; the others show its surroundings."""
_MARGIN: Final = (PATCH_SAMPLES - BOX_SAMPLES) // 2
_REACH: Final = 2.0  # samples that are read around a patch


def box_patches(
    image: NDArray[np.uint8], boxes: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Return the patches of boxes.

    The picture is first shrunk by whole numbers, by areas, along each axis, so that two
    samples of the smallest patch are at most 1.5 pixels apart; what is outside it has
    its mean colour.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    boxes : (N, 4) float, px
        ``left, top, width, height``, at least one, with centres in the image; the
        smallest decide how far the picture is shrunk.

    Returns
    -------
    (N, 64, 64, 3) uint8

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking", CVPR 2016, section 5.1 and the authors' code: a box is stretched to 75 of
    the 107 samples of its patch. Here it is to 44 of 64: the same share, and a third of
    the samples, for the sake of speed.
    """
    steps = boxes[:, 2:] / BOX_SAMPLES
    low = (boxes[:, :2] - (_MARGIN + _REACH) * steps).min(axis=0)
    high = (boxes[:, :2] + (BOX_SAMPLES + _MARGIN + _REACH) * steps).max(axis=0)
    limits = np.array(image.shape[1::-1])
    factors = np.clip(np.floor(steps.min(axis=0) + 0.5), 1.0, limits).astype(np.int64)
    start = np.clip(np.floor(low), 0, limits - factors).astype(np.int64)
    stop = np.clip(np.ceil(high), start + factors, limits).astype(np.int64)
    counts = (stop - start) // factors
    (left, top), (right, bottom) = start.tolist(), (start + counts * factors).tolist()
    part = image[top:bottom, left:right]
    if factors.max() > 1:
        size = tuple(counts.tolist())
        small = cv2.resize(part, size, interpolation=cv2.INTER_AREA)
        part = np.asarray(small, np.uint8)
    scales = steps / factors
    firsts = (boxes[:, :2] + (0.5 - _MARGIN) * steps - start) / factors - 0.5
    fill = cv2.mean(image)[:3]
    return sampled_squares(part, scales, firsts, PATCH_SAMPLES, fill)
