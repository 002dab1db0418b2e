"""Breaking points: known curves are recovered, and degenerate data handled."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import expit

from simbench.evaluation.statistics.breaking_point import breaking_point, fit_logistic
from tests.statistics.breaking_points import CASES, Case, coverage

GRID = np.linspace(0.0, 1.0, 11)
Floats = NDArray[np.float64]


def swept(seeds: int, shares: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return dial, success and seeds, each seed with the same shares or its own row."""
    own = np.broadcast_to(shares, (seeds, len(GRID)))
    return np.tile(GRID, seeds), own.ravel(), np.repeat(np.arange(seeds), len(GRID))


@pytest.mark.parametrize("slope", [-5.0, -20.0, 20.0])
def test_points_on_a_logistic_curve_recover_it(
    slope: float, rng: np.random.Generator
) -> None:
    found = breaking_point(*swept(3, expit(slope * (GRID - 0.43))), rng)
    assert found.state == "within"
    assert found.value == pytest.approx(0.43, abs=1e-4)
    assert found.slope == pytest.approx(slope, rel=1e-3)
    assert found.intercept == pytest.approx(-0.43 * slope, rel=1e-3)
    # all seeds agree, so all that is left is the step of 0.1
    assert (found.low, found.high) == pytest.approx((0.33, 0.53), abs=1e-4)
    assert (found.range_low, found.range_high, found.seeds) == (0.0, 1.0, 3)


def scattered(rng: np.random.Generator, seeds: int) -> Floats:
    """Return shares of seeds with breaking points of mean 0.6 and deviation 0.08."""
    centers = 0.6 + rng.normal(0.0, 0.08, (seeds, 1))
    noise = rng.normal(0.0, 0.03, (seeds, len(GRID)))
    shares: Floats = np.clip(expit(-12.0 * (GRID - centers)) + noise, 0.0, 1.0)
    return shares


def test_interval_covers_the_true_value_at_its_level(rng: np.random.Generator) -> None:
    covered = 0
    for _ in range(100):
        found = breaking_point(*swept(6, scattered(rng, 6)), rng, samples=400)
        covered += found.low <= 0.6 <= found.high
    # 95 expected; a binomial of 100 falls below 88 once in 700 times
    assert covered >= 88


def test_interval_shrinks_with_the_seeds(rng: np.random.Generator) -> None:
    few, many = (
        breaking_point(*swept(count, scattered(rng, count)), rng) for count in (5, 45)
    )
    # nine times the seeds: a third of the width, and less, as t narrows too; the step
    # of 0.1 that is added stays
    assert many.high - many.low - 0.1 < 0.5 * (few.high - few.low - 0.1)


@pytest.mark.parametrize(
    ("share", "state", "end"), [(1.0, "beyond", np.inf), (0.0, "below", -np.inf)]
)
def test_constant_success_has_no_breaking_point_within_the_range(
    share: float, state: str, end: float, rng: np.random.Generator
) -> None:
    found = breaking_point(*swept(3, np.full(11, share)), rng)
    assert found.state == state
    assert (found.low, found.high) == (end, end)
    assert np.isnan([found.value, found.slope, found.intercept]).all()


def test_interval_of_a_dial_that_is_easier_upwards_ends_below(
    rng: np.random.Generator,
) -> None:
    perfect = swept(3, np.ones(11))
    found = breaking_point(*perfect, rng, is_harder_upwards=False)
    assert (found.state, found.low, found.high) == ("beyond", -np.inf, -np.inf)


def test_success_of_one_half_throughout_is_beyond(
    rng: np.random.Generator,
) -> None:
    assert breaking_point(*swept(3, np.full(11, 0.5)), rng).state == "beyond"


def test_curve_is_not_extrapolated(
    rng: np.random.Generator,
) -> None:
    found = breaking_point(*swept(3, expit(-4.0 * (GRID - 1.2))), rng)
    assert (found.state, found.high) == ("beyond", np.inf)
    assert found.slope == pytest.approx(-4.0, rel=1e-3)


def test_seeds_without_a_crossing_leave_the_interval_open(
    rng: np.random.Generator,
) -> None:
    steps = np.array([GRID < 0.3, GRID < 0.6, GRID < 2.0]).astype(np.float64)
    found = breaking_point(*swept(3, steps), rng)
    # as of the first seed alone, and a step lower
    assert found.low == pytest.approx(0.15, abs=1e-3)
    assert found.high == np.inf


def test_step_is_found_halfway_and_without_overflow(rng: np.random.Generator) -> None:
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        found = breaking_point(*swept(3, (GRID < 0.35).astype(np.float64)), rng)
    assert found.value == pytest.approx(0.35, abs=1e-3)
    assert 50.0 < -found.slope < 500.0


@pytest.mark.parametrize(("seeds", "width"), [(3, 0.2), (5, 0.1)])
def test_interval_of_seeds_that_agree_is_as_wide_as_the_step(
    seeds: int, width: float, rng: np.random.Generator
) -> None:
    found = breaking_point(*swept(seeds, (GRID < 0.35).astype(np.float64)), rng)
    assert found.high - found.low == pytest.approx(width, abs=1e-3)
    assert found.low < 0.31 < 0.39 < found.high  # the fall is anywhere in the step


def test_finer_values_near_the_fall_make_the_interval_narrower(
    rng: np.random.Generator,
) -> None:
    dial = np.sort(np.append(GRID, [0.325, 0.35]))
    five = np.tile(dial, 5)
    shares = (five < 0.34).astype(np.float64)
    found = breaking_point(five, shares, np.repeat(np.arange(5), len(dial)), rng)
    assert found.low <= 0.34 <= found.high
    assert found.high - found.low < 0.05


def test_two_seeds_have_no_interval(rng: np.random.Generator) -> None:
    found = breaking_point(*swept(2, expit(-9.0 * (GRID - 0.5))), rng)
    assert np.isnan([found.low, found.high]).all()


def test_one_seed_has_no_interval(rng: np.random.Generator) -> None:
    found = breaking_point(*swept(1, expit(-9.0 * (GRID - 0.5))), rng)
    assert found.value == pytest.approx(0.5, abs=1e-4)
    assert math.isnan(found.low)
    assert math.isnan(found.high)


def test_constant_dial_has_no_breaking_point(rng: np.random.Generator) -> None:
    shares = np.array([0.2, 0.4, 0.3, 0.3])
    found = breaking_point(np.full(4, 7.0), shares, np.arange(4), rng)
    assert (found.state, found.range_low, found.range_high) == ("below", 7.0, 7.0)
    assert expit(found.intercept) == pytest.approx(0.3)


def test_same_generator_gives_the_same_interval() -> None:
    shares = scattered(np.random.default_rng(1), 6)
    one, other = (
        breaking_point(*swept(6, shares), np.random.default_rng(2)) for _ in range(2)
    )
    assert one == other


def test_weights_count_as_repeated_points() -> None:
    shares = np.array([0.9, 0.8, 0.3, 0.2])
    dial = np.arange(4.0)
    twice = fit_logistic(dial, shares, np.array([[2.0, 1.0, 1.0, 1.0]]))
    longer = fit_logistic(np.append(dial, 0.0), np.append(shares, 0.9), np.ones((1, 5)))
    assert twice == pytest.approx(longer, rel=1e-6)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(0.0, 1.0), min_size=11, max_size=11),
    st.floats(1e-3, 1e6),
    st.floats(-1e3, 1e3),
)
def test_any_shares_give_a_finite_curve_and_a_point_in_range(
    shares: list[float], scale: float, shift: float
) -> None:
    dial = shift + scale * GRID
    found = breaking_point(
        dial, np.array(shares), np.arange(11) % 3, np.random.default_rng(0), samples=20
    )
    if found.state == "within":
        assert dial[0] <= found.value <= dial[-1]
        crossing = expit(found.intercept + found.slope * found.value)
        assert crossing == pytest.approx(0.5, abs=1e-6)
    assert not math.isnan(found.low)
    assert found.low <= found.high


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_interval_holds_the_fall_gentle_or_steep_with_few_seeds_or_many(
    case: Case,
) -> None:
    # 90 % required; a binomial of 150 falls below 85 % once in 40 times at 90 %, and
    # the coverage of each case is above it
    found = coverage(case, 150)
    assert min(found.widened, found.refined) >= 0.85
    assert found.refined_width < found.width
