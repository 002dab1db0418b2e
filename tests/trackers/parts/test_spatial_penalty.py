"""The penalty that keeps filters on the target."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.trackers.parts.fourier_series import FourierSeries
from simbench.trackers.parts.spatial_penalty import LEAST, SpatialPenalty

SERIES = FourierSeries(7, 64.0)


def cost(penalty: SpatialPenalty, down: float, right: float) -> float:
    """Return the penalty of a narrow filter at a place."""
    spot = SERIES.moved(SERIES.gaussian(3.0)[:, None], down, right)
    return SERIES.inner(spot, penalty(spot))


def test_penalty_grows_with_the_distance_in_targets() -> None:
    penalty = SpatialPenalty(SERIES, (8.0, 24.0), 0.01)
    costs = [cost(penalty, 0.0, right) for right in (0.0, 8.0, 16.0, 24.0)]
    assert costs == sorted(costs)
    assert cost(penalty, 16.0, 0.0) > 2.0 * cost(penalty, 0.0, 16.0)


def test_gradient_is_that_of_the_weighed_sum_of_squares(
    rng: np.random.Generator,
) -> None:
    penalty = SpatialPenalty(SERIES, (16.0, 16.0), 0.01)
    values = rng.standard_normal((2, 20, 20, 2)).astype(np.float32)
    first, second = (SERIES.from_grid(each) for each in values)
    there = SERIES.inner(first, penalty(second))
    assert there == pytest.approx(SERIES.inner(second, penalty(first)), rel=1e-4)
    assert SERIES.inner(first, penalty(first)) > 0.0


def test_one_frequency_pays_the_mean_square_of_the_weights() -> None:
    penalty = SpatialPenalty(SERIES, (16.0, 16.0), 0.01)
    constant = np.zeros((len(SERIES.weights), 1), np.complex64)
    constant[0] = 1.0
    paid = SERIES.inner(constant, penalty(constant))
    assert paid == pytest.approx(penalty.energy, rel=1e-5)
    assert penalty.energy > LEAST**2
