"""Continuous filters against a dense solution, and on moved samples."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.continuous_filter import ContinuousFilter, FilterLoss
from simbench.trackers.parts.fourier_series import FourierSeries
from simbench.trackers.parts.spatial_penalty import SpatialPenalty

SERIES = FourierSeries(2, 16.0)
LOSS = FilterLoss(
    SERIES, SERIES.gaussian(2.0), SpatialPenalty(SERIES, (6.0, 6.0), 0.02)
)
CHANNELS = 2
GRID = 8


def maps(count: int, rng: np.random.Generator) -> NDArray[np.complex64]:
    """Return samples (count, K, C) of random functions."""
    values = rng.standard_normal((count, GRID, GRID, CHANNELS)).astype(np.float32)
    return np.stack([SERIES.from_grid(each) for each in values])


def parts(coefficients: NDArray[np.complex64]) -> NDArray[np.float64]:
    """Return real unknowns of coefficients whose functions are real."""
    scale = np.sqrt(SERIES.weights)[:, None]
    both = [coefficients.real * scale, coefficients.imag * scale]
    return np.concatenate([each.ravel() for each in both]).astype(np.float64)


def basis() -> list[NDArray[np.complex64]]:
    """Return coefficients that span the real functions of two channels."""
    found = []
    for row, column in np.ndindex(5, 5):
        for channel in range(CHANNELS):
            values = np.zeros((5, 5, CHANNELS), np.float32)
            values[row, column, channel] = 1.0
            found.append(SERIES.from_grid(values))
    return found


def test_many_iterations_equal_the_dense_solution(rng: np.random.Generator) -> None:
    samples, weights = maps(3, rng), np.array([0.5, 0.3, 0.2], np.float32)
    zero = np.zeros(samples.shape[1:], np.complex64)
    one = ContinuousFilter(LOSS, zero, 0.0)
    one.learn(samples.transpose(1, 0, 2), weights, 300)
    span = basis()
    matrix = np.zeros((len(span), len(span)))
    right = np.zeros(len(span))
    for sample, weight in zip(samples, weights, strict=True):
        scores = [(sample * each).sum(axis=1, keepdims=True) for each in span]
        gram = [[SERIES.inner(a, b) for b in scores] for a in scores]
        matrix += weight * np.array(gram)
        label = LOSS.label[:, None]
        right += weight * np.array([SERIES.inner(each, label) for each in scores])
    matrix += np.array([[SERIES.inner(a, LOSS.penalty(b)) for b in span] for a in span])
    solution = np.linalg.solve(matrix, right)
    dense = sum(value * each for value, each in zip(solution, span, strict=True))
    assert parts(one.filters) == pytest.approx(parts(np.asarray(dense)), abs=2e-3)


def test_score_of_a_moved_sample_is_the_moved_score(rng: np.random.Generator) -> None:
    sample = maps(1, rng)
    one = ContinuousFilter(LOSS, np.zeros(sample.shape[1:], np.complex64), 0.0)
    one.learn(sample.transpose(1, 0, 2), np.ones(1, np.float32), 50)
    moved = SERIES.moved(sample[0], 1.3, -2.1)
    places, _ = SERIES.maxima(one.scores(np.stack([sample[0], moved])), 16)
    assert places[1] - places[0] == pytest.approx([1.3, -2.1], abs=1e-3)


def test_last_direction_is_trusted_only_where_told(rng: np.random.Generator) -> None:
    samples = maps(2, rng).transpose(1, 0, 2)
    weights = np.array([0.6, 0.4], np.float32)
    found = []
    for forgetting in (0.0, 1.0):
        zero = np.zeros((len(samples), CHANNELS), np.complex64)
        one = ContinuousFilter(LOSS, zero, forgetting)
        for _ in range(3):
            one.learn(samples, weights, 2)
        found.append(one.filters)
    zero = np.zeros_like(found[0])
    whole = ContinuousFilter(LOSS, zero, 0.0)
    whole.learn(samples, weights, 6)
    assert found[1] == pytest.approx(whole.filters, abs=1e-3)
    assert found[0] != pytest.approx(whole.filters, abs=1e-3)
