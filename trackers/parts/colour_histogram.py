"""Colour histograms of ellipses, compared with one reference histogram.

A look-up table maps RGB directly to the bin, so that no part of the frame is
converted; an ellipse is sampled at a fixed set of points spread evenly over it, so that
the cost does not grow with the target.
"""

from __future__ import annotations

import functools
import math

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BINS",
    "bin_table",
    "disc_samples",
    "histogram",
    "ring_samples",
    "similarities",
]

BINS = 8 * 8 * 4  # hue, saturation, value (DPF, section II)


@functools.cache
def bin_table() -> NDArray[np.uint8]:
    """Return the HSV bin of every 8-bit RGB colour.

    Returns
    -------
    (2**24,) uint8, in [0, BINS)
        Entry ``r << 16 | g << 8 | b`` is ``(h * 8 + s) * 4 + v``, with h, s and v the
        bins among 8, 8 and 4 of OpenCV's 8-bit hue (0-179), saturation and value.
        Read-only, computed once per process.
    """
    table = np.empty((256, 256 * 256), np.uint8)
    green, blue = np.divmod(np.arange(256 * 256), 256)
    colours = np.stack([np.zeros_like(green), green, blue], axis=-1).astype(np.uint8)
    for red in range(256):  # plane by plane: 16 M colours at once take 200 MB
        colours[:, 0] = red
        hsv = cv2.cvtColor(colours[None], cv2.COLOR_RGB2HSV)[0].astype(np.int32)
        hue = hsv[:, 0] * 8 // 180
        table[red] = (hue * 8 + hsv[:, 1] // 32) * 4 + hsv[:, 2] // 64
    flat = table.reshape(-1)
    flat.flags.writeable = False
    return flat


def disc_samples(count: int) -> NDArray[np.float64]:
    """Return points spread evenly over the unit disc, in a sunflower pattern.

    Parameters
    ----------
    count : int
        Number of points, at least 1.

    Returns
    -------
    (count, 2) float, in [-1, 1]
        ``x, y``; each represents the same area.

    References
    ----------
    Vogel (1979), "A better way to construct the sunflower head", Math. Biosci. 44.
    """
    index = np.arange(count)
    radius = np.sqrt((index + 0.5) / count)
    angle = index * math.pi * (3.0 - math.sqrt(5.0))  # the golden angle
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def ring_samples(count: int, inner: float, outer: float) -> NDArray[np.float64]:
    """Return points spread evenly over a ring between two radii.

    Returns
    -------
    (count, 2) float, in [-outer, outer]
        ``x, y``; each represents the same area.
    """
    disc = disc_samples(count)
    radius = np.hypot(disc[:, 0], disc[:, 1])
    spread = np.sqrt(inner**2 + (outer**2 - inner**2) * radius**2)
    return disc * (spread / radius)[:, None]


def histogram(
    image: NDArray[np.uint8],
    table: NDArray[np.uint8],
    ellipse: NDArray[np.float64],
    samples: NDArray[np.float64],
) -> NDArray[np.int64]:
    """Return the colour counts of one ellipse, (BINS,).

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    table : (2**24,) uint8
        From `bin_table`.
    ellipse : (4,) float, px
        Centre x, y and half axes Hx, Hy.
    samples : (K, 2) float
        From `disc_samples`. Those outside the image are not counted.
    """
    points = np.ascontiguousarray(samples.T)
    counts = np.zeros((2, BINS), np.int32)
    add_counts(image, table, ellipse, points, np.empty(points.shape, np.int32), counts)
    return np.asarray(counts.sum(axis=0, dtype=np.int64))


@numba.njit(cache=True, error_model="numpy")
def add_counts(  # type: ignore[no-untyped-def]  # numba infers the types
    image, table, ellipse, points, places, counts
):
    """Add the colour counts of one ellipse to ``counts``, in place.

    Parameters
    ----------
    image, table, ellipse
        As for `histogram`.
    points : (2, K) float
        x, then y of the samples.
    places : (2, K) int32
        Space to work in: columns and rows are found first, for all points at once.
    counts : (2, BINS) int32
        Added to: points go to the two rows alternately, since a count that was just
        written is read slowly. Points outside the image are not counted.
    """
    height, width = np.uint32(image.shape[0]), np.uint32(image.shape[1])
    x, y, half_width, half_height = ellipse[0], ellipse[1], ellipse[2], ellipse[3]
    for k in range(points.shape[1]):
        places[0, k] = np.int32(np.floor(x + points[0, k] * half_width))
        places[1, k] = np.int32(np.floor(y + points[1, k] * half_height))
    for k in range(points.shape[1]):
        column, row = np.uint32(places[0, k]), np.uint32(places[1, k])
        if column < width and row < height:  # negative ones are large
            red = np.uint32(image[row, column, 0]) << np.uint32(16)
            green = np.uint32(image[row, column, 1]) << np.uint32(8)
            blue = np.uint32(image[row, column, 2])
            counts[k & 1, table[red | green | blue]] += 1


@numba.njit(cache=True, error_model="numpy")
def similarities(  # type: ignore[no-untyped-def]  # numba infers the types
    image, table, ellipses, samples, reference
):
    """Return the Bhattacharyya coefficient of every ellipse with a reference.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    table : (2**24,) uint8
        From `bin_table`.
    ellipses : (N, 4) float, px
        Centre x, y and half axes Hx, Hy.
    samples : (K, 2) float
        From `disc_samples`.
    reference : (BINS,) float
        Shares by colour, summing to at most 1.

    Returns
    -------
    (N,) float, in [0, 1]
        ``rho = sum_u sqrt(p_u q_u)`` with p_u = counts / K. Samples outside the image
        match no colour, so that rho falls as an ellipse leaves it.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), eq. 2.
    """
    support = np.flatnonzero(reference)  # a car has a few dozen of the 256 colours
    roots = np.sqrt(reference[support])
    sqrt_counts = np.sqrt(np.arange(samples.shape[0] + 1) / samples.shape[0])
    points = np.ascontiguousarray(samples.T)
    places = np.empty(points.shape, np.int32)
    counts = np.zeros((2, BINS), np.int32)
    result = np.empty(ellipses.shape[0])
    for n in range(ellipses.shape[0]):
        counts[:] = 0
        add_counts(image, table, ellipses[n], points, places, counts)
        total = 0.0
        for u in range(support.shape[0]):
            count = counts[0, support[u]] + counts[1, support[u]]
            total += roots[u] * sqrt_counts[count]
        result[n] = min(total, 1.0)
    return result
