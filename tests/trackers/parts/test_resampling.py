"""The four schemes of resampling, and what is computed of weights."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simbench.trackers.parts.resampling import (
    SCHEMES,
    effective_sample_size,
    entropy,
    normalised,
    residual,
    stratified,
    systematic,
)

WEIGHTS = np.array([0.42, 0.0, 0.3, 0.17, 0.07, 0.03, 0.01, 0.0])
EACH_SCHEME = pytest.mark.parametrize("scheme", SCHEMES)
raw_weights = arrays(np.float64, st.integers(1, 60), elements=st.floats(0.0, 1.0))
seeds = st.integers(0, 2**32 - 1)


def weights_of(raw: np.ndarray) -> np.ndarray:
    if raw.sum() < 1e-3:
        raw = raw + 1.0
    return np.asarray(raw / raw.sum())


def counts_of(scheme: str, rounds: int, rng: np.random.Generator) -> np.ndarray:
    """Return the (rounds, N) copies of each particle."""
    sample, count = SCHEMES[scheme], len(WEIGHTS)
    rows = [np.bincount(sample(WEIGHTS, rng), minlength=count) for _ in range(rounds)]
    return np.array(rows)


@EACH_SCHEME
def test_expected_copies_are_the_weights_times_their_number(
    scheme: str, rng: np.random.Generator
) -> None:
    rounds, count = 20_000, len(WEIGHTS)
    counts = counts_of(scheme, rounds, rng)
    # No scheme has a greater variance than independent draws, N w (1 - w).
    deviations = np.sqrt(count * WEIGHTS * (1.0 - WEIGHTS) / rounds)
    off = np.abs(counts.mean(axis=0) - count * WEIGHTS)
    assert (off <= 5.0 * deviations).all()
    assert (counts.sum(axis=1) == count).all()


def test_schemes_differ_in_variance_as_their_papers_say(
    rng: np.random.Generator,
) -> None:
    spread = {name: counts_of(name, 4000, rng).var(axis=0).sum() for name in SCHEMES}
    independent = len(WEIGHTS) * (WEIGHTS * (1.0 - WEIGHTS)).sum()
    assert spread["multinomial"] == pytest.approx(independent, rel=0.1)
    assert spread["systematic"] < spread["stratified"] < 0.7 * independent
    assert spread["residual"] < 0.7 * independent


@EACH_SCHEME
def test_equal_seeds_give_equal_ancestors(scheme: str) -> None:
    sample = SCHEMES[scheme]
    first, again, other = (
        sample(WEIGHTS, np.random.default_rng(seed)).tolist() for seed in (1, 1, 4)
    )
    assert first == again != other


@EACH_SCHEME
@given(raw=raw_weights, seed=seeds)
def test_ancestors_are_particles_of_some_weight(
    scheme: str, raw: np.ndarray, seed: int
) -> None:
    weights = weights_of(raw)
    ancestors = SCHEMES[scheme](weights, np.random.default_rng(seed))
    assert len(ancestors) == len(weights)
    assert (weights[ancestors] > 0.0).all()
    if scheme != "residual":
        assert (np.diff(ancestors) >= 0).all()


@pytest.mark.parametrize("sample", [systematic, residual])
def test_equal_weights_keep_every_particle_once(
    sample: object, rng: np.random.Generator
) -> None:
    assert callable(sample)
    assert sorted(sample(np.full(4, 0.25), rng).tolist()) == [0, 1, 2, 3]


@given(raw=raw_weights, seed=seeds)
def test_systematic_samples_each_its_share_or_once_more(
    raw: np.ndarray, seed: int
) -> None:
    weights = weights_of(raw)
    ancestors = systematic(weights, np.random.default_rng(seed))
    counts = np.bincount(ancestors, minlength=len(weights))
    assert np.all(np.abs(counts - len(weights) * weights) < 1.0 + 1e-6)


@given(raw=raw_weights, seed=seeds)
def test_stratified_is_off_by_less_than_two(raw: np.ndarray, seed: int) -> None:
    weights = weights_of(raw)
    ancestors = stratified(weights, np.random.default_rng(seed))
    counts = np.bincount(ancestors, minlength=len(weights))
    assert np.all(np.abs(counts - len(weights) * weights) < 2.0 + 1e-6)


@given(raw=raw_weights, seed=seeds)
def test_residual_takes_at_least_the_whole_copies(raw: np.ndarray, seed: int) -> None:
    weights = weights_of(raw)
    ancestors = residual(weights, np.random.default_rng(seed))
    counts = np.bincount(ancestors, minlength=len(weights))
    assert np.all(counts >= np.floor(len(weights) * weights - 1e-9))


@EACH_SCHEME
@pytest.mark.parametrize(
    "weights",
    [
        pytest.param([0.5, 0.4], id="sum below one"),
        pytest.param([1.5, -0.5], id="negative"),
        pytest.param([float("nan"), 1.0], id="not a number"),
    ],
)
def test_unnormalised_weights_are_refused(
    scheme: str, weights: list[float], rng: np.random.Generator
) -> None:
    with pytest.raises(ValueError, match="sum to 1"):
        SCHEMES[scheme](np.array(weights), rng)


def test_log_weights_of_any_size_are_normalised() -> None:
    log_weights = np.log([0.2, 0.3, 0.5])
    for shift in (-5000.0, 0.0, 5000.0):
        weights = normalised(log_weights + shift)
        assert weights == pytest.approx([0.2, 0.3, 0.5], rel=1e-9)


def test_log_weights_that_say_nothing_are_equal_weights() -> None:
    assert normalised(np.full(4, -np.inf)).tolist() == [0.25] * 4


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_log_weights_that_are_no_numbers_are_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="log weights"):
        normalised(np.array([0.0, wrong]))


@given(raw=raw_weights)
def test_effective_sample_size_and_entropy_are_between_one_and_all(
    raw: np.ndarray,
) -> None:
    weights = weights_of(raw)
    count = len(weights)
    assert 1.0 - 1e-9 <= effective_sample_size(weights) <= count + 1e-9
    # The number of equally weighted particles of that entropy is at least the other.
    assert effective_sample_size(weights) <= math.exp(entropy(weights)) + 1e-6
    assert entropy(weights) <= math.log(count) + 1e-9


def test_one_particle_that_has_all_the_weight_is_one_effective_particle() -> None:
    weights = np.array([0.0, 1.0, 0.0])
    assert effective_sample_size(weights) == 1.0
    assert entropy(weights) == 0.0
