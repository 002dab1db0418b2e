"""Patches of a frame under affine states, cut from a region shrunk to their scale."""

from __future__ import annotations

import math
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["CODES", "Region", "gradient_patches", "grey_patches"]

BITS = 4  # of each colour channel in a colour code
CODES = (1 << (3 * BITS)) + 1  # the last one stands for points outside the image
FLAT_NORM = 1.0 / 32.0  # grey levels a sample: a patch below it counts as flat
FEW_LEVELS = 20.0  # grey levels a step: gradients far above it all count the same
MAX_SUBSAMPLES = 4  # along each axis of one point of a region
BORDER = 8.0  # px around the image that a region may cover
EXTENT = 0.85  # of the sides: from the centre, past the ring around a state


class Region:
    """Part of a frame, shrunk to one point per sample of a patch.

    Everything that a patch or a colour score reads of a frame is looked up here, so
    that the frame's pixels are converted once, not once per particle.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    states : (N, 2, 3) float, px
        Affine states the region covers, with a margin of some tenths of a box.
    step : (2,) float, px
        Distance of the region's points along x and y.
    within : (4,) float, px, optional
        Left, top, right and bottom of an earlier region that this one covers too.

    Attributes
    ----------
    origin, step : (2,) float, px
        Left upper corner, and distance of points along x and y.
    grey : (R, C) float32, in [0, 255]
        Mean of up to 4 x 4 pixels; the image's border is repeated outside.
    codes : (R, C) uint16, in [0, CODES)
        Colour with `BITS` bits a channel; ``CODES - 1`` outside the image.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        states: NDArray[np.float64],
        step: NDArray[np.float64],
        within: NDArray[np.float64] | None = None,
    ) -> None:
        low, high = _bounds(image, states)
        margin = 4.0 * step
        low, high = low - margin, high + margin
        if within is not None:
            low, high = np.minimum(low, within[:2]), np.maximum(high, within[2:])
        self.origin = np.floor(low)
        self.step = step
        columns, rows = np.maximum(np.ceil((high - self.origin) / step), 3).astype(int)
        self.grey = np.empty((rows, columns), np.float32)
        self.codes = np.empty((rows, columns), np.uint16)
        subsamples = min(max(round(float(step.max())), 1), MAX_SUBSAMPLES)
        _shrink(image, self.origin, step, subsamples, self.grey, self.codes)

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Left, top, right and bottom, (4,) px."""
        size = np.array([self.grey.shape[1], self.grey.shape[0]]) * self.step
        return np.concatenate([self.origin, self.origin + size])

    @cached_property
    def gradients(self) -> NDArray[np.float32]:
        """Gradient of the grey levels, (R, C, 2), of at most length 1.

        ``g / (|g| + FEW_LEVELS)``: strong edges count alike whatever the light, and
        noise counts little.
        """
        result = np.empty((*self.grey.shape, 2), np.float32)
        _soft_gradients(self.grey, result)
        return result

    def covers(self, image: NDArray[np.uint8], states: NDArray[np.float64]) -> bool:
        """Return whether states of the region's image are inside it."""
        low, high = _bounds(image, states)
        bounds = self.bounds
        return bool((low >= bounds[:2]).all() and (high <= bounds[2:]).all())


def grey_patches(
    region: Region, states: NDArray[np.float64], side: int
) -> NDArray[np.float32]:
    """Return the normalised grey patch at each of N states.

    Parameters
    ----------
    region : Region
    states : (N, 2, 3) float, px
        Each maps the unit square [-0.5, 0.5]^2 to the image.
    side : int
        Samples along each side of a patch.

    Returns
    -------
    (N, side**2) float32
        Grey levels, row by row, of mean 0 and norm 1; all 0 where a patch is flat.
    """
    result = np.empty((len(states), side**2), np.float32)
    flat = FLAT_NORM * side
    _cut(region.grey[..., None], states, region.origin, region.step, True, flat, result)
    return result


def gradient_patches(
    region: Region, states: NDArray[np.float64], side: int
) -> NDArray[np.float32]:
    """Return the patch of soft gradients at each of N states.

    Returns
    -------
    (N, 2 * side**2) float32
        Gradients along x, row by row, then along y, of norm 1 together; all 0 where a
        patch is flat. Parameters as for `grey_patches`.
    """
    result = np.empty((len(states), 2 * side**2), np.float32)
    flat = FLAT_NORM * side / FEW_LEVELS
    _cut(region.gradients, states, region.origin, region.step, False, flat, result)
    return result


def _bounds(
    image: NDArray[np.uint8], states: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the (2,) lowest and highest points, px, of states and their rings."""
    bounds = _extremes(states)
    size = np.array([image.shape[1], image.shape[0]], np.float64)
    low = np.minimum(np.maximum(bounds[:2], -BORDER), size - BORDER)
    high = np.minimum(np.maximum(bounds[2:], BORDER), size + BORDER)
    return low, high


@numba.njit(cache=True)
def _extremes(states):  # type: ignore[no-untyped-def]  # numba infers the types
    """Return lowest x and y, and highest x and y, of states with their rings."""
    result = np.array([np.inf, np.inf, -np.inf, -np.inf])
    for n in range(states.shape[0]):
        for k in range(2):
            extent = EXTENT * (abs(states[n, k, 0]) + abs(states[n, k, 1]))
            result[k] = min(result[k], states[n, k, 2] - extent)
            result[2 + k] = max(result[2 + k], states[n, k, 2] + extent)
    return result


@numba.njit(cache=True)
def _shrink(image, origin, step, count, grey, codes):  # type: ignore[no-untyped-def]
    """Fill a region: the means of ``count**2`` pixels around each of its points."""
    height, width = image.shape[0], image.shape[1]
    rows, columns = grey.shape
    samples = count * count
    xs = np.empty(columns * count, np.uintp)
    for i in range(columns * count):
        x = math.floor(origin[0] + (i + 0.5) / count * step[0])
        xs[i] = min(max(x, 0), width - 1)
    sums = np.empty((columns, 3), np.uint32)
    for row in range(rows):
        sums[:] = 0
        for i in range(count):
            y = math.floor(origin[1] + (row + (i + 0.5) / count) * step[1])
            line = image[min(max(y, 0), height - 1)]
            for column in range(columns):
                for x in xs[column * count : (column + 1) * count]:
                    for k in range(3):
                        sums[column, k] += line[x, k]
        y_centre = origin[1] + (row + 0.5) * step[1]
        for column in range(columns):
            red, green, blue = sums[column]
            luma = 0.299 * red + 0.587 * green + 0.114 * blue
            grey[row, column] = luma / samples
            shift = 8 - BITS
            code = (red // samples) >> shift
            code = (code << BITS) | ((green // samples) >> shift)
            code = (code << BITS) | ((blue // samples) >> shift)
            x_centre = origin[0] + (column + 0.5) * step[0]
            if not (0.0 <= x_centre < width and 0.0 <= y_centre < height):
                code = CODES - 1
            codes[row, column] = code


@numba.njit(cache=True)
def _soft_gradients(grey, result):  # type: ignore[no-untyped-def]  # numba infers
    rows, columns = grey.shape
    half, few = np.float32(0.5), np.float32(FEW_LEVELS)
    for row in range(rows):
        above, below = max(row - 1, 0), min(row + 1, rows - 1)
        for column in range(columns):
            left, right = max(column - 1, 0), min(column + 1, columns - 1)
            x = (grey[row, right] - grey[row, left]) * half
            y = (grey[below, column] - grey[above, column]) * half
            factor = np.float32(1.0) / (np.sqrt(x * x + y * y) + few)
            result[row, column, 0], result[row, column, 1] = x * factor, y * factor


@numba.njit(cache=True, fastmath={"reassoc", "contract", "nsz", "nnan"})
def _cut(  # type: ignore[no-untyped-def]  # numba infers the types
    grid, states, origin, step, centred, flat, result
):
    """Interpolate patches in a (R, C, channels) grid and normalise them, in place."""
    rows, columns, channels = grid.shape
    samples = result.shape[1] // channels
    side = int(math.sqrt(samples) + 0.5)
    zero, one, half = np.float32(0.0), np.float32(1.0), np.float32(0.5)
    last_x, last_y = np.float32(columns - 1.001), np.float32(rows - 1.001)
    per_side = one / np.float32(side)
    for n in range(states.shape[0]):
        a = np.float32(states[n, 0, 0] / step[0])
        b = np.float32(states[n, 0, 1] / step[0])
        c = np.float32((states[n, 0, 2] - origin[0]) / step[0] - 0.5)
        d = np.float32(states[n, 1, 0] / step[1])
        e = np.float32(states[n, 1, 1] / step[1])
        f = np.float32((states[n, 1, 2] - origin[1]) / step[1] - 0.5)
        total, squares = zero, zero
        for row in range(side):
            v = (np.float32(row) + half) * per_side - half
            for column in range(side):
                u = (np.float32(column) + half) * per_side - half
                x = min(max(a * u + b * v + c, zero), last_x)
                y = min(max(d * u + e * v + f, zero), last_y)
                # Unsigned: numba tests signed indices for negative values.
                left, top = np.uintp(x), np.uintp(y)
                p, q = x - np.float32(left), y - np.float32(top)
                right, below = left + np.uintp(1), top + np.uintp(1)
                w11 = p * q
                w10, w01 = p - w11, q - w11
                w00 = one - p - w01
                at = row * side + column
                for k in range(channels):
                    level = (
                        w00 * grid[top, left, k]
                        + w10 * grid[top, right, k]
                        + w01 * grid[below, left, k]
                        + w11 * grid[below, right, k]
                    )
                    result[n, k * samples + at] = level
                    total += level
                    squares += level * level
        mean = total / np.float32(result.shape[1]) if centred else zero
        squares -= total * mean
        norm = np.sqrt(max(squares, zero))
        factor = one / norm if norm >= flat else zero
        for i in range(result.shape[1]):
            result[n, i] = (result[n, i] - mean) * factor
