"""Statistics over seeds: hand-checked intervals, and repetitions on one seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.measures.track_measures import success_curve
from simbench.evaluation.score_track import score, score_failure
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.instance_statistics import (
    curve,
    seed_means,
    spread,
    summary,
)
from simbench.evaluation.statistics.intervals import (
    describe_interval,
    share_interval,
    student_interval,
)
from tests.statistics.intervals import CASES, Case, coverage


def track_lost_from(sequence: Sequence, frame: int) -> Track:
    """Return a track on the truth until ``frame``, far from it afterwards."""
    count = len(sequence)
    boxes = sequence.truth.boxes.copy()
    boxes[frame:, 0] += 1000.0
    ones = np.ones(count)
    return Track(boxes, ones, np.full(count, 10), 0.1 * ones, seed=0)


def scored(sequence: Sequence, seed: int | None, lost: int, again: int = 0) -> Scores:
    seeded = replace(sequence, seed=seed)
    track = track_lost_from(seeded, lost)
    return score(replace(track, tracker="mine", repetition=again), seeded)


def test_spread_of_five_values_has_students_interval() -> None:
    over = spread([1.0, 2.0, 3.0, 4.0, 5.0])
    assert (over.mean, over.minimum, over.maximum) == (3.0, 1.0, 5.0)
    assert over.sd == pytest.approx(np.sqrt(2.5))
    # Student's t for 4 degrees of freedom at 97.5 % is 2.776.
    assert (over.low, over.high) == pytest.approx((1.037, 4.963), abs=1e-3)


@pytest.mark.parametrize("bounded", [False, True])
def test_spread_of_four_values_has_a_range_and_no_interval(bounded: bool) -> None:
    over = spread([0.1, 0.2, 0.3, 0.4], is_bounded=bounded)
    assert (over.minimum, over.maximum, over.count) == (0.1, 0.4, 4)
    assert np.isnan([over.low, over.high]).all()
    parts = over.low, over.high, over.minimum, over.maximum
    assert describe_interval(*parts, 1) == "n too small, 0.1 to 0.4"


def test_interval_of_shares_stays_within_zero_and_one() -> None:
    over = spread([1.0, 1.0, 1.0, 1.0, 0.6], is_bounded=True)
    assert 0.0 < over.low < over.mean < over.high <= 1.0


def test_interval_of_perfect_shares_is_not_a_point() -> None:
    low, high = share_interval(np.ones(5))
    assert float(low) == pytest.approx(0.923, abs=1e-3)
    assert high == 1.0


def test_interval_of_shares_around_one_half_is_students() -> None:
    values = np.array([0.4, 0.5, 0.6, 0.45, 0.55, 0.5, 0.52, 0.48])
    ours, theirs = share_interval(values), student_interval(values)
    assert ours == pytest.approx(theirs, rel=1e-2)


def test_interval_of_shares_mirrors_that_of_misses(rng: np.random.Generator) -> None:
    values = rng.beta(5.0, 0.5, size=(20, 7))
    low, high = share_interval(values)
    missed_low, missed_high = share_interval(1.0 - values)
    assert_allclose(low, 1.0 - missed_high, atol=1e-9)
    assert_allclose(high, 1.0 - missed_low, atol=1e-9)


@pytest.mark.parametrize(
    "repeats", [1_000, pytest.param(20_000, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("count", [5, 10, 20])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_interval_of_a_mean_covers_it_and_is_not_wide(
    case: Case, count: int, repeats: int
) -> None:
    # required: 93 % for normal scores, 88 % for skewed ones; 1,000 repeats have a
    # standard error of at most 1.1 %, of which three are allowed
    found = coverage(case, count, repeats, share_interval)
    margin = 3.0 * np.sqrt(case.required * (1.0 - case.required) / repeats)
    assert found.coverage >= case.required - (margin if repeats < 20_000 else 0.0)
    if count >= 10:
        assert found.width <= 1.6  # of Student's


def test_spread_ignores_nan() -> None:
    assert spread([1.0, np.nan, 3.0]).mean == 2.0
    assert spread([1.0, np.nan, 3.0]).count == 2


def test_spread_of_one_value_has_no_deviation() -> None:
    over = spread([0.5])
    assert (over.mean, over.count) == (0.5, 1)
    assert np.isnan([over.sd, over.low, over.high]).all()


def test_spread_of_no_values_is_nan() -> None:
    assert np.isnan(spread([]).mean)
    assert spread([np.nan]).count == 0


def test_spread_with_an_infinite_value_has_no_interval() -> None:
    over = spread([1.0, np.inf])
    assert over.mean == np.inf
    assert np.isnan([over.sd, over.low]).all()


def test_repetitions_are_averaged_before_seeds_are_counted(tiny: Sequence) -> None:
    scores = Scores.concat(
        [
            scored(tiny, seed=1, lost=8),  # success 1
            scored(tiny, seed=1, lost=1, again=1),  # success 0
            scored(tiny, seed=2, lost=8),
        ]
    )
    means = seed_means(scores.runs, ["success_50"])
    assert means["success_50"].tolist() == [0.5, 1.0]
    (row,) = summary(scores.runs, ["success_50"]).to_dict("records")
    assert (row["seeds"], row["runs"], row["failed"]) == (2, 3, 0)
    assert row["success_50.mean"] == 0.75


def test_summary_includes_failed_runs_with_their_scores(tiny: Sequence) -> None:
    scores = Scores.concat(
        [
            scored(tiny, seed=1, lost=8),
            score_failure(scenario="tiny", seed=2, tracker="mine", reason="killed"),
        ]
    )
    (row,) = summary(scores.runs, ["success_50"]).to_dict("records")
    assert (row["seeds"], row["failed"], row["success_50.mean"]) == (2, 1, 0.5)


def test_summary_has_a_row_for_recorded_data_without_seed(tiny: Sequence) -> None:
    scores = scored(tiny, seed=None, lost=8)
    (row,) = summary(scores.runs, ["success_50"]).to_dict("records")
    assert (row["seeds"], row["success_50.mean"]) == (1, 1.0)


def test_tracker_that_does_no_work_has_no_frame_rate(tiny: Sequence) -> None:
    scores = Scores.concat([scored(tiny, seed=1, lost=8), scored(tiny, seed=2, lost=8)])
    idle = scores.runs.assign(tracker="idle", fps=[300_000.0, 20_000.0])  # once held up
    working = scores.runs.assign(tracker="working", fps=[900.0, 1100.0])
    found = summary(pd.concat([idle, working]), ["fps"])["fps.mean"].tolist()
    assert np.isnan(found[0]) and found[1] == 1000.0


def test_curve_averages_over_seeds(tiny: Sequence) -> None:
    scores = Scores.concat([scored(tiny, seed=1, lost=8), scored(tiny, seed=2, lost=1)])
    over = curve(scores.runs, scores.frames, "overlap", success_curve)
    assert over.count == 2
    assert_allclose(over.mean, [*[0.5] * 20, 0.0])
    assert_allclose(over.low, np.zeros(21))  # two seeds: the range
    assert_allclose(over.high, [*[1.0] * 20, 0.0])


def test_curve_over_five_seeds_has_the_interval_of_each_share(tiny: Sequence) -> None:
    lost = (8, 8, 8, 8, 1)
    scores = Scores.concat([scored(tiny, n, frames) for n, frames in enumerate(lost)])
    over = curve(scores.runs, scores.frames, "overlap", success_curve)
    low, high = share_interval(np.array([1.0, 1.0, 1.0, 1.0, 0.0]))
    assert (over.low[3], over.high[3]) == pytest.approx((float(low), float(high)))


def test_curve_of_a_killed_run_is_zero(tiny: Sequence) -> None:
    killed = score_failure(scenario="tiny", seed=2, tracker="mine", reason="killed")
    scores = Scores.concat([scored(tiny, seed=1, lost=8), killed])
    over = curve(scores.runs, scores.frames, "overlap", success_curve)
    assert over.mean[0] == 0.5


def test_curve_of_recorded_data_needs_no_seed(tiny: Sequence) -> None:
    scores = scored(tiny, seed=None, lost=8)
    over = curve(scores.runs, scores.frames, "overlap", success_curve)
    assert (over.count, over.mean[0]) == (1, 1.0)


def test_curve_without_any_scored_frame_is_nan(tiny: Sequence) -> None:
    scores = scored(tiny, seed=1, lost=8)
    unscored = scores.frames.assign(scored=False)
    over = curve(scores.runs, unscored, "overlap", success_curve)
    assert over.count == 0
    assert np.isnan(over.mean).all()
