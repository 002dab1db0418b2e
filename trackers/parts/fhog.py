"""Felzenszwalb's histograms of oriented gradients: 31 channels a cell."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["CHANNELS", "cell_histograms", "fhog"]

DIRECTIONS = 18  # signed, over the full turn
UNSIGNED = DIRECTIONS // 2
CHANNELS = DIRECTIONS + UNSIGNED + 4
CLIP = 0.2
TEXTURE_WEIGHT = 0.2357  # about 1 / sqrt(18)
_REACH = 255  # of a difference of two grey levels


def fhog(grey: NDArray[np.uint8], cell: int) -> NDArray[np.float32]:
    """Return normalised histograms of gradient directions on a grid of cells.

    Parameters
    ----------
    grey : (H, W) uint8
    cell : int
        Side of a cell in pixels.

    Returns
    -------
    (31, H // cell, W // cell) float32
        Channels 0 to 17: signed directions, in steps of 20 degrees from x to y; 18 to
        26: the same without sign; 27 to 30: energy by normalisation. Directions are in
        [0, 0.4], energies in [0, 0.85].

    References
    ----------
    Felzenszwalb, Girshick, McAllester, Ramanan, "Object detection with
    discriminatively trained part-based models", IEEE Trans. PAMI 32(9), 2010, section
    6: every cell is divided by the norms of the four 2 x 2 blocks of cells that
    contain it and clipped at 0.2; the four results are summed over (halved) for
    directions, and directions over for energy.

    Notes
    -----
    Blocks beyond the border repeat the cells of the border. A gradient has one
    direction, the nearest; at the border of the image it is the one-sided difference.
    """
    histograms = cell_histograms(grey, cell)
    result: NDArray[np.float32] = _normalised(histograms)
    return np.ascontiguousarray(result.transpose(2, 0, 1))


def cell_histograms(grey: NDArray[np.uint8], cell: int) -> NDArray[np.float32]:
    """Return the sums of gradient magnitudes by cell and direction.

    Every pixel adds to the four nearest cells with bilinear weights.

    Parameters
    ----------
    grey : (H, W) uint8
    cell : int
        Side of a cell in pixels.

    Returns
    -------
    (H // cell, W // cell, 18) float32
    """
    result: NDArray[np.float32] = _histograms(grey, cell, _BINS)
    return result


def _nearest_directions() -> NDArray[np.uint8]:
    """Return the direction of every pair of differences, (511, 511) for y and x."""
    steps = np.arange(-_REACH, _REACH + 1)
    angles = np.arctan2(steps[:, None], steps[None, :])
    bins = np.round(angles / (2.0 * np.pi / DIRECTIONS)).astype(int) % DIRECTIONS
    return bins.astype(np.uint8)


_BINS = _nearest_directions()


@numba.njit(cache=True)
def _histograms(grey, cell, bins):  # type: ignore[no-untyped-def]  # numba infers
    rows, columns = grey.shape[0] // cell, grey.shape[1] // cell
    height, width = rows * cell, columns * cell
    # A border of one cell takes what would fall outside the grid.
    sums = np.zeros((rows + 2, columns + 2, DIRECTIONS), np.float32)
    for y in range(height):
        place_y = (y + 0.5) / cell + 0.5
        row = int(place_y)
        down = np.float32(place_y - row)
        above, below = max(y - 1, 0), min(y + 1, grey.shape[0] - 1)
        for x in range(width):
            before, after = max(x - 1, 0), min(x + 1, grey.shape[1] - 1)
            dx = np.int32(grey[y, after]) - np.int32(grey[y, before])
            dy = np.int32(grey[below, x]) - np.int32(grey[above, x])
            if dx == 0 and dy == 0:
                continue
            place_x = (x + 0.5) / cell + 0.5
            column = int(place_x)
            right = np.float32(place_x - column)
            direction = bins[dy + _REACH, dx + _REACH]
            size = np.float32(np.sqrt(np.float32(dx * dx + dy * dy)))
            upper, lower = size * (np.float32(1.0) - down), size * down
            left = np.float32(1.0) - right
            sums[row, column, direction] += upper * left
            sums[row, column + 1, direction] += upper * right
            sums[row + 1, column, direction] += lower * left
            sums[row + 1, column + 1, direction] += lower * right
    return sums[1:-1, 1:-1].copy()


@numba.njit(cache=True)
def _normalised(histograms):  # type: ignore[no-untyped-def]  # numba infers the types
    rows, columns, _ = histograms.shape
    energy = np.zeros((rows + 2, columns + 2), np.float32)
    for r in range(rows):
        for c in range(columns):
            total = np.float32(0.0)
            for d in range(UNSIGNED):
                both = histograms[r, c, d] + histograms[r, c, d + UNSIGNED]
                total += both * both
            energy[r + 1, c + 1] = total
    energy[0], energy[-1] = energy[1], energy[-2]
    energy[:, 0], energy[:, -1] = energy[:, 1], energy[:, -2]
    factors = np.empty((rows + 1, columns + 1), np.float32)
    for r in range(rows + 1):
        for c in range(columns + 1):
            block = energy[r, c] + energy[r, c + 1] + energy[r + 1, c]
            block += energy[r + 1, c + 1]
            factors[r, c] = np.float32(1.0) / np.sqrt(block + np.float32(1e-4))
    result = np.zeros((rows, columns, CHANNELS), np.float32)
    clip, half = np.float32(CLIP), np.float32(0.5)
    for r in range(rows):
        for c in range(columns):
            cell = result[r, c]  # its channels are side by side: vector code
            for k in range(4):
                factor = factors[r + k // 2, c + k % 2]
                texture = np.float32(0.0)
                for d in range(UNSIGNED):
                    first = histograms[r, c, d] * factor
                    second = histograms[r, c, d + UNSIGNED] * factor
                    both = min(first + second, clip)
                    first, second = min(first, clip), min(second, clip)
                    cell[d] += half * first
                    cell[d + UNSIGNED] += half * second
                    cell[d + DIRECTIONS] += half * both
                    texture += first + second
                cell[DIRECTIONS + UNSIGNED + k] = texture * np.float32(TEXTURE_WEIGHT)
    return result
