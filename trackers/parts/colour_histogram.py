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


@numba.njit(cache=True)
def histogram(  # type: ignore[no-untyped-def]  # numba infers the types
    image, table, ellipse, samples, counts
):
    """Add the colour counts of one ellipse to ``counts``, in place.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    table : (2**24,) uint8
        From `bin_table`.
    ellipse : (4,) float, px
        Centre x, y and half axes Hx, Hy.
    samples : (K, 2) float
        From `disc_samples`.
    counts : (BINS,) int64
        Added to. Samples outside the image are not counted.
    """
    height, width = image.shape[0], image.shape[1]
    for k in range(samples.shape[0]):
        column = math.floor(ellipse[0] + samples[k, 0] * ellipse[2])
        row = math.floor(ellipse[1] + samples[k, 1] * ellipse[3])
        if 0 <= column < width and 0 <= row < height:
            red = np.int64(image[row, column, 0])
            green = np.int64(image[row, column, 1])
            blue = np.int64(image[row, column, 2])
            counts[table[(red << 16) | (green << 8) | blue]] += 1


@numba.njit(cache=True)
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
    counts = np.zeros(BINS, np.int64)
    result = np.empty(ellipses.shape[0])
    for n in range(ellipses.shape[0]):
        counts[:] = 0
        histogram(image, table, ellipses[n], samples, counts)
        total = 0.0
        for u in range(support.shape[0]):
            total += roots[u] * sqrt_counts[counts[support[u]]]
        result[n] = min(total, 1.0)
    return result
