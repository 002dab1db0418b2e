"""Normalised grey patches of a frame under affine states."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["PATCH_SIDE", "normalised_patches"]

PATCH_SIDE = 32  # px (DSP, section 3.3)
MIN_NORM = 1.0  # grey levels: a patch with a smaller norm counts as flat
REMAP_ROWS = 32_000  # cv2.remap accepts fewer than 2**15 rows

_STEPS = (np.arange(PATCH_SIDE) + 0.5) / PATCH_SIDE - 0.5
_GRID = np.stack([*np.meshgrid(_STEPS, _STEPS), np.ones((PATCH_SIDE, PATCH_SIDE))])


def normalised_patches(
    image: NDArray[np.uint8], states: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the normalised grey patch of a frame at each of N states.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    states : (N, 2, 3) float, px
        Each maps the unit square [-0.5, 0.5]^2 to the image.

    Returns
    -------
    (N, PATCH_SIDE**2) float32
        Grey levels, row by row, of mean 0 and norm 1; all 0 where a patch is flat.
        Outside the image the border is repeated.
    """
    points = np.einsum("nij,jrc->inrc", states, _GRID)  # (2, N, side, side)
    low = np.floor(points.min(axis=(1, 2, 3))).astype(int) - 2
    high = np.ceil(points.max(axis=(1, 2, 3))).astype(int) + 3
    size = np.array([image.shape[1], image.shape[0]])
    low, high = np.clip(low, 0, size - 1), np.clip(high, 1, size)
    high = np.maximum(high, low + 1)
    region = image[low[1] : high[1], low[0] : high[0]]
    grey: NDArray[np.uint8] = cv2.cvtColor(region, cv2.COLOR_RGB2GRAY).astype(np.uint8)
    grey, factors = _downsampled(grey, states)
    # Here pixel c spans [c, c + 1]; for OpenCV its centre is at c.
    columns = (points[0] - low[0]) * factors[0] - 0.5
    rows = (points[1] - low[1]) * factors[1] - 0.5
    patches = _interpolated(grey, columns.astype(np.float32), rows.astype(np.float32))
    patches -= patches.mean(axis=1, keepdims=True)
    norms = np.linalg.norm(patches, axis=1, keepdims=True)
    return (patches / np.where(norms < MIN_NORM, np.inf, norms)).astype(np.float32)


def _downsampled(
    grey: NDArray[np.uint8], states: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Shrink an image to about one pixel per patch sample, against aliasing.

    Returns the image and the (2,) ratios of its new size to its old size, x and y.
    """
    sides = np.hypot(states[:, 0, :2], states[:, 1, :2])  # (N, 2) px
    pixels_per_sample = float(np.median(sides.min(axis=1)) / PATCH_SIDE)
    if pixels_per_sample <= 1.0:
        return grey, np.ones(2)
    extent = np.array([grey.shape[1], grey.shape[0]])
    smaller = np.maximum(np.round(extent / pixels_per_sample), 1.0).astype(int)
    shrunk = cv2.resize(grey, smaller.tolist(), interpolation=cv2.INTER_AREA)
    return shrunk.astype(np.uint8), smaller / extent


def _interpolated(
    grey: NDArray[np.uint8], columns: NDArray[np.float32], rows: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return (N, side^2) interpolated grey levels at (N, side, side) points."""
    count = len(columns)
    columns, rows = columns.reshape(-1, PATCH_SIDE), rows.reshape(-1, PATCH_SIDE)
    parts = [
        cv2.remap(
            grey,
            columns[start : start + REMAP_ROWS],
            rows[start : start + REMAP_ROWS],
            interpolation=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        for start in range(0, len(columns), REMAP_ROWS)
    ]
    return np.concatenate(parts).reshape(count, -1).astype(np.float32)
