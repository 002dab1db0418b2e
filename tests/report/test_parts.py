"""Parts of a report, each on its own: tables, figures, pictures and colours."""

from __future__ import annotations

import base64
from dataclasses import replace

import cv2
import numpy as np
import pytest

from simbench.core.frame import Frame
from simbench.evaluation.score_track import score
from simbench.evaluation.scores import Scores
from simbench.report import figures, tables
from simbench.report.palette import tracker_styles
from simbench.report.pictures import animation, stills
from simbench.report.sections import ReportSection, split_scores
from tests.report.synthetic_run import jittered, synthetic_run, synthetic_sequence


@pytest.fixture(scope="module")
def sections() -> list[ReportSection]:
    scores, _, run = synthetic_run()
    return split_scores(scores, run)


def test_trackers_are_in_the_order_of_the_run(sections: list[ReportSection]) -> None:
    assert [section.trackers for section in sections] == [
        ("close", "loose", "still")
    ] * 2


def test_killed_run_adds_its_seed(sections: list[ReportSection]) -> None:
    assert sections[0].seeds == (0, 1, 2)
    assert sections[1].seeds == (0, 1, 2, 3)


def test_overall_table_has_two_cells_per_scenario(
    sections: list[ReportSection],
) -> None:
    rows = dict(tables.overall_rows(sections, ["close", "loose", "still", "absent"]))
    assert [cell.mean for cell in rows["close"]] == ["1.00", "1.00", "0.75", "0.75"]
    assert [cell.mean for cell in rows["absent"]] == ["–"] * 4


def test_three_seeds_are_too_few_for_an_interval_or_a_best(
    sections: list[ReportSection],
) -> None:
    rows = dict(tables.overall_rows(sections, ["close", "loose", "still"]))
    assert not any(cell.is_best for cells in rows.values() for cell in cells)
    assert rows["loose"][0].interval.startswith("n too small, 0.")
    notes = tables.column_notes(sections[0])
    small = "n too small to show a best"
    assert notes == [small if one.better else "" for one in tables.SCORE_COLUMNS]


def section_of(shifts: dict[str, float], seeds: int) -> ReportSection:
    """Return a section of trackers that miss by so many pixels, on so many seeds."""
    parts = []
    for seed in range(seeds):
        sequence = synthetic_sequence("poles", seed)
        for tracker, shift in shifts.items():
            track = jittered(sequence, np.random.default_rng(seed), 0.0, 10)
            track.boxes[1:, 0] += shift + seed
            parts.append(score(replace(track, tracker=tracker), sequence))
    return split_scores(Scores.concat(parts), {})[0]


def test_bold_are_those_that_no_other_is_shown_to_be_better_than() -> None:
    section = section_of({"good": 2.0, "same": 2.0, "bad": 15.0}, seeds=8)
    column = [one.measure for one in tables.SCORE_COLUMNS].index("center_error_px")
    best = [row[0] for row in tables.score_rows(section) if row[3][column].is_best]
    assert best == ["good", "same"]  # a lower error is better
    assert tables.column_notes(section)[column] == ""


def test_column_in_which_still_ties_the_best_does_not_discriminate() -> None:
    section = section_of({"good": 2.0, "still": 5.0}, seeds=8)
    notes = dict(
        zip(
            (c.measure for c in tables.SCORE_COLUMNS),
            tables.column_notes(section),
            strict=True,
        )
    )
    assert notes["precision_20"] == "does not discriminate"  # both are right in all
    assert notes["success_auc"] == notes["fps"] == ""
    few = section_of({"good": 2.0, "still": 5.0}, seeds=2)
    assert tables.overall_notes([few]) == ["does not discriminate"] * 2


def test_score_table_counts_seeds_and_failed_runs(
    sections: list[ReportSection],
) -> None:
    rows = {
        name: (seeds, failed)
        for name, seeds, failed, _ in tables.score_rows(sections[1])
    }
    assert rows == {"close": (4, 1), "loose": (3, 1), "still": (3, 0)}


def test_dial_rows_have_requested_and_achieved_values(
    sections: list[ReportSection],
) -> None:
    assert tables.dial_rows(sections[0]) == [
        ("displacement_px", "2.00", "2.00 ± 0.00", "2.00 … 2.00"),
        ("occlusion.hidden", "–", "0.60 ± 0.00", "0.60 … 0.60"),
    ]


def test_sequences_are_listed_with_the_least_that_was_visible(
    sections: list[ReportSection],
) -> None:
    rows = tables.sequence_rows(sections[0])
    assert rows[0] == ("0", "120 frames", "0", "40 %", "0", "0" * 64)
    assert [row[0] for row in rows] == ["0", "1", "2"]


def test_occluded_span_runs_while_less_than_95_percent_are_visible(
    sections: list[ReportSection],
) -> None:
    frames = sections[0].of_seed(0)["close"]
    # The car, 40 px wide, meets the pole (150 to 174 px) at 2 px a frame from 20 px:
    # in frame 46 its front is at 152 and 95 % are visible; in frame 75 its back is at
    # 170 and 90 % are visible. The pole hides 24 of its 40 px at most.
    ((first, last, least),) = figures.occluded_spans(frames)
    assert (first, last) == (47, 75)
    assert least == pytest.approx(0.4)


def test_absent_frames_are_shaded_as_hidden(sections: list[ReportSection]) -> None:
    frames = sections[1].of_seed(0)["close"]
    gone = frames.assign(absent=frames["frame"] == 10, visible_fraction=np.nan)
    assert figures.occluded_spans(gone) == [(10, 10, 0.0)]


def test_error_figure_draws_errors_below_its_axis_at_the_minimum() -> None:
    sequence = synthetic_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 0.0, 10)
    (section,) = split_scores(score(replace(track, tracker="mine"), sequence), {})
    figure = figures.error_by_frame(section.of_seed(0), tracker_styles(["mine"]))
    assert figure["data"][0]["x"][0] == 1  # frame 0 is given
    assert set(figure["data"][0]["y"]) == {0.1}


def test_particle_figure_is_left_out_when_no_tracker_has_particles() -> None:
    sequence = synthetic_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 1.0, 0)
    (section,) = split_scores(score(replace(track, tracker="mine"), sequence), {})
    assert (
        figures.particles_by_frame(section.of_seed(0), tracker_styles(["mine"])) is None
    )


def test_curve_of_a_single_seed_has_no_band() -> None:
    sequence = synthetic_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 1.0, 0)
    (section,) = split_scores(score(replace(track, tracker="mine"), sequence), {})
    (line,) = figures.success(section, tracker_styles(["mine"]))["data"]
    assert len(line["x"]) == 21


def test_animation_keeps_at_most_80_even_frames_with_their_boxes() -> None:
    sequence = synthetic_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 0.0, 0)
    frames = score(replace(track, tracker="mine"), sequence).frames
    video = animation(sequence, {"mine": frames}, 10_000_000)
    assert video["frames"] == list(range(0, 120, 2))
    assert video["times"][1] == 0.08
    assert video["truth"][1] == video["tracks"]["mine"][1] == [24.0, 90.0, 40.0, 24.0]


def test_animation_is_scaled_down_to_meet_its_budget() -> None:
    rng = np.random.default_rng(0)
    original = synthetic_sequence("poles", 0)
    noisy = [
        Frame(
            rng.integers(0, 256, (480, 720, 3), dtype=np.uint8), one.time_s, one.index
        )
        for one in original.frames[:20]
    ]
    sequence = replace(original, frames=noisy, width=720, height=480)
    large = animation(sequence, {}, 100_000_000)["images"]
    small = animation(sequence, {}, 1_500_000)["images"]
    assert picture(large[0]).shape == (427, 640, 3)
    assert picture(small[0]).shape[1] < 640
    assert sum(map(len, small)) < 1_550_000


def test_animation_of_a_small_budget_has_fewer_frames() -> None:
    sequence = synthetic_sequence("poles", 0)
    found = animation(sequence, {}, 40_000)
    assert 8 <= len(found["images"]) < 60
    assert found["frames"][0] == 0
    assert sum(map(len, found["images"])) < 60_000


def test_still_has_the_colours_of_the_frame() -> None:
    first = stills(synthetic_sequence("poles", 0))[0]
    red, green, blue = picture(first.source)[100, 30].tolist()[::-1]
    assert (red, green, blue) == pytest.approx((190, 40, 30), abs=6)
    assert first.boxes == [[20.0, 90.0, 40.0, 24.0]]


def picture(uri: str) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Decode a data URI to (H, W, 3) uint8, BGR."""
    raw = base64.b64decode(uri.removeprefix("data:image/jpeg;base64,"))
    image = cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return image.astype(np.uint8)


def test_target_in_full_view_has_no_occluded_still() -> None:
    found = stills(synthetic_sequence("open-road", 0, has_pole=False))
    assert [still.title for still in found] == ["First frame", "Last frame"]


def test_target_hidden_by_half_a_percent_is_not_called_fully_visible() -> None:
    sequence = synthetic_sequence("poles", 0, has_pole=False)
    visible = np.where(np.arange(120) == 7, 0.996, 1.0)
    truth = replace(sequence.truth, visible_fraction=visible)
    (_, occluded, _) = stills(replace(sequence, truth=truth))
    assert occluded.title == "Most occluded"
    assert occluded.caption == "frame 7, 0.28 s, 99 % visible"


def test_every_tracker_has_its_own_style() -> None:
    labels = [f"tracker {i}" for i in range(20)] + ["still"]
    styles = tracker_styles(labels)
    assert len(set(styles.values())) == 21
    assert styles["still"].color == "#6B7280"


def test_colour_fades_to_the_same_colour_with_opacity() -> None:
    assert tracker_styles(["one"])["one"].faded(0.1) == "rgba(0, 114, 178, 0.1)"


def test_speed_beyond_a_thousand_has_no_decimals(sections: list[ReportSection]) -> None:
    fast = sections[0].runs.assign(fps=[1234.5, 20.0, 20.0] * 3)
    (close, loose, _) = tables.score_rows(replace(sections[0], runs=fast))
    column = [one.measure for one in tables.SCORE_COLUMNS].index("fps")
    assert close[3][column].mean == "1\N{NARROW NO-BREAK SPACE}234"
    assert loose[3][column].mean == "20"
