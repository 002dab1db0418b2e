"""Search for a lost target: how far particles spread around where it is expected."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp

__all__ = ["search_noise"]

SEARCH_GROWTH, SEARCH_LIMIT = 0.5, 2.0  # of the search's noise, by frame lost
SEARCH_SCALE, SEARCH_SCALE_LIMIT = 0.02, 0.3  # noise of log size, by frame lost


def search_noise(
    noise: Callable[[int, float], NDArray[np.float64]],
    count: int,
    spread: float,
    frames: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return group elements that move a state to the particles of a search.

    Parameters
    ----------
    noise : callable of (count, spread)
        Returns (count, 6) noise of the filter, with a spread in boxes.
    count : int
        Particles of the search.
    spread : float
        Of the first frame in which the target is lost, in boxes.
    frames : int
        For which the target has been lost, from 1: place and size spread further with
        each.
    rng : numpy.random.Generator
        Source of the noise of the size.

    Returns
    -------
    (count, 2, 3) float
    """
    widening = min(1.0 + SEARCH_GROWTH * (frames - 1), SEARCH_LIMIT)
    places = exp(noise(count, widening * spread))
    growth = np.zeros((count, 6))
    growth[:, 0] = rng.standard_normal(count)
    growth[:, 0] *= min(SEARCH_SCALE * frames, SEARCH_SCALE_LIMIT)
    return compose(places, exp(growth))
