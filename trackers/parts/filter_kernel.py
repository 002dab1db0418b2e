"""One compiled step of a particle filter: resample, propagate, gate, measure, mean.

A step in numpy makes a dozen passes over the cloud; one function makes the same step
without allocating anything. It looks up the colour of every pixel in the region that
the cloud covers once, however many particles lie on it.
"""

from __future__ import annotations

import math

import numba
import numpy as np

__all__ = ["MOTION", "blend", "fill", "gate", "measure", "propagate", "step", "weigh"]

MOTION = (
    "offset",  # of systematic resampling, in [0, 1)
    "drift_x",  # px
    "drift_y",
    "spread_x",  # standard deviations of the position, px
    "spread_y",
    "growth",  # of the log of the size
    "scale_noise",  # standard deviations of the log of the size
    "aspect_noise",
    "scout_every",  # every how manieth particle is a scout; 0: none
    "scout_x",  # standard deviations of the scouts' position, px
    "scout_y",
    "scout_share",  # factor on a scout's weight
    "seen_x",  # where every other scout starts from, px
    "seen_y",
    "half_angle",  # rad; 0: the gate is open
    "theta",  # rad
    "apex_x",  # px
    "apex_y",
    "precision",  # 1 / (2 sigma^2)
    "floor",  # similarity at which the weights level off; below -1: none
    "cell",  # px
)
(OFFSET, DRIFT_X, DRIFT_Y, SPREAD_X, SPREAD_Y, GROWTH, SCALE, ASPECT) = range(8)
(SCOUT_EVERY, SCOUT_X, SCOUT_Y, SCOUT_SHARE, SEEN_X, SEEN_Y) = range(8, 14)
(HALF_ANGLE, THETA, APEX_X, APEX_Y, PRECISION, FLOOR, CELL) = range(14, 21)

GREY = np.float32(128.0)  # of a sample outside the image
GREY_NOISE = 1.0  # variance of a grey level, so that a flat patch correlates with none


@numba.njit(cache=True)
def propagate(  # type: ignore[no-untyped-def]  # numba infers the types
    cloud, weights, noise, motion, limits, moved
):
    """Resample a cloud (N, 4) systematically and propagate it into ``moved``.

    ``noise`` is (N, 4) standard normal; ``limits`` are the image's width and height,
    the lower and the upper half axes, px.
    """
    count = cloud.shape[0]
    last = 0
    for i in range(count):
        if weights[i] != 0.0:
            last = i
    every = int(motion[SCOUT_EVERY])
    j = 0
    edge = weights[0] if last > 0 else 1.0
    for i in range(count):
        position = (motion[OFFSET] + i) / count
        while position >= edge and j < last:
            j += 1
            # Round-off must not leave the last position above every edge.
            edge = edge + weights[j] if j < last else 1.0
        x, y = cloud[j, 0], cloud[j, 1]
        spread_x, spread_y = motion[SPREAD_X], motion[SPREAD_Y]
        if every > 0 and i % every == 0:
            spread_x, spread_y = motion[SCOUT_X], motion[SCOUT_Y]
            if (i // every) % 2 == 0:
                x, y = (
                    motion[SEEN_X] - motion[DRIFT_X],
                    motion[SEEN_Y] - motion[DRIFT_Y],
                )
        x += motion[DRIFT_X] + noise[i, 0] * spread_x
        y += motion[DRIFT_Y] + noise[i, 1] * spread_y
        size = motion[SCALE] * noise[i, 2] + motion[GROWTH]
        aspect = motion[ASPECT] * noise[i, 3]
        moved[i, 0] = min(max(x, 0.0), limits[0])
        moved[i, 1] = min(max(y, 0.0), limits[1])
        half_width = cloud[j, 2] * math.exp(size + aspect)
        half_height = cloud[j, 3] * math.exp(size - aspect)
        moved[i, 2] = min(max(half_width, limits[2]), limits[4])
        moved[i, 3] = min(max(half_height, limits[3]), limits[5])


@numba.njit(cache=True)
def gate(cloud, motion, factors):  # type: ignore[no-untyped-def]
    """Set (N,) factors on the weights; return whether no particle passed.

    The factors are those of `gate_weights`; scouts pass, at their share. Where nothing
    passes, all do.
    """
    count = cloud.shape[0]
    every = int(motion[SCOUT_EVERY])
    passed = False
    for i in range(count):
        factor = 1.0
        if every > 0 and i % every == 0:
            factor = motion[SCOUT_SHARE]
        elif motion[HALF_ANGLE] > 0.0:
            beta = math.atan2(
                cloud[i, 1] - motion[APEX_Y], cloud[i, 0] - motion[APEX_X]
            )
            turn = abs(beta - motion[THETA]) % math.tau
            psi = min(turn, math.tau - turn)
            factor = max(1.0 - psi / motion[HALF_ANGLE], 0.0)
        factors[i] = factor
        passed = passed or factor > 0.0
    if not passed:
        factors[:] = 1.0
    return not passed


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
            for column in range(first, last):
                x = left + column * cell
                grey[start + column] = mean_grey(image, x, y, cell)


@numba.njit(cache=True, error_model="numpy")
def mean_grey(image, left, top, cell):  # type: ignore[no-untyped-def]
    """Return the mean grey level of the pixels of a cell that are in the image."""
    total, pixels = 0, 0
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
            index[k] = row * np.int32(columns) + np.int32(x + points[0, k] * half_width)
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


@numba.njit(cache=True)
def weigh(  # type: ignore[no-untyped-def]  # numba infers the types
    cloud, factors, similarities, colours, motion, weights, mean, outcome
):
    """Set the weights and the weighted mean of a measured cloud.

    ``outcome`` is set to the best similarity, the weighted mean similarity and the
    weighted mean colour similarity.
    """
    best = -1e18
    for i in range(cloud.shape[0]):
        if factors[i] > 0.0:
            best = max(best, similarities[i])
    top = max(best, motion[FLOOR])
    level = 0.0
    if motion[FLOOR] >= -1.0:
        level = math.exp((motion[FLOOR] - top) * motion[PRECISION])
    total = 0.0
    for i in range(cloud.shape[0]):
        weights[i] = 0.0
        if factors[i] > 0.0:
            likelihood = math.exp((similarities[i] - top) * motion[PRECISION])
            weights[i] = factors[i] * (likelihood + level)
        total += weights[i]
    mean[:] = 0.0
    outcome[0], outcome[1], outcome[2] = best, 0.0, 0.0
    for i in range(cloud.shape[0]):
        weights[i] /= total
        for k in range(4):
            mean[k] += weights[i] * cloud[i, k]
        outcome[1] += weights[i] * similarities[i]
        outcome[2] += weights[i] * colours[i]


@numba.njit(cache=True)
def step(  # type: ignore[no-untyped-def]  # numba infers the types
    image, table, cloud, weights, noise, motion, limits, points, disc, cue, slots,
    roots, disc_roots, ring_roots, template, bins, grey, index, counts, moved,
    moved_weights, factors, colours, similarities, mean, patch, outcome,
):  # fmt: skip
    """Make one step of the filter; return the particles measured, and the fallback.

    The cloud is resampled and propagated into ``moved``, weighted in
    ``moved_weights``; its mean is set in ``mean``, and the grey samples there in
    ``patch``.
    """
    propagate(cloud, weights, noise, motion, limits, moved)
    fallback = gate(moved, motion, factors)
    measured, left, top, columns, cell = measure(
        image, table, moved, factors, int(motion[CELL]), points, disc, cue, slots,
        roots, disc_roots, ring_roots, template, bins, grey, index, counts, colours,
        similarities,
    )  # fmt: skip
    weigh(moved, factors, similarities, colours, motion, moved_weights, mean, outcome)
    if cue[2] > 0.0:
        for k in range(disc):
            row = int((mean[1] + points[1, k] * mean[3] - top) / cell)
            column = int((mean[0] + points[0, k] * mean[2] - left) / cell)
            patch[k] = grey[row * columns + column]
    return measured, fallback


@numba.njit(cache=True)
def blend(patch, share, template):  # type: ignore[no-untyped-def]
    """Blend grey samples, normalised, into a normalised template by a share."""
    count = patch.shape[0]
    mean, squares = 0.0, 0.0
    for k in range(count):
        mean += patch[k] / count
    for k in range(count):
        squares += (patch[k] - mean) ** 2
    norm = math.sqrt(squares + GREY_NOISE * count)
    squares = 0.0
    for k in range(count):
        template[k] += share * ((patch[k] - mean) / norm - template[k])
        squares += template[k] ** 2
    for k in range(count):
        template[k] /= math.sqrt(squares) + 1e-9
