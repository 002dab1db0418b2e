"""Projections and filters, learnt together by Gauss-Newton."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.continuous_filter import FilterLoss
from simbench.trackers.parts.factorised_convolution import (
    FactorisedFilter,
    principal_axes,
)
from simbench.trackers.parts.fourier_series import FourierSeries
from simbench.trackers.parts.spatial_penalty import SpatialPenalty

SERIES = FourierSeries(5, 48.0)
LOSS = FilterLoss(
    SERIES, SERIES.gaussian(4.0), SpatialPenalty(SERIES, (14.0, 14.0), 0.01)
)
KEPT = (2, 3)


def sample(rng: np.random.Generator) -> list[NDArray[np.complex64]]:
    """Return maps of two kinds, of 6 and 8 channels, that change slowly."""
    slow = 1.0 / (1.0 + (SERIES.frequencies**2).sum(axis=0)[:, None])
    found = []
    for channels in (6, 8):
        values = rng.standard_normal((12, 12, channels)).astype(np.float32)
        found.append((SERIES.from_grid(values) * slow).astype(np.complex64))
    return found


def first(maps: list[NDArray[np.complex64]]) -> FactorisedFilter:
    """Return filters of 0, and projections to some channels as they are."""
    axes = [
        np.eye(each.shape[1], count, dtype=np.float32)
        for each, count in zip(maps, KEPT, strict=True)
    ]
    return FactorisedFilter(axes, np.zeros((len(LOSS.label), sum(KEPT)), np.complex64))


def test_every_step_lowers_the_loss(rng: np.random.Generator) -> None:
    maps = sample(rng)
    losses = [first(maps).loss(maps, LOSS)]
    for steps in (1, 2, 4):
        found = first(maps).improved(maps, LOSS, steps, 20)
        losses.append(found.loss(maps, LOSS))
    assert losses == sorted(losses, reverse=True)
    assert losses[2] < 0.9 * losses[1]  # as projections are learnt


def test_first_step_finds_filters_only(rng: np.random.Generator) -> None:
    maps = sample(rng)
    start = first(maps)
    one = start.improved(maps, LOSS, 1, 20)
    assert one.filters.any()
    for before, after in zip(start.projections, one.projections, strict=True):
        assert np.array_equal(before, after)


def test_found_step_is_the_minimum_of_the_linearised_loss(
    rng: np.random.Generator,
) -> None:
    maps = sample(rng)
    one = first(maps).improved(maps, LOSS, 1, 20)
    two = one.improved(maps, LOSS, 1, 300)
    change = [b - a for a, b in zip(one.projections, two.projections, strict=True)]

    def linearised(scale: float) -> float:
        """Return the loss of equation 9, with a part of the step."""
        filters = one.filters + scale * (two.filters - one.filters)
        score = (one.projected(maps) * filters).sum(axis=1)
        moved = FactorisedFilter(change, one.filters).projected(maps)
        score = score + scale * (moved * one.filters).sum(axis=1)
        error = (score - LOSS.label)[:, None]
        penalty = SERIES.inner(filters, LOSS.penalty(filters))
        squares = sum(
            float(((a + scale * b) ** 2).sum())
            for a, b in zip(one.projections, change, strict=True)
        )
        return SERIES.inner(error, error) + penalty + 2e-7 * squares

    losses = [linearised(scale) for scale in (0.0, 0.8, 1.0, 1.2)]
    assert min(losses) == losses[2]


def test_principal_axes_hold_most_of_the_variance(rng: np.random.Generator) -> None:
    mixing = np.zeros((2, 5))
    mixing[0, :3], mixing[1, 3:] = 3.0, 1.0
    cells = (rng.standard_normal((6, 6, 2)) @ mixing).astype(np.float32)
    axes = principal_axes(cells, 2)
    assert axes.T @ axes == pytest.approx(np.eye(2), abs=1e-5)
    assert abs(axes[:3, 0]) == pytest.approx(np.full(3, 3.0**-0.5), abs=0.05)
