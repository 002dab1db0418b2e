"""Systematic resampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simbench.trackers.parts.resampling import systematic


def test_equal_weights_keep_every_particle_once(rng: np.random.Generator) -> None:
    assert systematic(np.full(5, 0.2), rng).tolist() == [0, 1, 2, 3, 4]


def test_zero_weight_particle_is_never_sampled(rng: np.random.Generator) -> None:
    weights = np.array([0.0, 0.5, 0.5, 0.0])
    samples = [systematic(weights, rng) for _ in range(1000)]
    assert set(np.concatenate(samples).tolist()) == {1, 2}


def test_sample_counts_are_unbiased(rng: np.random.Generator) -> None:
    weights = np.array([0.5, 0.3, 0.2])
    counts = np.zeros(3)
    for _ in range(20_000):
        counts += np.bincount(systematic(weights, rng), minlength=3)
    # A count differs from its mean by less than one a sample: sd < 0.5 / sqrt(20 000).
    assert counts / counts.sum() == pytest.approx(weights, abs=0.005)


@given(
    raw=arrays(np.float64, st.integers(1, 60), elements=st.floats(0.0, 1.0)),
    seed=st.integers(0, 2**32 - 1),
)
def test_each_particle_is_sampled_its_share_or_once_more(
    raw: np.ndarray, seed: int
) -> None:
    if raw.sum() < 1e-3:
        raw = raw + 1.0
    weights = raw / raw.sum()
    ancestors = systematic(weights, np.random.default_rng(seed))
    counts = np.bincount(ancestors, minlength=len(weights))
    share = len(weights) * weights
    assert len(ancestors) == len(weights)
    assert np.all(np.abs(counts - share) < 1.0 + 1e-6)
    assert np.all(np.diff(ancestors) >= 0)


@pytest.mark.parametrize(
    "weights",
    [
        pytest.param([0.5, 0.4], id="sum below one"),
        pytest.param([1.5, -0.5], id="negative"),
        pytest.param([float("nan"), 1.0], id="not a number"),
    ],
)
def test_unnormalised_weights_are_refused(
    weights: list[float], rng: np.random.Generator
) -> None:
    with pytest.raises(ValueError, match="sum to 1"):
        systematic(np.array(weights), rng)
