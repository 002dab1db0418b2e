"""Distribution fields: smoothed histograms of grey levels at every pixel."""

from __future__ import annotations

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["LEVELS", "descend", "distribution_field"]

LEVELS = 16
LEVEL_DEVIATION = 0.625  # levels


def _level_shares() -> NDArray[np.float32]:
    """Return the smoothed distribution of each grey value, (256, LEVELS)."""
    levels = np.arange(LEVELS)
    own = np.arange(256) * LEVELS // 256
    distance = levels[None, :] - own[:, None]
    shares = np.exp(-0.5 * (distance / LEVEL_DEVIATION) ** 2)
    shares[np.abs(distance) > 2] = 0.0
    shares /= shares.sum(axis=1, keepdims=True)
    return np.asarray(shares, np.float32)


_SHARES = _level_shares()


def distribution_field(
    grey: NDArray[np.uint8], deviation: float
) -> NDArray[np.float32]:
    """Return the distribution field of an image.

    Parameters
    ----------
    grey : (H, W) uint8
    deviation : float, px
        Standard deviation of the smoothing in the image.

    Returns
    -------
    (H, W, LEVELS) float32
        Sums to 1 over the levels. The border of the image is repeated.

    References
    ----------
    Sevilla-Lara and Learned-Miller, "Distribution fields for tracking", CVPR 2012
    (DFT), section 2: an image is exploded into one layer for each level, 1 where the
    pixel has it; each layer is smoothed, and then the levels of each pixel.
    """
    side = 2 * int(np.ceil(3.5 * deviation)) + 1
    field = cv2.GaussianBlur(
        _SHARES[grey], (side, side), deviation, borderType=cv2.BORDER_REPLICATE
    )
    return np.asarray(field, np.float32)


def descend(
    field: NDArray[np.float32], model: NDArray[np.float32], row: int, column: int
) -> tuple[int, int, float]:
    """Return the place of the local minimum of the distance of a field to a model.

    From the given place it goes to the nearest of eight neighbours in L1 distance
    until none is nearer (DFT, section 3).

    Parameters
    ----------
    field : (H, W, LEVELS) float32
        Of the search region.
    model : (h, w, LEVELS) float32
        Of the target.
    row, column : int
        Top left of the target in the field; in [0, H - h] and [0, W - w].

    Returns
    -------
    row, column : int
    distance : float, in [0, 2]
        Mean over the pixels of the sum of absolute differences.
    """
    found = _descended(field, model, row, column)
    return int(found[0]), int(found[1]), float(found[2])


@numba.njit(cache=True)
def _distance(field, model, top, left):  # type: ignore[no-untyped-def]  # numba
    total = 0.0
    for r in range(model.shape[0]):
        line = np.float32(0.0)
        for c in range(model.shape[1]):
            for k in range(model.shape[2]):
                line += abs(field[top + r, left + c, k] - model[r, c, k])
        total += float(line)
    return total / (model.shape[0] * model.shape[1])


@numba.njit(cache=True)
def _descended(field, model, row, column):  # type: ignore[no-untyped-def]  # numba
    rows = field.shape[0] - model.shape[0] + 1
    columns = field.shape[1] - model.shape[1] + 1
    known = np.full((rows, columns), np.inf)
    known[row, column] = _distance(field, model, row, column)
    while True:
        best_row, best_column = row, column
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(column - 1, 0), min(column + 2, columns)):
                if known[r, c] == np.inf:
                    known[r, c] = _distance(field, model, r, c)
                if known[r, c] < known[best_row, best_column]:
                    best_row, best_column = r, c
        if best_row == row and best_column == column:
            return row, column, known[row, column]
        row, column = best_row, best_column
