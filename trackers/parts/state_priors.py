"""What is expected of the size and the place of affine states."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["clipped", "prior_losses", "sides_of"]


def prior_losses(
    states: NDArray[np.float64],
    expected: NDArray[np.float64],
    predicted: NDArray[np.float64],
    sides: NDArray[np.float64],
    priors: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the confidence that each of N states loses by what is expected.

    Parameters
    ----------
    states : (N, 2, 3) float, px
    expected : (2,) float
        Log of the lengths, px, that both sides are expected to have.
    predicted : (2, 3) float, px
        State whose place the target is expected at.
    sides : (2,) float, px
        Unit of distances along x and y.
    priors : (3,) float
        Losses by the squared log size, log aspect ratio and distance.

    Returns
    -------
    (N,) float
    """
    result: NDArray[np.float64] = _losses(states, expected, predicted, sides, priors)
    return result


def sides_of(states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (..., 2) lengths of the two sides of (..., 2, 3) states, px."""
    return np.asarray(np.hypot(states[..., 0, :2], states[..., 1, :2]))


def clipped(
    states: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (N, 2, 3) states with the lengths of both sides within (2,) limits, px."""
    result: NDArray[np.float64] = _clipped(states, low, high)
    return result


@numba.njit(cache=True)
def _losses(  # type: ignore[no-untyped-def]  # numba infers the types
    states, expected, predicted, sides, priors
):
    result = np.empty(states.shape[0])
    for n in range(states.shape[0]):
        state = states[n]
        width = math.log(math.hypot(state[0, 0], state[1, 0])) - expected[0]
        height = math.log(math.hypot(state[0, 1], state[1, 1])) - expected[1]
        x = (state[0, 2] - predicted[0, 2]) / sides[0]
        y = (state[1, 2] - predicted[1, 2]) / sides[1]
        result[n] = (
            priors[0] * ((width + height) / 2.0) ** 2
            + priors[1] * (width - height) ** 2
            + priors[2] * (x * x + y * y)
        )
    return result


@numba.njit(cache=True)
def _clipped(states, low, high):  # type: ignore[no-untyped-def]  # numba infers
    result = states.copy()
    for n in range(states.shape[0]):
        for k in range(2):
            length = math.hypot(states[n, 0, k], states[n, 1, k])
            factor = min(max(length, low[k]), high[k]) / length
            result[n, 0, k] *= factor
            result[n, 1, k] *= factor
    return result
