"""Compiled parts of a step of sequential importance resampling: propagate and weigh.

Both are one pass over the particles, so that a step costs in proportion to their
number; the filter of NBRF, eq. 3, costs as the cube of it.
"""

from __future__ import annotations

import math

import numba

from simbench.trackers.parts.resampling import resample

__all__ = ["propagate", "weigh"]


@numba.njit(cache=True)
def propagate(  # type: ignore[no-untyped-def]  # numba infers the types
    cloud, weights, uniforms, noise, spread, limits, scheme, least, ancestors, moved,
    prior,
):  # fmt: skip
    """Resample where few particles matter, and propagate; return the effective number.

    Parameters
    ----------
    cloud : (N, 4) float, px
        Centre x, y and half axes Hx, Hy.
    weights : (N,) float
        Normalised.
    uniforms : (N + 1,) float, in [0, 1)
        Those of `resample`, and a last one that chooses which particles are far ones.
    noise : (N, 4) float
        Standard normal.
    spread : (9,) float
        Shift along x and y, px; standard deviations of x and y, px, of the log of the
        size and of the aspect; the share of far particles, and their standard
        deviations of x and y, px.
    limits : (6,) float, px
        Width and height of the image, lower half axes, upper half axes.
    scheme : int
        Place in `SCHEMES`.
    least : float
        Effective number of particles below which they are resampled.
    ancestors : (N,) int
        Set.
    moved : (N, 4) float, px
        Set to the propagated cloud.
    prior : (N,) float
        Set to the weights before the measurement: equal once resampled, else those of
        the ancestors.

    Returns
    -------
    float
        ``1 / sum w^2`` before resampling (NBRF, algorithm 1).
    """
    count = cloud.shape[0]
    squares = 0.0
    for i in range(count):
        squares += weights[i] * weights[i]
    is_resampled = 1.0 / squares < least
    if is_resampled:
        resample(weights, uniforms[:count], scheme, ancestors)
    for i in range(count):
        j = ancestors[i] if is_resampled else i
        prior[i] = 1.0 / count if is_resampled else weights[i]
        # far ones are spread evenly over the particles, and others in each frame
        place = uniforms[count] + i * spread[6]
        is_far = math.floor(place + spread[6]) > math.floor(place)
        along, down = (spread[7], spread[8]) if is_far else (spread[2], spread[3])
        x = cloud[j, 0] + spread[0] + along * noise[i, 0]
        y = cloud[j, 1] + spread[1] + down * noise[i, 1]
        moved[i, 0] = min(max(x, 0.0), limits[0])
        moved[i, 1] = min(max(y, 0.0), limits[1])
        size, aspect = spread[4] * noise[i, 2], spread[5] * noise[i, 3]
        moved[i, 2] = min(
            max(cloud[j, 2] * math.exp(size + aspect), limits[2]), limits[4]
        )
        moved[i, 3] = min(
            max(cloud[j, 3] * math.exp(size - aspect), limits[3]), limits[5]
        )
    return 1.0 / squares


@numba.njit(cache=True)
def weigh(  # type: ignore[no-untyped-def]  # numba infers the types
    cloud, prior, similarities, precision, weights, mean
):
    """Set normalised weights and the weighted mean (4,); return the mean similarity.

    ``w ∝ prior exp(similarity precision)`` (NBRF, eq. 1, with the transition as the
    proposal), relative to the best particle so that it does not underflow.
    """
    top = -1e18
    for i in range(cloud.shape[0]):
        if prior[i] > 0.0:
            top = max(top, similarities[i])
    total = 0.0
    for i in range(cloud.shape[0]):
        weights[i] = prior[i] * math.exp(min(similarities[i] - top, 0.0) * precision)
        total += weights[i]
    mean[:] = 0.0
    similarity = 0.0
    for i in range(cloud.shape[0]):
        weights[i] /= total
        similarity += weights[i] * similarities[i]
        for k in range(4):
            mean[k] += weights[i] * cloud[i, k]
    return similarity
