"""What the two networks of NBRF read: the path so far, and colours around an estimate.

Nothing here but pictures and the filter's own estimates: never the truth.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["PROBES", "estimate_inputs", "motion_inputs", "probe_offsets"]

RINGS = (0.8, 1.7, 3.0)  # of the target's half side
DIRECTIONS = 8
PROBES = 1 + len(RINGS) * DIRECTIONS
KINEMATIC = 0.3  # weight of the kinematic inputs, against those of the probes
_PATH = 3  # places that two displacements need

Array = NDArray[np.float64]


def probe_offsets() -> Array:
    """Return where colours are probed, (PROBES, 2) in half sides; first 0, 0."""
    angles = np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.concatenate([np.zeros((1, 2)), *(radius * circle for radius in RINGS)])


def motion_inputs(path: list[Array], side: float, extent: tuple[int, int]) -> Array:
    """Return what the motion network reads before a frame.

    Parameters
    ----------
    path : list of (2,) float, px
        Estimated centres, at least one, the last one last.
    side : float, px
        Of the target.
    extent : (2,) int, px
        Width and height of the image.

    Returns
    -------
    (9,) float
        The last two displacements, in sides, 0 where unknown; whether each is known;
        the last place in units of the image; the side in units of its width.
    """
    recent = path[-_PATH:]
    steps = [(b - a) / side for a, b in itertools.pairwise(recent)][::-1]
    known = [float(len(steps) > k) for k in range(_PATH - 1)]
    steps += [np.zeros(2)] * (_PATH - 1 - len(steps))
    width, height = extent
    x, y = recent[-1].tolist()
    return np.array([*steps[0], *steps[1], *known, x / width, y / height, side / width])


def estimate_inputs(
    estimate: Array,
    predicted: Array,
    path: list[Array],
    best: Array,
    deviation: Array,
    similarities: Array,
    radius: float,
) -> Array:
    """Return what the estimate network reads in a frame.

    Parameters
    ----------
    estimate, predicted, best : (2,) float, px
        Weighted mean, where it was expected, and the most similar particle.
    path : list of (2,) float, px
        Centres before, at least one.
    deviation : (2,) float, px
        Standard deviations of the cloud: the gain.
    similarities : (PROBES,) float
        Around the estimate, at `probe_offsets`.
    radius : float, px
        Half a side of the target.

    Returns
    -------
    (10 + PROBES,) float
        Innovation, step, step before, deviation and offset of the best, in radii;
        squared Bhattacharyya distances.
    """
    before = path[-1] - path[-2] if len(path) > 1 else np.zeros(2)
    kinematic = np.concatenate(
        [
            estimate - predicted,
            estimate - path[-1],
            before,
            deviation,
            best - estimate,
        ]
    )
    return np.concatenate([kinematic * (KINEMATIC / radius), 1.0 - similarities])
