"""Colour score of affine states: how many of their colours belong to the target."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp
from simbench.trackers.parts.colour_histogram import disc_samples, ring_samples
from simbench.trackers.parts.patches import CODES, Region

__all__ = ["ColourPosterior"]

INSIDE = 0.9  # squared radius, in half axes, of the target's colours
AROUND = (1.1, 2.0)  # half sides of the frame that holds the surroundings' colours
RING = (1.15, 1.6)  # of the half axes: just outside the target
DISC_SAMPLES, RING_SAMPLES = 80, 40
RARE = 1e-4  # share below which a colour says little
MIN_CONTRAST = 0.05  # of the score's scale in the first frame
FULL_CONTRAST = 0.3  # contrast from which colour is fully believed
ELSEWHERE = 200  # states around the target in the first frame
FIRST_SHARE = 0.2  # of the first frame's colours in the target's


class ColourPosterior:
    """Probability by colour that a pixel belongs to the target, and scores from it.

    ``p(target | colour) = inside / (inside + around)`` from the colours inside and
    around the target, equally likely before. The score of a state is the mean inside
    it less the mean in the ring just outside, relative to that of the first frame: it
    falls where the state leaves the target, and where it is smaller or larger.

    Parameters
    ----------
    region : Region
        Of the first frame, covering the target.
    state : (2, 3) float, px
        The target there.

    Attributes
    ----------
    separation : float, in [0, 1]
        How far colour tells the target from its surroundings in the first frame.

    References
    ----------
    Bertinetto et al., "Staple: complementary learners for real-time tracking", CVPR
    2016, section 3.3, for colour scores beside a template; Possegger et al., "In
    defense of color-based model-free tracking", CVPR 2015, for the posterior.
    """

    def __init__(self, region: Region, state: NDArray[np.float64]) -> None:
        self._disc = disc_samples(DISC_SAMPLES) / 2.0
        self._ring = ring_samples(RING_SAMPLES, *RING) / 2.0
        self._first, self._around = _shares(region, state)
        self._inside = self._first.copy()
        self._contrast = 1.0
        self._refresh()
        contrast = float(self._contrasts(region, state[None])[0])
        self._contrast = max(contrast, MIN_CONTRAST)
        angles = np.arange(ELSEWHERE) * 2.399963  # the golden angle: even directions
        offsets = np.zeros((ELSEWHERE, 6))
        radii = np.linspace(0.8, 2.0, ELSEWHERE)
        offsets[:, 4], offsets[:, 5] = radii * np.cos(angles), radii * np.sin(angles)
        elsewhere = self.scores(region, compose(state, exp(offsets)))
        margin = 1.0 - float(np.quantile(elsewhere, 0.9))
        self.separation = margin * min(self._contrast / FULL_CONTRAST, 1.0)

    def scores(
        self, region: Region, states: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the (N,) scores in [0, 1] of (N, 2, 3) states."""
        scores = self._contrasts(region, states) / self._contrast
        return np.asarray(np.clip(scores, 0.0, 1.0))

    def learn(
        self, region: Region, state: NDArray[np.float64], target: float, around: float
    ) -> None:
        """Blend in the colours at a state, by shares in [0, 1] inside and around it."""
        inside, outside = _shares(region, state)
        self._inside += target * (inside - self._inside)
        self._around += around * (outside - self._around)
        self._refresh()

    def _refresh(self) -> None:
        inside = FIRST_SHARE * self._first + (1.0 - FIRST_SHARE) * self._inside
        total = inside + self._around + 4.0 * RARE
        self._posterior = ((inside + RARE) / total).astype(np.float32)
        self._posterior[-1] = 0.0  # nothing outside the image is the target

    def _contrasts(
        self, region: Region, states: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the (N,) mean posteriors inside states, less those in their rings."""
        where = (region.origin, region.step)
        disc = _means(region.codes, self._posterior, states, self._disc, *where)
        ring = _means(region.codes, self._posterior, states, self._ring, *where)
        return np.asarray(disc - ring)


def _shares(
    region: Region, state: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the (CODES,) colour shares inside and around a state, each of sum 1."""
    rows, columns = region.codes.shape
    half = np.hypot(state[0, :2], state[1, :2]) / 2.0
    x = region.origin[0] + (np.arange(columns) + 0.5) * region.step[0]
    y = region.origin[1] + (np.arange(rows) + 0.5) * region.step[1]
    u = np.abs(x - state[0, 2])[None, :] / half[0]
    v = np.abs(y - state[1, 2])[:, None] / half[1]
    square = np.maximum(u, v)
    places = (u * u + v * v < INSIDE, (square > AROUND[0]) & (square < AROUND[1]))
    inside, around = (
        np.bincount(region.codes[place], minlength=CODES).astype(np.float64)
        for place in places
    )
    inside[-1] = 0.0
    return inside / max(inside.sum(), 1.0), around / max(around.sum(), 1.0)


@numba.njit(cache=True)
def _means(  # type: ignore[no-untyped-def]  # numba infers the types
    codes, posterior, states, points, origin, step
):
    """Return the mean posterior at (K, 2) points of each of N states."""
    rows, columns = codes.shape
    result = np.empty(states.shape[0])
    for n in range(states.shape[0]):
        a, b = states[n, 0, 0] / step[0], states[n, 0, 1] / step[0]
        d, e = states[n, 1, 0] / step[1], states[n, 1, 1] / step[1]
        c = (states[n, 0, 2] - origin[0]) / step[0]
        f = (states[n, 1, 2] - origin[1]) / step[1]
        total = 0.0
        for k in range(points.shape[0]):
            x = int(a * points[k, 0] + b * points[k, 1] + c)
            y = int(d * points[k, 0] + e * points[k, 1] + f)
            x, y = min(max(x, 0), columns - 1), min(max(y, 0), rows - 1)
            total += posterior[codes[y, x]]
        result[n] = total / points.shape[0]
    return result
