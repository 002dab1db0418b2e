"""Sign-flip tests, Holm's correction, power: hand-checked, and against simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import permutation_test

from simbench.evaluation.statistics.paired import (
    count_to_detect,
    holm,
    paired_difference,
    random_signs,
    sign_flip_p,
)


def test_six_equal_differences_have_the_least_p_of_six_pairs() -> None:
    assert float(sign_flip_p(np.full(6, 0.1))) == 2 / 2**6
    assert float(sign_flip_p(np.full(6, -0.1), "less")) == 1 / 2**6
    assert float(sign_flip_p(np.full(6, 0.1), "less")) == 1.0


def test_differences_of_zero_show_nothing() -> None:
    assert float(sign_flip_p(np.zeros(20))) == 1.0


def test_exact_p_is_that_of_scipy(rng: np.random.Generator) -> None:
    values = rng.normal(0.3, 1.0, 9)
    theirs = permutation_test(
        (values,), np.mean, permutation_type="samples", n_resamples=np.inf
    )
    assert float(sign_flip_p(values)) == pytest.approx(theirs.pvalue)


def test_random_flips_are_near_the_exact_p(rng: np.random.Generator) -> None:
    values = rng.normal(0.4, 1.0, 20)
    theirs = permutation_test(
        (values,), np.mean, permutation_type="samples", n_resamples=20_000, rng=rng
    )
    # both have a standard error of at most sqrt(.25 / 10,000) = .005
    assert float(sign_flip_p(values)) == pytest.approx(theirs.pvalue, abs=0.02)


def test_same_values_have_the_same_p_in_every_call(rng: np.random.Generator) -> None:
    values = rng.normal(0.2, 1.0, 40)
    assert float(sign_flip_p(values)) == float(sign_flip_p(values))


@pytest.mark.parametrize("count", [5, 20, 300])  # the last is too large to be kept
def test_signs_of_two_calls_are_the_same(count: int) -> None:
    first, second = (list(random_signs(count, 10_000)) for _ in range(2))
    assert_array_equal(np.concatenate(first), np.concatenate(second))
    rows = np.concatenate(first)
    assert_array_equal(rows[0], 1.0)
    assert rows.shape == (2**5 if count == 5 else 10_000, count)


def test_signs_that_are_kept_for_other_tests_cannot_be_changed() -> None:
    signs = next(iter(random_signs(20, 10_000)))
    with pytest.raises(ValueError, match="read-only"):
        signs *= -1.0


def test_columns_are_tested_one_by_one(rng: np.random.Generator) -> None:
    values = rng.normal(0.2, 1.0, (15, 3))
    each = [float(sign_flip_p(column)) for column in values.T]
    assert_allclose(sign_flip_p(values), each)


@pytest.mark.parametrize("count", [8, 25])
def test_skewed_differences_of_two_equal_trackers_alarm_at_most_at_the_level(
    count: int, rng: np.random.Generator
) -> None:
    pairs = rng.beta(0.6, 0.1, (count, 4000, 2))  # most are near 1
    p = sign_flip_p(pairs[..., 0] - pairs[..., 1], flips=2000)
    # the level and three standard errors of 4,000 tests
    assert np.mean(p <= 0.05) <= 0.05 + 3 * math.sqrt(0.05 * 0.95 / 4000)


def test_holm_multiplies_by_the_tests_that_are_left() -> None:
    assert_allclose(holm([0.01, 0.02, 0.03]), [0.03, 0.04, 0.04])
    assert_allclose(holm([0.6, 0.6]), [1.0, 1.0])
    assert len(holm([])) == 0


def test_summary_of_paired_differences() -> None:
    found = paired_difference([0.1, 0.3, -0.1, 0.0, 0.2, np.nan])
    assert (found.count, found.minimum, found.maximum) == (5, -0.1, 0.3)
    assert found.mean == pytest.approx(0.1)
    assert found.effect == pytest.approx(0.1 / np.std([0.1, 0.3, -0.1, 0, 0.2], ddof=1))
    assert found.wins == pytest.approx(0.7)  # three, and one tie of five
    assert found.low < 0.1 < found.high


def test_few_pairs_have_no_interval_and_none_has_no_difference() -> None:
    assert np.isnan(paired_difference([0.1] * 4).low)
    nothing = paired_difference([np.nan])
    assert (nothing.count, nothing.p) == (0, 1.0)


def test_equal_differences_have_an_infinite_effect() -> None:
    assert paired_difference([0.25] * 6).effect == math.inf
    assert paired_difference([0.0] * 6).effect == 0.0


def test_count_to_detect_has_the_power_asked_for(rng: np.random.Generator) -> None:
    count = count_to_detect(0.02, 0.05)
    assert count == 52  # as of G*Power: paired t test, d = .4, two-sided, .8
    values = rng.normal(0.02, 0.05, (4000, count))
    t = values.mean(axis=1) / (values.std(axis=1, ddof=1) / math.sqrt(count))
    assert np.mean(np.abs(t) > 2.008) == pytest.approx(0.8, abs=0.03)


def test_count_to_detect_has_ends() -> None:
    assert count_to_detect(0.02, 0.0) == 6
    assert count_to_detect(0.02, 1e-6) == 6
    assert count_to_detect(0.02, 1000.0) is None
    assert count_to_detect(0.02, math.nan) is None
    assert count_to_detect(0.0, 1.0) is None
