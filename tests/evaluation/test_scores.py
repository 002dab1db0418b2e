"""Scoring a track: rows, columns, values, and tables on disk."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pandas.testing import assert_frame_equal

from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.core.tracker import Failure, Track
from simbench.evaluation.score_columns import FRAME_TYPES, RUN_TYPES
from simbench.evaluation.score_track import score, score_failure, score_missing
from simbench.evaluation.scores import Scores


def perfect_track(sequence: Sequence) -> Track:
    """Return the truth as a track with 0.1 s and 50 particles per frame."""
    count = len(sequence)
    particles = np.full(count, 50)
    particles[0] = 0
    return Track(
        boxes=sequence.truth.boxes.copy(),
        confidence=np.ones(count),
        particles=particles,
        seconds=np.full(count, 0.1),
        seed=2**100,
    )


def failed_track(sequence: Sequence, frame: int) -> Track:
    """Return a perfect track that ends in ``frame``."""
    track = perfect_track(sequence)
    track.boxes[frame:] = np.nan
    track.confidence[frame:] = np.nan
    track.seconds[frame:] = np.nan
    track.particles[frame:] = 0
    return replace(track, failures=(Failure(frame, "timeout", "too slow"),))


def with_absent(sequence: Sequence, frame: int) -> Sequence:
    """Return the sequence with its target absent from one frame."""
    boxes = sequence.truth.boxes.copy()
    boxes[frame] = np.nan
    absent = np.arange(len(boxes)) == frame
    return replace(sequence, truth=replace(sequence.truth, boxes=boxes, absent=absent))


def only_run(scores: Scores) -> dict[Hashable, Any]:
    """Return the single row of the run table."""
    (row,) = scores.runs.to_dict("records")
    return row


def test_runs_have_their_columns_in_order(tiny: Sequence) -> None:
    scores = score(replace(perfect_track(tiny), tracker="mine"), tiny)
    assert list(scores.runs.columns)[:19] == [
        "scenario",
        "variant",
        "seed",
        "tracker",
        "repetition",
        "status",
        "requested.displacement_px",
        "achieved.displacement_px",
        "achieved.hidden",
        "precision_20",
        "success_50",
        "success_auc",
        "average_overlap",
        "success_75",
        "norm_precision",
        "center_error_px",
        "fps",
        "particles_min",
        "particles_mean",
    ]


def test_perfect_track_scores_full_marks(tiny: Sequence) -> None:
    run = only_run(score(replace(perfect_track(tiny), tracker="mine"), tiny))
    assert run["status"] == "ok"
    assert run["precision_20"] == run["success_50"] == run["norm_precision"] == 1.0
    assert run["success_auc"] == pytest.approx(20 / 21)
    assert run["average_overlap"] == run["success_75"] == 1.0
    assert run["center_error_px"] == run["center_error_median_px"] == 0.0
    assert run["fps"] == pytest.approx(10.0)
    assert run["particles_min"] == run["particles_mean"] == 50.0
    assert (run["frames"], run["frames_scored"], run["frames_lost"]) == (8, 7, 0)
    assert run["seconds_total"] == pytest.approx(0.8)


def test_run_records_what_is_needed_to_repeat_it(tiny: Sequence) -> None:
    run = only_run(
        score(replace(perfect_track(tiny), tracker="mine", repetition=2), tiny)
    )
    assert (run["scenario"], run["seed"], run["repetition"]) == ("tiny", 3, 2)
    assert (run["digest"], run["traffic_redraws"]) == ("ab" * 32, 1)
    assert int(str(run["track_seed"])) == 2**100
    assert run["requested.displacement_px"] == 2.0


def test_failed_track_misses_every_frame_from_the_failure_on(tiny: Sequence) -> None:
    run = only_run(score(replace(failed_track(tiny, 5), tracker="mine"), tiny))
    assert run["status"] == "failed"
    assert run["reason"] == "frame 5: timeout: too slow"
    assert run["frames_lost"] == 3  # frames 5, 6, 7 of the scored 1..7
    assert run["success_50"] == run["precision_20"] == pytest.approx(4 / 7)
    assert run["center_error_px"] == 0.0
    assert run["particles_min"] == 50.0


def test_median_error_is_infinite_when_most_frames_were_lost(tiny: Sequence) -> None:
    run = only_run(score(replace(failed_track(tiny, 2), tracker="mine"), tiny))
    assert run["center_error_median_px"] == np.inf


def test_absent_frame_is_not_scored_and_is_counted(tiny: Sequence) -> None:
    gone = with_absent(tiny, 4)
    track = perfect_track(tiny)  # an estimate in the absent frame costs nothing
    run = only_run(score(replace(track, tracker="mine"), gone))
    assert (run["frames_absent"], run["frames_scored"]) == (1, 6)
    assert run["success_50"] == 1.0


def test_frames_hold_estimate_truth_and_occluder(tiny: Sequence) -> None:
    frames = score(replace(perfect_track(tiny), tracker="mine"), tiny).frames
    assert list(frames.columns) == list(FRAME_TYPES)
    assert len(frames) == 8
    second = frames.iloc[1]
    assert (second["left"], second["truth_left"], second["time_s"]) == (6, 6, 0.04)
    assert frames["occluder"].tolist() == ["pole", *[""] * 7]
    assert frames["scored"].tolist() == [False, *[True] * 7]


def test_frame_times_are_read_without_images_where_known(
    tiny: Sequence,
) -> None:
    class Timed(list[Frame]):
        times_s = np.arange(8) / 10.0

        def __iter__(self) -> Iterator[Frame]:
            raise AssertionError("an image was read")

    timed = replace(tiny, frames=Timed(tiny.frames))
    frames = score(replace(perfect_track(tiny), tracker="mine"), timed).frames
    assert frames["time_s"].tolist() == pytest.approx(np.arange(8) / 10.0)


def test_score_refuses_a_track_of_another_length(tiny: Sequence) -> None:
    track = perfect_track(tiny)
    with pytest.raises(ValueError, match="8 frames of tiny, got 7"):
        score(replace(replace(track, boxes=track.boxes[:-1]), tracker="mine"), tiny)


def test_killed_run_scores_zero_and_keeps_its_reason() -> None:
    scores = score_failure(
        scenario="poles", seed=4, tracker="mine", reason="killed", frame_count=30
    )
    run = only_run(scores)
    assert (run["status"], run["reason"], run["seed"]) == ("failed", "killed", 4)
    assert run["success_50"] == run["precision_20"] == run["success_auc"] == 0.0
    assert (run["frames"], run["frames_scored"], run["frames_lost"]) == (30, 29, 29)
    assert len(scores.frames) == 0


def test_variant_is_that_of_the_scenario(tiny: Sequence) -> None:
    fast = replace(tiny, scenario={"name": "tiny", "variant": "fast"})
    scores = score(replace(perfect_track(fast), tracker="mine"), fast)
    assert only_run(scores)["variant"] == "fast"
    assert set(scores.frames["variant"]) == {"fast"}
    recorded = replace(tiny, scenario=None)
    assert only_run(score(perfect_track(tiny), recorded))["variant"] == ""


def test_run_without_a_sequence_has_no_measures() -> None:
    scores = score_missing(
        scenario="poles", seed=4, tracker="mine", reason="no", status="unreachable"
    )
    run = only_run(scores)
    assert (run["status"], run["reason"], run["frames"]) == ("unreachable", "no", 0)
    assert np.isnan([run["success_50"], run["precision_20"], run["success_auc"]]).all()
    assert len(scores.frames) == 0


def test_concat_keeps_types_and_puts_dials_before_measures(tiny: Sequence) -> None:
    killed = score_failure(scenario="a", seed=None, tracker="x", reason="killed")
    other = replace(tiny, name="b", requested={"hidden": 0.8})
    both = Scores.concat(
        [
            killed,
            score(perfect_track(tiny), tiny),
            score(perfect_track(tiny), other),
        ]
    )
    names = list(both.runs.columns)
    assert names[6:8] == ["requested.displacement_px", "requested.hidden"]
    for table, types in ((both.runs, RUN_TYPES), (both.frames, FRAME_TYPES)):
        assert table.dtypes.astype(str).to_dict().items() >= types.items()
    assert len(both.frames) == 16


def test_concat_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one"):
        Scores.concat([])


def test_scores_round_trip_through_disk(tiny: Sequence, tmp_path: Path) -> None:
    before = Scores.concat(
        [
            score(replace(failed_track(tiny, 5), tracker="mine"), tiny),
            score_failure(scenario="a", seed=None, tracker="x", reason="killed"),
        ]
    )
    before.write(tmp_path / "run")
    after = Scores.read(tmp_path / "run")
    assert_frame_equal(after.runs, before.runs)
    assert_frame_equal(after.frames, before.frames)
    written = sorted(path.name for path in (tmp_path / "run").iterdir())
    assert written == ["frames.parquet", "scores.parquet"]


def test_missing_table_is_named(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"scores\.parquet: no such score table"):
        Scores.read(tmp_path)


def test_corrupt_table_is_named_in_one_line(tiny: Sequence, tmp_path: Path) -> None:
    score(perfect_track(tiny), tiny).write(tmp_path)
    path = tmp_path / "frames.parquet"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(DatasetError, match=r"frames\.parquet: not a read") as caught:
        Scores.read(tmp_path)
    assert "\n" not in str(caught.value)


def test_table_without_a_column_is_named(tiny: Sequence, tmp_path: Path) -> None:
    scores = score(perfect_track(tiny), tiny)
    Scores(scores.runs.drop(columns="fps"), scores.frames).write(tmp_path)
    with pytest.raises(DatasetError, match="lacks fps"):
        Scores.read(tmp_path)


def test_scores_that_cannot_be_written_are_a_dataset_error(
    tiny: Sequence, tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(DatasetError, match="cannot be written"):
        score(perfect_track(tiny), tiny).write(tmp_path / "taken")


def test_diagnostics_are_columns_of_the_trackers_that_state_them(
    tiny: Sequence, tmp_path: Path
) -> None:
    without = perfect_track(tiny)
    sizes = np.linspace(10.0, 80.0, len(tiny))
    stating = replace(without, diagnostics={"effective_sample_size": sizes})
    column = "diagnostic.effective_sample_size"
    assert column not in score(without, tiny).frames
    both = Scores.concat([score(without, tiny), score(stating, tiny)])
    both.write(tmp_path)
    read = Scores.read(tmp_path).frames[column].to_numpy()
    assert np.isnan(read[: len(tiny)]).all()
    assert read[len(tiny) :].tolist() == sizes.tolist()
