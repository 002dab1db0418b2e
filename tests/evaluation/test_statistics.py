"""Statistics over seeds: hand-checked intervals, and repetitions on one seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.measures import success_curve
from simbench.evaluation.scores import Scores, score, score_failure
from simbench.evaluation.statistics import curve, seed_means, spread, summary


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


def test_spread_of_one_two_three() -> None:
    over = spread([1.0, 2.0, 3.0])
    assert (over.mean, over.sd, over.minimum, over.maximum) == (2.0, 1.0, 1.0, 3.0)
    # Student's t for 2 degrees of freedom at 97.5 % is 4.303.
    assert (over.low, over.high) == pytest.approx((-0.484, 4.484), abs=1e-3)


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


def test_interval_covers_the_mean_at_its_level(
    rng: np.random.Generator,
) -> None:
    # 2000 samples of 4 normal values: the share covered is 0.95 with a standard error
    # of sqrt(0.95 * 0.05 / 2000) = 0.005; four of these are 0.02.
    over = [spread(values) for values in rng.normal(size=(2000, 4))]
    covered = np.mean([one.low <= 0.0 <= one.high for one in over])
    assert covered == pytest.approx(0.95, abs=0.02)


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


def test_curve_averages_over_seeds(tiny: Sequence) -> None:
    scores = Scores.concat([scored(tiny, seed=1, lost=8), scored(tiny, seed=2, lost=1)])
    over = curve(scores.runs, scores.frames, "overlap", success_curve)
    assert over.count == 2
    assert_allclose(over.mean, [*[0.5] * 20, 0.0])
    assert_allclose(over.sd, [*[np.sqrt(0.5)] * 20, 0.0])


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
