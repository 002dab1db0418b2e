"""The rules of toolkits on cases one can check by head; see also tests/compat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from simbench.core.errors import SimbenchError
from simbench.core.sequence import Sequence
from simbench.evaluation.measures.raster_overlap import raster_overlap
from simbench.evaluation.measures.rules import RULES, RunBoxes, find_rules
from simbench.evaluation.score_track import score, score_failure
from simbench.evaluation.scores import Scores
from tests.evaluation.test_scores import failed_track, perfect_track, with_absent
from tests.tiny_sequence import tiny_sequence

HERE = [20.0, 20.0, 10.0, 10.0]
ASIDE = [25.0, 20.0, 10.0, 10.0]  # overlap 50 / 150, 5 px off, half a width
NOWHERE = [np.nan] * 4


def boxes(*rows: list[float]) -> NDArray[np.float64]:
    return np.array(rows)


def run(
    estimates: NDArray[np.float64],
    truth: NDArray[np.float64],
    *,
    said: tuple[int, ...] = (),
    visible: tuple[float, ...] | None = None,
    unknown: tuple[int, ...] = (),
) -> RunBoxes:
    count = len(truth)
    absent = np.isnan(truth).any(axis=1) & ~np.isin(np.arange(count), unknown)
    return RunBoxes(
        estimates,
        truth,
        absent,
        np.isin(np.arange(count), said),
        np.full(count, np.nan) if visible is None else np.array(visible),
        100,
        60,
    )


def test_simbench_drops_the_first_frame_and_absent_ones() -> None:
    judged = RULES["simbench"].judge(
        run(boxes(HERE, ASIDE, HERE), boxes(HERE, HERE, NOWHERE))
    )
    assert judged.scored.tolist() == [False, True, False]
    assert_allclose(judged.overlap, [1, 1 / 3, np.nan])


def test_frame_with_unknown_truth_is_dropped_not_missed() -> None:
    given = run(boxes(HERE, HERE), boxes(HERE, NOWHERE), unknown=(1,))
    for name in ("simbench", "got10k"):
        assert not RULES[name].judge(given).scored[1]
    long = run(boxes(*[HERE] * 12), boxes(*[HERE] * 11, NOWHERE), unknown=(11,))
    assert RULES["vot"].judge(long).scored.tolist() == [*[False] * 10, True, False]


def test_otb_counts_every_frame_and_takes_the_first_for_a_hit() -> None:
    judged = RULES["otb"].judge(
        run(boxes(ASIDE, ASIDE, HERE), boxes(HERE, HERE, NOWHERE))
    )
    assert judged.scored.all()
    assert_allclose(judged.overlap, [1, 1 / 3, 0])
    assert_array_equal(judged.center_error, [0, 5, np.inf])


def test_got10k_drops_frames_in_which_nothing_is_visible() -> None:
    given = run(
        boxes(*[HERE] * 4), boxes(*[HERE] * 4), visible=(1.0, 0.0, 0.001, np.nan)
    )
    assert RULES["got10k"].judge(given).scored.tolist() == [False, False, True, True]


def test_got10k_keeps_the_width_of_a_box_cut_on_the_left() -> None:
    over = [-5.0, 0.0, 10.0, 10.0]  # clipped to 0, 0, 10, 10 by the toolkit
    judged = RULES["got10k"].judge(run(boxes(HERE, over), boxes(HERE, [0, 0, 10, 10])))
    assert_allclose(judged.overlap[1], 1.0)
    right = [95.0, 0.0, 10.0, 10.0]  # clipped to 5 px
    judged = RULES["got10k"].judge(run(boxes(HERE, right), boxes(HERE, [95, 0, 5, 10])))
    assert_allclose(judged.overlap[1], 1.0)


def test_estimates_are_rounded_to_thousandths_where_text_files_are() -> None:
    fine = boxes(HERE, [20.0004, 20.0, 10.0, 10.0])
    truth = boxes(HERE, HERE)
    for name in ("otb", "got10k"):
        assert RULES[name].judge(run(fine, truth)).center_error[1] == 0.0
    assert RULES["lasot"].judge(run(fine, truth)).center_error[1] > 0.0


def test_vot_rounds_to_pixels_and_counts_from_the_eleventh_frame() -> None:
    near = [20.4, 20.4, 10.4, 9.6]
    judged = RULES["vot"].judge(run(boxes(*[near] * 12), boxes(*[HERE] * 12)))
    assert judged.scored.tolist() == [*[False] * 10, True, True]
    assert judged.overlap[11] == 1.0


def test_vot_rewards_a_reported_absence_and_nothing_else_without_a_target() -> None:
    judged = RULES["vot"].judge(
        run(
            boxes(HERE, NOWHERE, HERE, NOWHERE, NOWHERE),
            boxes(HERE, NOWHERE, NOWHERE, NOWHERE, HERE),
            said=(1, 4),
        )
    )
    # said absent, a box, no answer after a failure, said absent of a target there
    assert judged.overlap.tolist() == [1, 1, 0, 0, 0]
    assert judged.center_error.tolist() == [0, 0, np.inf, np.inf, np.inf]


def test_lasot_repeats_missing_estimates_and_misses_absent_frames() -> None:
    judged = RULES["lasot"].judge(
        run(
            boxes(ASIDE, ASIDE, NOWHERE, [3, 3, 0, 9], HERE, HERE),
            boxes(HERE, HERE, HERE, HERE, NOWHERE, HERE),
            visible=(1, 1, 1, 1, 0, 0),
        )
    )
    assert judged.scored.all()
    # the first is a hit, two frames repeat the second, out of view, wholly hidden
    assert_allclose(judged.overlap, [1, 1 / 3, 1 / 3, 1 / 3, 0, 0])
    assert_array_equal(judged.center_error, [0, 5, 5, 5, np.inf, np.inf])
    assert_allclose(judged.norm_center_error[:2], [0, 0.5])


def test_lasot_takes_a_target_that_begins_outside_for_precise_but_no_success() -> None:
    cut = [-2.0, 20.0, 10.0, 10.0]
    judged = RULES["lasot"].judge(
        run(boxes(HERE, cut, cut), boxes(HERE, cut, [-0.5, 20.0, 10.0, 10.0]))
    )
    assert judged.overlap[1] == judged.center_error[1] == 0.0
    assert judged.overlap[2] > 0.7  # counted from 1 it begins at .5


def test_lasot_does_not_widen_targets_below_a_pixel() -> None:
    small = [20.0, 20.0, 0.5, 0.5]
    off = [20.25, 20.0, 0.5, 0.5]
    given = run(boxes(HERE, off), boxes(HERE, small))
    assert RULES["lasot"].judge(given).norm_center_error[1] == 0.5
    assert RULES["simbench"].judge(given).norm_center_error[1] == 0.25


@pytest.mark.parametrize(
    ("name", "perfect"),
    [
        pytest.param("simbench", 20 / 21, id="simbench"),
        pytest.param("otb", 20 / 21, id="otb"),
        pytest.param("got10k", 100 / 101, id="got10k"),
        pytest.param("vot", 1.0, id="vot: 1 is reachable"),
        pytest.param("lasot", 20 / 21, id="lasot"),
    ],
)
def test_area_of_a_perfect_track(name: str, perfect: float) -> None:
    assert RULES[name].success_area(np.ones(3)) == pytest.approx(perfect)
    assert np.isnan(RULES[name].success_area(np.empty(0)))


def test_unknown_rules_are_refused_with_the_nearest() -> None:
    with pytest.raises(SimbenchError, match=r"rules: expected one of .*'got10k'\?"):
        find_rules("got-10k")


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        pytest.param([2, 2, 4, 4], [4, 2, 4, 4], 8 / 24, id="half"),
        pytest.param([2.5, 2, 4, 4], [2, 2, 4, 4], 1.0, id="halves round to even"),
        pytest.param([0, 0, 0, 0], [0, 0, 0, 0], 1.0, id="both empty"),
        pytest.param([0, 0, 0, 0], [2, 2, 4, 4], 0.0, id="one empty"),
        pytest.param([-4, 2, 8, 4], [0, 2, 4, 4], 1.0, id="cut at the image"),
        pytest.param([50, 50, 4, 4], [60, 50, 4, 4], 0.0, id="both outside"),
        pytest.param([2, 2, 1, 4], [2, 4, 1, 4], 1.0, id="one column: an accident"),
    ],
)
def test_raster_overlap(
    first: list[float], second: list[float], expected: float
) -> None:
    found = raster_overlap(boxes(first), boxes(second), (32, 24))
    assert found.tolist() == [pytest.approx(expected)]


def scored() -> Scores:
    sequence = with_absent(tiny_sequence(14), 12)
    return Scores.concat(
        [
            score(replace(perfect_track(sequence), tracker="mine"), sequence),
            score(replace(failed_track(sequence, 11), tracker="ends"), sequence),
            score_failure(scenario="a", seed=None, tracker="x", reason="killed"),
        ]
    )


def test_scores_by_other_rules_and_back_are_the_same() -> None:
    before = scored()
    for rules in RULES.values():
        other = before.by_rules(rules)
        assert set(other.runs["rules"]) == {rules.name}
        again = other.by_rules(RULES["simbench"])
        assert again.runs.equals(before.runs)
        assert again.frames.equals(before.frames)


def test_scores_by_rules_have_their_frames_and_shares() -> None:
    runs = scored().by_rules(RULES["vot"]).runs.set_index("tracker")
    assert runs["frames_scored"].tolist() == [4, 4, 0]
    # frames 10, 11, 12 (absent, and said so unless it failed before) and 13
    assert runs["average_overlap"].tolist() == [1.0, 0.25, 0.0]
    by_otb = scored().by_rules(RULES["otb"]).runs.set_index("tracker")
    assert by_otb["success_50"].tolist() == pytest.approx([13 / 14, 11 / 14, 0.0])


def test_recorded_data_keep_their_unknown_seed(tiny: Sequence) -> None:
    recorded = replace(tiny, seed=None, scenario=None)
    found = score(perfect_track(recorded), recorded).by_rules(RULES["otb"])
    assert found.runs["seed"].isna().all()
    assert found.runs["frames_scored"].tolist() == [8]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        pytest.param("otb", (1 + 8 / 40) / 2, id="otb: each run once"),
        pytest.param("got10k", (19 + 7) / (19 + 39), id="got10k: each frame"),
        pytest.param("vot", (20 * 1.0 + 40 * 0.0) / 60, id="vot: by length"),
    ],
)
def test_runs_are_pooled_as_the_toolkit_does(name: str, expected: float) -> None:
    short, long = tiny_sequence(20), tiny_sequence(40, name="longer")
    inside = [replace(one, width=200) for one in (short, long)]
    lost = perfect_track(inside[1])
    lost.boxes[8:, 1] += 100.0
    both = [score(perfect_track(inside[0]), inside[0]), score(lost, inside[1])]
    found = Scores.concat(both).by_rules(RULES[name]).overall()
    assert found["average_overlap"].tolist() == [pytest.approx(expected)]
