"""Compiled measurement of a cloud of ellipses, by colour and by structure.

The colour of every pixel in the region that the cloud covers is looked up once, however
many particles lie on it.
"""

from __future__ import annotations

import math

import numba
import numpy as np

__all__ = ["GREY_NOISE", "measure"]

GREY = np.float32(128.0)  # of a sample outside the image
GREY_NOISE = 1.0  # variance of a grey level, so that a flat patch correlates with none


@numba.njit(cache=True, error_model="numpy")
def fill(  # type: ignore[no-untyped-def]  # numba infers the types
    image, table, slots, left, top, columns, rows, cell, with_grey, bins, grey
):
    """Look up the slots of the colours of a region's cells, and mean grey levels.

    A cell of several pixels has the colour of the pixel at its middle. Grey levels are
    ``(R + 2 G + B) / 4``. Cells whose middle is outside the image have slot 0.
    """
    height, width = image.shape[0], image.shape[1]
    middle = cell // 2
    first = min(max((cell - 1 - middle - left) // cell, 0), columns)  # inside from here
    last = min(max((width - 1 - middle - left) // cell + 1, first), columns)
    for row in range(rows):
        start = row * columns
        y = top + row * cell
        inside = 0 <= y + middle < height
        for k in range(start, start + (first if inside else columns)):
            bins[k] = 0
            grey[k] = GREY
        if not inside:
            continue
        for k in range(start + last, start + columns):
            bins[k] = 0
            grey[k] = GREY
        for column in range(first, last):
            x = left + column * cell + middle
            red = np.int64(image[y + middle, x, 0])
            green = np.int64(image[y + middle, x, 1])
            blue = np.int64(image[y + middle, x, 2])
            bins[start + column] = slots[table[(red << 16) | (green << 8) | blue]]
            if with_grey and cell == 1:
                level = np.float32(red + 2 * green + blue) * np.float32(0.25)
                grey[start + column] = level
        if with_grey and cell > 1:
            fill_grey(image, left, y, cell, grey[start + first : start + last], first)


@numba.njit(cache=True, error_model="numpy")
def fill_grey(image, left, y, cell, grey, first):  # type: ignore[no-untyped-def]
    """Set the mean grey levels of a row of cells, the first being number ``first``."""
    height, width = image.shape[0], image.shape[1]
    count = grey.shape[0]
    if y < 0 or y + cell > height:
        for k in range(count):
            grey[k] = mean_grey(image, left + (first + k) * cell, y, cell)
        return
    whole = np.float32(4 * cell * cell)
    is_pair = cell == 2
    for k in range(count):
        x = left + (first + k) * cell
        if x < 0 or x + cell > width:
            grey[k] = mean_grey(image, x, y, cell)
            continue
        if is_pair:  # a size that the compiler knows
            total = grey_sum(image, np.uintp(x), np.uintp(y), np.uintp(2))
        else:
            total = grey_sum(image, np.uintp(x), np.uintp(y), np.uintp(cell))
        grey[k] = np.float32(total) / whole


@numba.njit(cache=True, error_model="numpy")
def grey_sum(image, x, y, cell):  # type: ignore[no-untyped-def]
    """Return four times the sum of the grey levels of a cell's pixels."""
    total = np.uint32(0)
    for row in range(y, y + cell):
        for column in range(x, x + cell):
            total += np.uint32(image[row, column, 0])
            total += np.uint32(image[row, column, 1]) << np.uint32(1)
            total += np.uint32(image[row, column, 2])
    return total


@numba.njit(cache=True, error_model="numpy")
def mean_grey(image, left, top, cell):  # type: ignore[no-untyped-def]
    """Return the mean grey level of the pixels of a cell that are in the image."""
    total, pixels = np.int64(0), 0
    for y in range(max(top, 0), min(top + cell, image.shape[0])):
        for x in range(max(left, 0), min(left + cell, image.shape[1])):
            total += np.int64(image[y, x, 0]) + np.int64(image[y, x, 2])
            total += 2 * np.int64(image[y, x, 1])
            pixels += 1
    return np.float32(total) / np.float32(4 * pixels)


@numba.njit(cache=True, error_model="numpy")
def coefficient(  # type: ignore[no-untyped-def]  # numba infers the types
    bins, index, first, last, counts, roots, square_roots
):
    """Return the Bhattacharyya coefficient of the samples ``first`` to ``last``.

    Two rows of counts, in turn, since a count that was just written is read slowly.
    """
    counts[:] = 0
    even = first + (last - first) // 2 * 2
    for k in range(first, even, 2):
        counts[0, bins[index[k]]] += 1
        counts[1, bins[index[k + 1]]] += 1
    if even < last:
        counts[0, bins[index[even]]] += 1
    total = 0.0
    for u in range(1, roots.shape[0]):
        total += roots[u] * square_roots[counts[0, u] + counts[1, u]]
    return min(total, 1.0)


@numba.njit(cache=True, error_model="numpy")
def measure(  # type: ignore[no-untyped-def]  # numba infers the types
    image, table, cloud, factors, cell, points, disc, cue, slots, roots, disc_roots,
    ring_roots, template, bins, grey, index, counts, colours, similarities,
):  # fmt: skip
    """Measure the particles whose factor is above 0; return how many, and the region.

    ``points`` (2, K) are the ``disc`` samples of an ellipse, then those of the ring;
    ``cue`` holds the surround's penalty, the surround in the first frame, and the
    weight of the structure; ``slots`` (256,) number the colours of the reference from
    1, all others 0; ``roots`` are the square roots of its shares, by slot.
    """
    surround, first_around, structure = cue[0], cue[1], cue[2]
    total_points = points.shape[1] if surround > 0.0 else disc
    reach = 1.0
    for k in range(disc, total_points):
        reach = max(reach, abs(points[0, k]), abs(points[1, k]))
    low_x, low_y, high_x, high_y = 1e18, 1e18, -1e18, -1e18
    for i in range(cloud.shape[0]):
        if factors[i] > 0.0:
            low_x = min(low_x, cloud[i, 0] - reach * cloud[i, 2])
            high_x = max(high_x, cloud[i, 0] + reach * cloud[i, 2])
            low_y = min(low_y, cloud[i, 1] - reach * cloud[i, 3])
            high_y = max(high_y, cloud[i, 1] + reach * cloud[i, 3])
    left, top = math.floor(low_x), math.floor(low_y)
    columns = int((high_x - left) / cell) + 2
    rows = int((high_y - top) / cell) + 2
    while columns * rows > bins.shape[0]:  # coarser cells, so that any region fits
        cell += 1
        columns = int((high_x - left) / cell) + 2
        rows = int((high_y - top) / cell) + 2
    with_grey = structure > 0.0
    fill(image, table, slots, left, top, columns, rows, cell, with_grey, bins, grey)
    scale = 1.0 / cell
    measured = 0
    for i in range(cloud.shape[0]):
        if factors[i] <= 0.0:
            colours[i] = similarities[i] = 0.0
            continue
        measured += 1
        x, y = (cloud[i, 0] - left) * scale, (cloud[i, 1] - top) * scale
        half_width, half_height = cloud[i, 2] * scale, cloud[i, 3] * scale
        for k in range(total_points):
            row = np.int32(y + points[1, k] * half_height)
            column = np.int32(x + points[0, k] * half_width)
            index[k] = np.uint32(row * np.int32(columns) + column)
        rho = coefficient(bins, index, 0, disc, counts, roots, disc_roots)
        if surround > 0.0:
            around = coefficient(
                bins, index, disc, total_points, counts, roots, ring_roots
            )
            rho -= surround * max(around - first_around, 0.0)
        colours[i] = rho
        if with_grey:
            match = correlation(grey, index, disc, template)
            rho = (1.0 - structure) * rho + structure * max(match, 0.0)
        similarities[i] = rho
    return measured, left, top, columns, cell


@numba.njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})
def correlation(grey, index, disc, template):  # type: ignore[no-untyped-def]
    """Return the normalised correlation of grey samples with a normalised template."""
    total = np.float32(0.0)
    squares = np.float32(0.0)
    product = np.float32(0.0)
    for k in range(disc):
        level = grey[index[k]] - GREY
        total += level
        squares += level * level
        product += level * template[k]
    variance = squares - total * total / np.float32(disc)
    return product / math.sqrt(max(variance, np.float32(0.0)) + GREY_NOISE * disc)
