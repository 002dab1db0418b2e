"""Convolutions and pooling of small pictures, channels last, on one core.

All are without padding. Pictures are run one by one: what a layer copies of one fits
into the processor's cache.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

__all__ = [
    "convolve",
    "convolve_3x3",
    "kernel_matrix",
    "largest_of_3x3",
    "winograd_weights",
]

Picture = NDArray[np.float32]

_KERNEL_TRANSFORM = np.array(
    [[1.0, 0.0, 0.0], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [0.0, 0.0, 1.0]]
)
"""Matrix G of the reference."""


def convolve(values: Picture, weights: Picture, size: int, stride: int) -> Picture:
    """Return a convolution, as one matrix product.

    The values below the kernel are copied side by side for each place.

    Parameters
    ----------
    values : (H, W, C) float32
    weights : (size * size * C, K) float32
    size, stride : int
        Side of the kernel, and distance of two places.

    Returns
    -------
    (rows, columns, K) float32
    """
    height, width, channels = values.shape
    rows, columns = ((side - size) // stride + 1 for side in (height, width))
    down, right, channel = values.strides
    below = as_strided(
        values,
        (rows, columns, size, size * channels),
        (down * stride, right * stride, down, channel),
        writeable=False,
    )
    found: Picture = below.reshape(rows * columns, -1) @ weights
    return found.reshape(rows, columns, -1)


def kernel_matrix(weights: Picture) -> Picture:
    """Return weights, (K, C, k, k), as the matrix (k * k * C, K) of `convolve`."""
    return np.ascontiguousarray(weights.transpose(2, 3, 1, 0).reshape(-1, len(weights)))


def winograd_weights(weights: NDArray[np.floating]) -> Picture:
    """Return the weights of `convolve_3x3`, (16, C, K).

    Parameters
    ----------
    weights : (K, C, 3, 3) float
    """
    transform = _KERNEL_TRANSFORM
    found = np.einsum("ai,bj,kcij->abck", transform, transform, weights)
    return np.ascontiguousarray(found.reshape(16, *found.shape[2:]), np.float32)


def convolve_3x3(
    values: Picture, weights: Picture, biases: Picture, least: float
) -> Picture:
    """Return a convolution with a 3 x 3 kernel, with biases added.

    Tiles of 4 x 4 values, 2 apart, are transformed so that 16 products in place of 36
    give 2 x 2 results.

    Parameters
    ----------
    values : (H, W, C) float32
        H and W are even.
    weights : (16, C, K) float32
        As of `winograd_weights`.
    biases : (K,) float32
    least : float
        Smaller results become this: 0 is a ReLU, -inf none.

    Returns
    -------
    (H - 2, W - 2, K) float32

    References
    ----------
    Lavin and Gray, "Fast algorithms for convolutional neural networks", CVPR 2016,
    section 4.1: F(2x2, 3x3).
    """
    height, width, channels = values.shape
    rows, columns, outputs = height // 2 - 1, width // 2 - 1, weights.shape[-1]
    tiles = np.empty((16, rows, columns, channels), np.float32)
    _transform_tiles(values.reshape(height, -1), tiles)
    products = np.matmul(tiles.reshape(16, -1, channels), weights)
    found = np.empty((2 * rows, 2 * columns, outputs), np.float32)
    grid = products.reshape(16, rows, columns, outputs)
    _transform_products(grid, biases, np.float32(least), found)
    return found


def largest_of_3x3(values: Picture) -> Picture:
    """Return the maxima over 3 x 3 values, every 2 of them.

    Parameters
    ----------
    values : (H, W, C) float32

    Returns
    -------
    ((H - 1) // 2, (W - 1) // 2, C) float32
    """
    rows, columns = ((side - 3) // 2 * 2 + 1 for side in values.shape[:2])
    high = np.maximum(values[0:rows:2], values[1 : rows + 1 : 2])
    np.maximum(high, values[2 : rows + 2 : 2], out=high)
    wide = np.maximum(high[:, 0:columns:2], high[:, 1 : columns + 1 : 2])
    return np.maximum(wide, high[:, 2 : columns + 2 : 2], out=wide)


@numba.njit(cache=True)
def _transform_tiles(values: Picture, tiles: Picture) -> None:
    """Transform (H, W * C) values to (16, rows, columns, C): B' d B of the reference.

    Loops run over channels with one result each, so that they become vector code.
    """
    _, rows, columns, channels = tiles.shape
    line = np.empty(values.shape[1], np.float32)
    for row in range(rows):
        for number in range(4):
            first, second, sign = _terms(number)
            above, below = values[2 * row + first], values[2 * row + second]
            for index in range(len(line)):
                line[index] = above[index] + sign * below[index]
            for column in range(columns):
                start = 2 * column * channels
                for across in range(4):
                    left, right, side = _terms(across)
                    one = line[start + left * channels :]
                    other = line[start + right * channels :]
                    tile = tiles[4 * number + across, row, column]
                    for channel in range(channels):
                        tile[channel] = one[channel] + side * other[channel]


@numba.njit(cache=True)
def _terms(number: int) -> tuple[int, int, np.float32]:
    """Return the two entries of a column of B that are not 0, the second's sign."""
    if number == 0:
        return 0, 2, np.float32(-1.0)
    if number == 1:
        return 1, 2, np.float32(1.0)
    if number == 2:
        return 2, 1, np.float32(-1.0)
    return 1, 3, np.float32(-1.0)


@numba.njit(cache=True)
def _transform_products(
    products: Picture, biases: Picture, least: np.float32, found: Picture
) -> None:
    """Transform (16, rows, columns, K) products to results: A' m A of the reference."""
    _, rows, columns, outputs = products.shape
    part = np.empty((4, outputs), np.float32)
    for row in range(rows):
        for column in range(columns):
            for down in range(2):
                sign = np.float32(1.0 - 2.0 * down)
                for across in range(4):
                    first = products[4 * down + across, row, column]
                    second = products[4 * down + 4 + across, row, column]
                    third = products[4 * down + 8 + across, row, column]
                    total = part[across]
                    for k in range(outputs):
                        total[k] = first[k] + sign * (second[k] + third[k])
                m0, m1, m2, m3 = part[0], part[1], part[2], part[3]
                left = found[2 * row + down, 2 * column]
                for k in range(outputs):
                    left[k] = max(m0[k] + m1[k] + m2[k] + biases[k], least)
                right = found[2 * row + down, 2 * column + 1]
                for k in range(outputs):
                    right[k] = max(m1[k] - m2[k] - m3[k] + biases[k], least)
