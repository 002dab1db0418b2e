"""Resampling: ancestor indices from normalised weights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["systematic"]


def systematic(
    weights: NDArray[np.float64], rng: np.random.Generator
) -> NDArray[np.intp]:
    """Sample ancestor indices with one uniform offset shared by N even strata.

    Parameters
    ----------
    weights : (N,) float
        Normalised weights: non-negative, summing to 1.
    rng : numpy.random.Generator
        Source of the single uniform number.

    Returns
    -------
    (N,) int
        Ancestor indices, in ascending order. Index ``n`` occurs either
        ``floor(N * weights[n])`` times or once more.

    Raises
    ------
    ValueError
        If a weight is negative or NaN, or they do not sum to 1.

    References
    ----------
    Kitagawa (1996), "Monte Carlo filter and smoother for non-Gaussian nonlinear
    state space models", J. Comput. Graph. Stat. 5(1).

    Examples
    --------
    >>> systematic(np.full(4, 0.25), np.random.default_rng(0)).tolist()
    [0, 1, 2, 3]
    """
    edges = np.cumsum(weights)
    if not (weights.min() >= 0.0 and abs(edges[-1] - 1.0) < 1e-6):
        raise ValueError(f"weights must be >= 0 and sum to 1, got sum {edges[-1]}")
    count = len(weights)
    positions = (rng.random() + np.arange(count)) / count
    # Round-off must not leave the last position above every edge, nor assign it to a
    # particle of zero weight.
    edges[np.flatnonzero(weights)[-1] :] = 1.0
    return np.searchsorted(edges, positions, side="right")
