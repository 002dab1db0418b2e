"""Resampling and normalised weights of particle filters, for all that use them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "SCHEMES",
    "effective_sample_size",
    "entropy",
    "multinomial",
    "normalised",
    "resample",
    "residual",
    "stratified",
    "systematic",
]

SYSTEMATIC, STRATIFIED, MULTINOMIAL, RESIDUAL = range(4)  # places in SCHEMES
Weights = NDArray[np.float64]
Ancestors = NDArray[np.intp]


def systematic(weights: Weights, rng: np.random.Generator) -> Ancestors:
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
        ``floor(N * weights[n])`` times or once more, ``N * weights[n]`` on average.

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
    return _sampled(weights, np.array([rng.random()]), SYSTEMATIC)


def stratified(weights: Weights, rng: np.random.Generator) -> Ancestors:
    """Sample ancestor indices as `systematic`, with an offset for each stratum.

    Index ``n`` occurs at least ``floor(N * weights[n]) - 1`` times and at most
    ``ceil(N * weights[n]) + 1`` times. Reference as for `systematic`.
    """
    return _sampled(weights, rng.random(len(weights)), STRATIFIED)


def multinomial(weights: Weights, rng: np.random.Generator) -> Ancestors:
    """Sample ancestor indices independently, as `systematic` in arguments and order.

    The sorted uniform numbers are generated in order, so that the cost is linear.

    References
    ----------
    Gordon, Salmond, Smith (1993), "Novel approach to nonlinear/non-Gaussian Bayesian
    state estimation", IEE Proc. F 140(2). Order statistics: Devroye (1986),
    "Non-uniform random variate generation", section V.3.
    """
    return _sampled(weights, rng.random(len(weights)), MULTINOMIAL)


def residual(weights: Weights, rng: np.random.Generator) -> Ancestors:
    """Take ``floor(N * weights[n])`` copies of each, and sample the rest independently.

    Arguments as for `systematic`; the indices are not in order.

    References
    ----------
    Liu, Chen (1998), "Sequential Monte Carlo methods for dynamic systems", J. Am.
    Stat. Assoc. 93(443).
    """
    return _sampled(weights, rng.random(len(weights)), RESIDUAL)


SCHEMES: Final[Mapping[str, Callable[[Weights, np.random.Generator], Ancestors]]] = {
    each.__name__: each for each in (systematic, stratified, multinomial, residual)
}
"""Each unbiased: ancestor n is expected ``N * weights[n]`` times."""


def normalised(log_weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (N,) normalised weights of (N,) log weights.

    The greatest is subtracted first, so that nothing overflows and the best does not
    underflow. Where all are minus infinity, nothing is known, and all weights are
    equal.

    Raises
    ------
    ValueError
        If one is NaN or plus infinity.

    Examples
    --------
    >>> normalised(np.array([-1000.0, -1000.0, -np.inf])).tolist()
    [0.5, 0.5, 0.0]
    """
    top = log_weights.max()
    if top == -np.inf:
        return np.full(len(log_weights), 1.0 / len(log_weights))
    if not np.isfinite(top):
        raise ValueError(f"log weights: expected no NaN and no infinity, got {top}")
    weights = np.exp(log_weights - top)
    return np.asarray(weights / weights.sum())


def effective_sample_size(weights: NDArray[np.float64]) -> float:
    """Return ``1 / sum w^2`` of (N,) normalised weights, in [1, N].

    References
    ----------
    Kong, Liu, Wong (1994), "Sequential imputations and Bayesian missing data
    problems", J. Am. Stat. Assoc. 89(425); as in NBRF, algorithm 1.

    Examples
    --------
    >>> effective_sample_size(np.array([0.5, 0.5, 0.0]))
    2.0
    """
    return float(1.0 / (weights @ weights))


def entropy(weights: NDArray[np.float64]) -> float:
    """Return the Shannon entropy of (N,) normalised weights, in nats, in [0, log N].

    Examples
    --------
    >>> round(entropy(np.full(8, 0.125)), 6) == round(float(np.log(8.0)), 6)
    True
    """
    positive = weights[weights > 0.0]
    return max(float(-(positive @ np.log(positive))), 0.0)


def _sampled(weights: Weights, uniforms: Weights, scheme: int) -> Ancestors:
    """Check the weights, and return the (N,) ancestors that the scheme samples."""
    total = float(weights.sum())
    if not (weights.min() >= 0.0 and abs(total - 1.0) < 1e-6):
        raise ValueError(f"weights must be >= 0 and sum to 1, got sum {total}")
    ancestors = np.empty(len(weights), np.intp)
    resample(np.ascontiguousarray(weights), uniforms, scheme, ancestors)
    return ancestors


@numba.njit(cache=True)
def resample(  # type: ignore[no-untyped-def]  # numba infers the types
    weights, uniforms, scheme, ancestors
):
    """Set (M,) ancestors from (N,) normalised weights, by the number of a scheme.

    ``uniforms`` in [0, 1) are M, or one where the scheme is systematic.
    """
    if scheme != RESIDUAL:
        walk(weights, uniforms, scheme, ancestors)
        return
    count, taken = ancestors.shape[0], 0
    rest = np.empty(weights.shape[0])
    for n in range(weights.shape[0]):
        copies = min(int(count * weights[n]), count - taken)
        ancestors[taken : taken + copies] = n
        taken += copies
        rest[n] = max(count * weights[n] - copies, 0.0)
    if taken < count:
        walk(rest / rest.sum(), uniforms, MULTINOMIAL, ancestors[taken:])


@numba.njit(cache=True)
def walk(  # type: ignore[no-untyped-def]  # numba infers the types
    weights, uniforms, scheme, ancestors
):
    """Set ancestors at ascending positions in the cumulative weights."""
    count = ancestors.shape[0]
    last = 0
    for n in range(weights.shape[0]):
        if weights[n] != 0.0:
            last = n
    # Round-off must not leave the last position above every edge, nor assign it to a
    # particle of zero weight.
    edge = weights[0] if last > 0 else 1.0
    above = 1.0  # the last position of the independent ones, from 1 down
    j = 0
    for i in range(count):
        if scheme == SYSTEMATIC:
            position = (uniforms[0] + i) / count
        elif scheme == STRATIFIED:
            position = (uniforms[i] + i) / count
        else:
            above *= uniforms[i] ** (1.0 / (count - i))
            position = 1.0 - above
        while position >= edge and j < last:
            j += 1
            edge = edge + weights[j] if j < last else 1.0
        ancestors[i] = j
