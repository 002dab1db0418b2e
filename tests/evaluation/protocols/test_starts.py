"""Protocols: where trackers start, what they see, and what it amounts to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from simbench.core.errors import SimbenchError
from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.measures.rules import RunBoxes
from simbench.evaluation.protocols.expected_overlap import (
    multistart_curve,
    restart_curve,
    restart_scores,
)
from simbench.evaluation.protocols.protocol_scores import (
    protocol_table,
    score_segments,
    segment_repetition,
)
from simbench.evaluation.protocols.segments import (
    FrameOrder,
    frames_in_order,
    sub_sequence,
)
from simbench.evaluation.protocols.starts import (
    Protocol,
    ProtocolRun,
    Segment,
    find_protocol,
)
from simbench.evaluation.score_tables import frame_times
from simbench.evaluation.score_track import score
from tests.tiny_sequence import tiny_sequence

SIZE = (32, 24)


def long_sequence(frames: int = 60) -> Sequence:
    """Return the tiny sequence with a target that stays in the picture."""
    tiny = tiny_sequence(frames)
    boxes = tiny.truth.boxes.copy()
    boxes[:, 0] = 4 + np.arange(frames) % 16
    inside = np.zeros(frames, np.bool_)
    truth = replace(tiny.truth, boxes=boxes, cut_by_image=inside)
    return replace(tiny, truth=truth)


def perfect(segment: Segment, sequence: Sequence) -> Track:
    boxes = sequence.truth.boxes[np.array(segment.order)].copy()
    boxes[0] = segment.start.to_array()
    count = len(boxes)
    nothing = np.zeros(count, np.int64)
    return Track(boxes, np.ones(count), nothing, np.ones(count), 0, tracker="mine")


def play(
    protocol: Protocol, sequence: Sequence, lost: dict[int, int] | None = None
) -> ProtocolRun:
    """Run a perfect tracker that is lost in some frames of the sequence."""
    run = ProtocolRun(protocol, sequence.truth, SIZE)
    while (segment := run.next()) is not None:
        track = perfect(segment, sequence)
        for frame in lost or {}:
            if frame in segment.order[1:]:
                track.boxes[segment.order.index(frame) :, 1] += 200.0
        run.add(track)
    return run


def starts(run: ProtocolRun) -> list[int]:
    return [segment.order[0] for segment, _ in run.done]


def test_one_pass_is_one_segment_over_all_frames(tiny: Sequence) -> None:
    ((segment, _),) = play("ope", tiny).done
    assert segment.order == range(8)
    assert segment.start.to_array().tolist() == tiny.truth.boxes[0].tolist()


def test_temporal_starts_are_spread_over_frames_with_twenty_to_come() -> None:
    sequence = long_sequence(60)
    found = starts(play("tre", sequence))
    # 41 frames have so many to come: every 41 / 19 of them, and the last
    assert found == [0, 2, 4, 6, 8, 10, 12, 15, 17, 19, *range(21, 26, 2), 28, 30] + [
        32,
        34,
        36,
        38,
        40,
    ]


def test_temporal_starts_avoid_hidden_and_absent_targets() -> None:
    sequence = long_sequence(60)
    visible = np.ones(60)
    visible[2:40] = 0.2
    hidden = replace(sequence, truth=replace(sequence.truth, visible_fraction=visible))
    assert starts(play("tre", hidden)) == [0, 1, 40]


def test_short_sequence_has_one_temporal_start(tiny: Sequence) -> None:
    assert starts(play("tre", tiny)) == [0]


def test_spatial_starts_move_and_scale_the_first_box_by_a_tenth() -> None:
    run = play("sre", long_sequence(4))
    boxes = {s.variation: s.start.to_array().tolist() for s, _ in run.done}
    assert len(boxes) == 12
    # the target is at 4, 6 and 8 px wide and high
    assert boxes["left"] == pytest.approx([3.2, 6, 8, 8])
    assert boxes["down"] == pytest.approx([4, 6.8, 8, 8])
    assert boxes["top left corner"] == pytest.approx([3.2, 5.2, 8.8, 8.8])
    assert boxes["bottom right corner"] == pytest.approx([4, 6, 8.8, 8.8])
    assert boxes["80 %"] == pytest.approx([4.8, 6.8, 6.4, 6.4])
    assert boxes["120 %"] == pytest.approx([3.2, 5.2, 9.6, 9.6])


def test_tracker_is_started_again_five_frames_after_a_failure() -> None:
    run = play("restart", long_sequence(60), {10: 1, 30: 1, 57: 1})
    # failed in 10, 30 and 57, after which no five frames are left
    assert starts(run) == [0, 15, 35]


def test_restart_waits_until_the_target_is_there() -> None:
    sequence = long_sequence(60)
    boxes = sequence.truth.boxes.copy()
    boxes[14:20] = np.nan
    absent = np.isnan(boxes[:, 0])
    visible = np.where(np.arange(60) == 20, 0.0, 1.0)
    gone = replace(sequence.truth, boxes=boxes, absent=absent, visible_fraction=visible)
    assert starts(play("restart", replace(sequence, truth=gone), {10: 1})) == [0, 21]


def test_absent_target_is_no_failure() -> None:
    sequence = long_sequence(30)
    boxes = sequence.truth.boxes.copy()
    boxes[14:20] = np.nan
    absent = np.isnan(boxes[:, 0])
    gone = replace(sequence.truth, boxes=boxes, absent=absent)
    assert starts(play("restart", replace(sequence, truth=gone))) == [0]


def test_anchors_run_to_the_farther_end() -> None:
    run = play("multistart", long_sequence(150))
    found = [(s.order, s.variation) for s, _ in run.done]
    assert found == [
        (range(150), ""),
        (range(50, 150), ""),
        (range(100, -1, -1), "backwards"),
        (range(149, -1, -1), "backwards"),
    ]


def test_unknown_protocol_is_refused_with_the_nearest() -> None:
    with pytest.raises(SimbenchError, match=r"protocol: .*did you mean 'restart'"):
        find_protocol("restarts")


def test_frames_backwards_are_numbered_and_timed_forwards() -> None:
    tiny = tiny_sequence(8)
    frames = frames_in_order(tiny, range(5, -1, -1))
    assert [frame.index for frame in frames] == [0, 1, 2, 3, 4, 5]
    assert [frame.time_s for frame in frames] == pytest.approx(np.arange(6) / 25.0)
    assert_array_equal(frames[1].image, tiny.frames[4].image)
    assert frames[-1].index == 5
    assert isinstance(frames, FrameOrder)
    assert [one.index for one in frames[1:3]] == [1, 2]
    with pytest.raises(IndexError):
        frames[6]
    assert frames_in_order(tiny, range(8)) is tiny.frames


def test_sub_sequence_has_the_truth_of_its_frames() -> None:
    tiny = tiny_sequence(8)
    part = sub_sequence(tiny, range(6, 1, -1), frame_times(tiny))
    assert len(part) == 5
    assert part.truth.boxes[:, 0].tolist() == [16, 14, 12, 10, 8]
    assert_array_equal(part.truth.displacement_px, [np.nan, 2, 2, 2, 2])
    assert part.truth.occluders == ("",) * 5
    vehicles, whole = part.truth.vehicles, tiny.truth.vehicles
    assert vehicles is not None
    assert whole is not None
    assert vehicles.depths[:, 0].tolist() == [26, 25, 24, 23, 22]
    assert (vehicles.vehicles, len(vehicles.masks)) == (whole.vehicles, 5)
    assert part.cameras[0] is tiny.cameras[6]


def test_segments_are_rows_of_one_run() -> None:
    sequence = long_sequence(60)
    run = play("restart", sequence, {10: 1})
    done = [
        (s, replace(t, repetition=segment_repetition("restart", 2, number)))
        for number, (s, t) in enumerate(run.done)
    ]
    scores = score_segments(done, sequence, "restart")
    assert scores.runs["repetition"].tolist() == [200_000, 200_001]
    assert scores.runs["start_frame"].tolist() == [0, 15]
    assert scores.runs["frames"].tolist() == [60, 45]
    assert set(scores.runs["protocol"]) == {"restart"}
    assert scores.frames["frame"].tolist() == [*range(60), *range(15, 60)]
    assert scores.runs["failure_frame"].fillna(-1).tolist() == [10, -1]
    table = protocol_table(scores)
    assert table is not None
    (row,) = table.to_dict("records")
    assert (row["tracker"], row["accuracy"], row["failures"]) == ("mine", 1.0, 1.0)
    assert row["robustness"] == pytest.approx(np.exp(-30 / 60))
    assert (row["low"], row["high"]) == (15, 59)


def test_one_pass_has_no_table_of_its_own_and_the_scores_as_before() -> None:
    tiny = tiny_sequence(8)
    run = play("ope", tiny)
    scores = score_segments(run.done, tiny, "ope")
    assert protocol_table(scores) is None
    assert scores.runs.equals(score(run.done[0][1], tiny).runs)


def boxes_of(overlaps: list[float]) -> RunBoxes:
    """Return frames with such overlaps, in tenths, of a target of 10 x 10 px."""
    count = len(overlaps)
    truth = np.tile([20.0, 20.0, 10.0, 10.0], (count, 1))
    found = truth.copy()
    found[:, 2] = np.array(overlaps) * 10.0
    found[np.array(overlaps) == 0.0] = [80.0, 20.0, 10.0, 10.0]
    never, unknown = np.zeros(count, np.bool_), np.full(count, np.nan)
    return RunBoxes(found, truth, never, never, unknown, 100, 60)


def test_restart_curve_counts_failed_segments_with_zeros() -> None:
    curve = restart_curve([boxes_of([1, 1, 0, 0]), boxes_of([1, 0.5, 0.5, 0.5])])
    # means from the second frame on: 1, .5, .33 and .5, .5, .5
    assert curve[1:].tolist() == pytest.approx([0.75, 0.5, (1 / 3 + 0.5) / 2])


def test_segment_that_reached_its_end_stops_counting() -> None:
    curve = restart_curve([boxes_of([1, 1]), boxes_of([1, 0.5, 0.5, 0.5])])
    assert curve[1:].tolist() == pytest.approx([0.75, 0.5, 0.5])


def test_accuracy_leaves_out_ten_frames_from_each_start() -> None:
    found = restart_scores([[boxes_of([1] + [0.2] * 9 + [0.8] * 10)]])
    assert found.accuracy == pytest.approx(0.8)
    assert (found.failures, found.robustness) == (0.0, 1.0)


def test_multistart_fails_after_ten_frames_in_a_row() -> None:
    held = [1.0] * 5 + [0.0] * 9 + [1.0] * 5
    lost = [1.0] * 5 + [0.0] * 10 + [1.0] * 5
    curves = [multistart_curve([[boxes_of(one)]], 20) for one in (held, lost)]
    assert curves[0][18] == pytest.approx((4 + 5) / 18)
    assert curves[1][18] == pytest.approx(4 / 18)
