"""Kinds of failure, attributes, positions on the road: what the simulator knows."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.core.tracker import Failure, FailureKind, Track
from simbench.evaluation.measures.attributes import ATTRIBUTES, attributes
from simbench.evaluation.measures.failure_kinds import (
    FAILURE_KINDS,
    failure_kinds,
    main_failure,
)
from simbench.evaluation.measures.road_position import road_motion
from simbench.evaluation.score_tables import frame_times
from simbench.evaluation.score_track import score
from tests.datasets.formats.staged_sequence import ABSENT, staged_sequence
from tests.evaluation.test_scores import only_run, perfect_track
from tests.tiny_sequence import tiny_sequence


def track_of(boxes: NDArray[np.float64], confidence: float = np.nan) -> Track:
    count = len(boxes)
    stated = np.full(count, confidence)
    particles = np.zeros(count, np.int64)
    return Track(boxes, stated, particles, np.full(count, 0.1), seed=0, tracker="mine")


def moved(sequence: Sequence, frame: int, box: list[float]) -> Track:
    """Return the truth as a track, with another box from a frame on."""
    boxes = sequence.truth.boxes.copy()
    boxes[frame:] = box
    return track_of(boxes)


def without_knowledge(sequence: Sequence) -> Sequence:
    """Return a sequence as a real clip is: boxes, and nothing else."""
    truth = sequence.truth
    bare = replace(
        truth,
        visible_fraction=np.full(len(sequence), np.nan),
        occluders=("",) * len(sequence),
        vehicles=None,
    )
    return replace(sequence, truth=bare, cameras=(), scenario=None, seed=None)


def run_of(track: Track, sequence: Sequence) -> dict[Hashable, Any]:
    return only_run(score(track, sequence))


def test_perfect_track_has_no_failure(tiny: Sequence) -> None:
    assert set(failure_kinds(perfect_track(tiny), tiny)) == {""}


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("exception", "raised"),
        ("timeout", "hung"),
        ("not-a-number", "not-a-number"),
        ("memory", "out of memory"),
        ("crash", "crashed"),
    ],
)
def test_end_of_a_run_is_a_kind_of_its_own(
    tiny: Sequence, kind: FailureKind, expected: str
) -> None:
    ended = moved(tiny, 5, [np.nan] * 4)
    ended = replace(ended, failures=(Failure(5, kind, "why"),))
    assert failure_kinds(ended, tiny) == [""] * 5 + [expected] * 3
    assert expected in FAILURE_KINDS


@pytest.mark.parametrize(
    ("box", "expected"),
    [
        pytest.param([0, 18, 2, 2], "lost", id="elsewhere"),
        pytest.param([17, 9, 2, 2], "collapsed", id="too small"),
        pytest.param([2, -6, 32, 32], "run away", id="too large"),
        pytest.param([np.nan] * 4, "said absent", id="said absent"),
    ],
)
def test_failure_is_told_by_place_and_size(
    tiny: Sequence, box: list[float], expected: str
) -> None:
    # in frame 6 the target is at 16, 6, and 8 px wide and high
    kinds = failure_kinds(moved(tiny, 6, box), tiny)
    assert kinds[:7] == [""] * 6 + [expected]


def test_box_on_another_vehicle_is_on_a_distractor() -> None:
    staged = staged_sequence()
    other = staged.truth.vehicles
    assert other is not None
    boxes = staged.truth.boxes.copy()
    boxes[7] = other.boxes[7, 0]
    assert failure_kinds(track_of(boxes), staged)[7] == "distractor"
    unknown = without_knowledge(staged)
    assert failure_kinds(track_of(boxes), unknown)[7] == "lost"


def test_box_that_stays_where_the_target_was_hidden_is_on_the_occluder() -> None:
    staged = staged_sequence()  # hidden by the pole in frame 3
    boxes = staged.truth.boxes.copy()
    boxes[5:8] = boxes[3] + [[0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 0.5, 0]]
    kinds = failure_kinds(track_of(boxes), staged)
    assert kinds[5:8] == ["occluder"] * 3


def test_place_of_the_occluder_turns_with_the_camera(tiny: Sequence) -> None:
    hidden = np.ones(8)
    hidden[1] = 0.1
    turned = [
        replace(
            tiny.cameras[0],
            rotation=np.array(
                [[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]]
            )
            @ tiny.cameras[0].rotation,
        )
        for a in (0.0, 0.0, *[0.2] * 6)
    ]
    truth = replace(tiny.truth, visible_fraction=hidden)
    panned = replace(tiny, cameras=tuple(turned), truth=truth)
    # a turn by .2 rad moves the place by some 10 px to the left
    shift = tiny.cameras[0].focal_px * np.tan(0.2)
    boxes = tiny.truth.boxes.copy()
    boxes[4] = boxes[1] - [shift, 0, 0, 0]
    assert failure_kinds(track_of(boxes), panned)[4] == "occluder"
    still = replace(panned, cameras=(tiny.cameras[0],) * 8)
    assert failure_kinds(track_of(boxes), still)[4] == "lost"


def test_same_box_while_the_target_leaves_it_is_frozen() -> None:
    tiny = tiny_sequence(14)
    still = track_of(np.repeat(tiny.truth.boxes[:1], 14, axis=0))
    kinds = failure_kinds(still, tiny)
    # 2 px a frame: from frame 4 on an overlap below .1 is left of 8 px
    assert kinds[:4] == [""] * 4
    assert set(kinds[4:]) == {"frozen"}


def test_box_without_a_target_is_a_failure_unless_said_absent() -> None:
    staged = staged_sequence()
    boxes = staged.truth.boxes.copy()
    assert failure_kinds(track_of(boxes), staged)[ABSENT[0]] == ""
    boxes[ABSENT[0]] = boxes[0]
    kinds = failure_kinds(track_of(boxes), staged)
    assert kinds[ABSENT[0]] == "box without target"


def test_main_failure_is_the_most_frequent_with_its_first_frame() -> None:
    assert main_failure(["", "lost", "frozen", "frozen"]) == ("frozen", 2)
    assert main_failure(["", "lost", "frozen"]) == ("lost", 1)
    assert main_failure(["", ""]) == ("", None)


def test_attributes_come_from_the_truth() -> None:
    staged = staged_sequence()
    found = pd.DataFrame(attributes(staged))
    assert list(found) == list(ATTRIBUTES)
    assert found["occluded"].tolist()[:5] == [False, False, False, True, False]
    assert found["small"][0]  # 10.5 x 8.5 px
    assert found["fast"][1]  # 6 px of 9.4
    # the truck is no vehicle of the target's class
    assert not found["near_distractor"].fillna(False).any()
    assert found["occluded"].isna().tolist() == staged.truth.absent.tolist()
    assert found["night"].isna().all()  # no scenario


def test_vehicle_of_the_same_class_near_by_is_a_distractor() -> None:
    staged = staged_sequence()
    every = staged.truth.vehicles
    assert every is not None
    twins = replace(
        every,
        vehicles=tuple(replace(v, vehicle_class="car") for v in every.vehicles),
    )
    near = replace(staged, truth=replace(staged.truth, vehicles=twins))
    found = pd.Series(attributes(near)["near_distractor"])
    # one above the other, 7.5 px apart, in frames 3 to 5; hidden in frame 5
    assert np.flatnonzero(found.fillna(False)).tolist() == [3, 4]


def test_night_is_that_of_the_scenario(tiny: Sequence) -> None:
    dark = replace(tiny, scenario={"light": {"time": "night"}})
    assert attributes(dark)["night"].all()
    assert not attributes(tiny)["night"].any()


def test_what_a_real_clip_lacks_is_unknown_in_every_column(tiny: Sequence) -> None:
    clip = without_knowledge(tiny)
    scores = score(replace(perfect_track(clip), tracker="mine"), clip)
    for name in ("occluded", "near_distractor", "night", "position_error_m"):
        assert scores.frames[name].isna().all(), name
    run = only_run(scores)
    for name in (
        "occlusions",
        "losses_per_occlusion",
        "overlap_occluded",
        "overlap_near_distractor",
        "overlap_night",
        "confidence_visible_auc",
        "position_error_m",
        "speed_error_kmh",
    ):
        assert np.isnan(run[name]), name
    assert (run["losses"], run["is_lost"], run["failure_kind"]) == (0, False, "")


def test_confidence_that_is_not_stated_has_no_measures() -> None:
    tiny = tiny_sequence(14)
    names = [
        "confidence_auc",
        "confidence_visible_auc",
        "calibration_error",
        "alarm_delay_frames",
        "losses_unnoticed",
        "false_alarms",
    ]
    silent = run_of(moved(tiny, 7, [0, 18, 2, 2]), tiny)
    assert np.isnan([silent[name] for name in names]).all()
    spoken = moved(tiny, 7, [0, 18, 2, 2])
    spoken.confidence[:] = [*[0.9] * 9, *[0.1] * 5]
    spoken.confidence[3] = 0.2
    run = run_of(spoken, tiny)
    assert run["alarm_delay_frames"] == 2.0
    assert run["losses_unnoticed"] == 0.0
    assert run["false_alarms"] == pytest.approx(1 / 6)
    # of 6 frames on the target and 7 off it, 2 of which are rated .9 like 5 of the 6
    assert run["confidence_auc"] == pytest.approx((5 * 5 + 5 * 2 * 0.5 + 5) / 42)


def test_loss_at_an_occlusion_is_counted_once_for_each() -> None:
    tiny = tiny_sequence(40)
    visible = np.ones(40)
    for first in (5, 20, 34):
        visible[first : first + 3] = 0.2
    sequence = replace(tiny, truth=replace(tiny.truth, visible_fraction=visible))
    boxes = tiny.truth.boxes.copy()
    boxes[21:28] = [0, 18, 2, 2]  # lost in the second, found, held in the third
    run = run_of(track_of(boxes), sequence)
    assert (run["losses"], run["occlusions"], run["recoveries"]) == (1, 3, 1)
    assert run["losses_per_occlusion"] == pytest.approx(1 / 3)
    assert run["recovery_frames"] == 7
    assert run["recovery_s"] == pytest.approx(7 / 25)
    assert run["held_s"] == pytest.approx(21 / 25)
    boxes[21:] = [0, 18, 2, 2]  # lost before the third, which is not counted then
    run = run_of(track_of(boxes), sequence)
    assert run["losses_per_occlusion"] == pytest.approx(1 / 2)


def test_wholly_hidden_target_may_be_said_absent() -> None:
    tiny = tiny_sequence(20)
    visible = np.ones(20)
    visible[5:12] = 0.0
    hidden = replace(tiny, truth=replace(tiny.truth, visible_fraction=visible))
    boxes = tiny.truth.boxes.copy()
    boxes[5:12] = np.nan
    assert set(failure_kinds(track_of(boxes), hidden)) == {""}
    assert run_of(track_of(boxes), hidden)["losses"] == 0
    assert failure_kinds(track_of(boxes), tiny)[5] == "said absent"
    assert run_of(track_of(boxes), tiny)["losses"] == 1


def test_run_that_holds_its_target_is_censored_at_its_end(tiny: Sequence) -> None:
    run = run_of(perfect_track(tiny), tiny)
    assert (run["held_s"], run["is_lost"]) == (pytest.approx(7 / 25), False)


def test_position_on_the_road_is_that_of_the_projected_centre(tiny: Sequence) -> None:
    vehicles = tiny.truth.vehicles
    assert vehicles is not None
    positions = vehicles.positions.copy()
    positions[:, :, 0] += 20.0
    positions[:, 0, 0] = 20.0 + np.arange(8)  # 1 m a frame, 25 m/s
    truth = replace(tiny.truth, vehicles=replace(vehicles, positions=positions))
    sequence = replace(tiny, truth=truth)
    centre = positions[:, 0] + [0, 0, vehicles.vehicles[0].height / 2]
    pixels = np.array(
        [c.project(p)[0] for c, p in zip(tiny.cameras, centre, strict=True)]
    )
    boxes = np.hstack([pixels - 2.0, np.full((8, 2), 4.0)])
    found = road_motion(boxes, sequence, frame_times(sequence))
    assert found.position_error_m == pytest.approx(np.zeros(8), abs=1e-9)
    assert found.speed_kmh == pytest.approx(np.full(8, 90.0))
    assert found.truth_speed_kmh == pytest.approx(np.full(8, 90.0))
    boxes[4] = np.nan
    found = road_motion(boxes, sequence, frame_times(sequence))
    assert np.isnan([found.position_error_m[4], found.speed_kmh[4]]).all()
    boxes[4] = [0, -500, 4, 4]  # above the horizon
    found = road_motion(boxes, sequence, frame_times(sequence))
    assert np.isnan(found.position_error_m[4])
