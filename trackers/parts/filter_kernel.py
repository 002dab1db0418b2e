"""One compiled step of a particle filter: resample, propagate, gate, measure, mean.

A step in numpy makes a dozen passes over the cloud; one function makes the same step
without allocating anything.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from simbench.trackers.parts.kld_sampling import EMPTY, claim, particles_needed
from simbench.trackers.parts.measure_kernel import GREY_NOISE, measure
from simbench.trackers.parts.resampling import resample

__all__ = ["MOTION", "blend", "gate", "place", "propagate", "step", "weigh"]

MOTION = (
    "scheme",  # of resampling, by its place in `SCHEMES`
    "drift_x",  # px
    "drift_y",
    "spread_x",  # standard deviations of the position, px
    "spread_y",
    "growth",  # of the log of the size
    "scale_noise",  # standard deviations of the log of the size
    "aspect_noise",
    "scout_every",  # one particle in so many is a scout; 0: none
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
    "epsilon",  # of KLD sampling; 0: as many particles as there is room for
    "quantile",  # of the normal distribution at 1 - delta
    "least",  # particles
    "bin_x",  # px
    "bin_y",
    "bin_size",  # of the log of the size
)
(SCHEME, DRIFT_X, DRIFT_Y, SPREAD_X, SPREAD_Y, GROWTH, SCALE, ASPECT) = range(8)
(SCOUT_EVERY, SCOUT_X, SCOUT_Y, SCOUT_SHARE, SEEN_X, SEEN_Y) = range(8, 14)
(HALF_ANGLE, THETA, APEX_X, APEX_Y, PRECISION, FLOOR, CELL) = range(14, 21)
(EPSILON, QUANTILE, LEAST, BIN_X, BIN_Y, BIN_SIZE) = range(21, 27)


@numba.njit(cache=True)
def propagate(  # type: ignore[no-untyped-def]  # numba infers the types
    cloud, weights, uniforms, noise, motion, limits, ancestors, occupied, moved
):
    """Resample a cloud (N, 4) and propagate it into ``moved`` (M, 4); return how many.

    ``uniforms`` are those of `resample`, ``noise`` is (M, 4) standard normal;
    ``limits`` are the image's width and height, the lower and the upper half axes, px;
    ``ancestors`` is (M,). ``occupied`` is the table of `claim`. All M are made, or with
    KLD sampling as many as their spread needs.
    """
    most = moved.shape[0]
    if motion[EPSILON] <= 0.0:
        resample(weights, uniforms, int(motion[SCHEME]), ancestors)
        for i in range(most):
            place(cloud[ancestors[i]], i, noise[i], motion, limits, moved[i])
        return most
    edges = np.cumsum(weights)
    occupied[:, 0] = EMPTY
    bins, needed = 0, motion[LEAST]
    for i in range(most):
        j = np.searchsorted(edges, uniforms[i] * edges[-1], side="right")
        place(cloud[j], i, noise[i], motion, limits, moved[i])
        size = 0.5 * math.log(moved[i, 2] * moved[i, 3])
        column = math.floor(moved[i, 0] / motion[BIN_X])
        row = math.floor(moved[i, 1] / motion[BIN_Y])
        if claim(column, row, math.floor(size / motion[BIN_SIZE]), occupied):
            bins += 1
            enough = particles_needed(bins, motion[EPSILON], motion[QUANTILE])
            needed = max(needed, enough)
        if i + 1 >= needed:
            return i + 1
    return most


@numba.njit(cache=True)
def place(  # type: ignore[no-untyped-def]  # numba infers the types
    ancestor, i, noise, motion, limits, moved
):
    """Propagate one particle, the i-th, from an ancestor (4,) into ``moved`` (4,)."""
    every = int(motion[SCOUT_EVERY])
    x, y = ancestor[0], ancestor[1]
    spread_x, spread_y = motion[SPREAD_X], motion[SPREAD_Y]
    if every > 0 and i % every == 0:
        spread_x, spread_y = motion[SCOUT_X], motion[SCOUT_Y]
        if (i // every) % 2 == 0:
            x, y = motion[SEEN_X] - motion[DRIFT_X], motion[SEEN_Y] - motion[DRIFT_Y]
    x += motion[DRIFT_X] + noise[0] * spread_x
    y += motion[DRIFT_Y] + noise[1] * spread_y
    size = motion[SCALE] * noise[2] + motion[GROWTH]
    aspect = motion[ASPECT] * noise[3]
    moved[0] = min(max(x, 0.0), limits[0])
    moved[1] = min(max(y, 0.0), limits[1])
    moved[2] = min(max(ancestor[2] * math.exp(size + aspect), limits[2]), limits[4])
    moved[3] = min(max(ancestor[3] * math.exp(size - aspect), limits[3]), limits[5])


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
    image, table, cloud, weights, uniforms, noise, motion, limits, ancestors, occupied,
    points, disc, cue, slots, roots, disc_roots, ring_roots, template, bins, grey,
    index, counts, moved, moved_weights, factors, colours, similarities, mean, patch,
    outcome,
):  # fmt: skip
    """Make one step; return the particles, those measured, and the fallback.

    The cloud is resampled and propagated into ``moved``, weighted in
    ``moved_weights``; its mean is set in ``mean``, and the grey samples there in
    ``patch``.
    """
    particles = propagate(
        cloud, weights, uniforms, noise, motion, limits, ancestors, occupied, moved
    )
    moved, factors = moved[:particles], factors[:particles]
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
    return particles, measured, fallback


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
