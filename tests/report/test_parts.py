"""The parts of a report: tables, figures, pictures and colours, each by itself."""

from __future__ import annotations

import base64
from dataclasses import replace

import cv2
import numpy as np
import pytest

from simbench.core.frame import Frame
from simbench.evaluation.scores import Scores, score
from simbench.report import figures, tables
from simbench.report.palette import styles
from simbench.report.pictures import animation, stills
from simbench.report.sections import ReportSection, sections
from tests.report.drawn_run import drawn_run, drawn_sequence, jittered


@pytest.fixture(scope="module")
def parts() -> list[ReportSection]:
    scores, _, run = drawn_run()
    return sections(scores, run)


def test_trackers_come_in_the_order_of_the_run(parts: list[ReportSection]) -> None:
    assert [part.trackers for part in parts] == [("close", "loose", "still")] * 2


def test_killed_run_adds_its_seed(parts: list[ReportSection]) -> None:
    assert parts[0].seeds == (0, 1, 2)
    assert parts[1].seeds == (0, 1, 2, 3)


def test_overall_table_has_two_cells_a_scenario_and_marks_the_best(
    parts: list[ReportSection],
) -> None:
    rows = dict(tables.overall_rows(parts, ["close", "loose", "still", "absent"]))
    assert [cell.mean for cell in rows["close"]] == ["1.00", "1.00", "0.75", "0.75"]
    assert all(cell.is_best for cell in rows["close"])
    assert not any(cell.is_best for cell in rows["loose"])
    assert [cell.mean for cell in rows["absent"]] == ["–"] * 4


def test_equally_good_trackers_are_all_best() -> None:
    sequence = drawn_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 0.0, 10)
    (part,) = sections(
        Scores.concat([score(track, sequence, tracker=name) for name in "ab"]), {}
    )
    rows = tables.overall_rows([part], ["a", "b"])
    assert [cell.is_best for _, cells in rows for cell in cells] == [True] * 4


def test_lower_centre_error_is_better(parts: list[ReportSection]) -> None:
    column = [one.measure for one in tables.SCORE_COLUMNS].index("center_error_px")
    best = [row[0] for row in tables.score_rows(parts[0]) if row[3][column].is_best]
    assert best == ["close"]


def test_score_table_counts_seeds_and_failed_runs(parts: list[ReportSection]) -> None:
    rows = {
        name: (seeds, failed) for name, seeds, failed, _ in tables.score_rows(parts[1])
    }
    assert rows == {"close": (4, 1), "loose": (3, 1), "still": (3, 0)}


def test_dials_stand_requested_beside_achieved(parts: list[ReportSection]) -> None:
    assert tables.dial_rows(parts[0]) == [
        ("displacement_px", "2.00", "2.00 ± 0.00", "2.00 … 2.00"),
        ("occlusion.hidden", "–", "0.60 ± 0.00", "0.60 … 0.60"),
    ]


def test_sequences_are_listed_with_the_least_that_was_visible(
    parts: list[ReportSection],
) -> None:
    rows = tables.sequence_rows(parts[0])
    assert rows[0] == ("0", "120 frames", "0", "40 %", "0", "0" * 64)
    assert [row[0] for row in rows] == ["0", "1", "2"]


def test_occluded_span_runs_while_less_than_95_percent_are_visible(
    parts: list[ReportSection],
) -> None:
    frames = parts[0].of_seed(0)["close"]
    # The car, 40 px wide, meets the pole (150 to 174 px) at 2 px a frame from 20 px:
    # in frame 46 its front is at 152 and 95 % are seen; in frame 75 its back is at 170
    # and 90 % are. The pole hides 24 of its 40 px at most.
    ((first, last, least),) = figures.occluded_spans(frames)
    assert (first, last) == (47, 75)
    assert least == pytest.approx(0.4)


def test_absent_frames_are_shaded_as_hidden(parts: list[ReportSection]) -> None:
    frames = parts[1].of_seed(0)["close"]
    gone = frames.assign(absent=frames["frame"] == 10, visible_fraction=np.nan)
    assert figures.occluded_spans(gone) == [(10, 10, 0.0)]


def test_error_figure_draws_errors_too_small_for_its_axis_at_its_floor() -> None:
    sequence = drawn_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 0.0, 10)
    (part,) = sections(score(track, sequence, tracker="mine"), {})
    figure = figures.error_by_frame(part.of_seed(0), styles(["mine"]))
    assert figure["data"][0]["x"][0] == 1  # frame 0 is given
    assert set(figure["data"][0]["y"]) == {0.1}


def test_particle_figure_is_left_out_when_no_tracker_has_particles() -> None:
    sequence = drawn_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 1.0, 0)
    (part,) = sections(score(track, sequence, tracker="mine"), {})
    assert figures.particles_by_frame(part.of_seed(0), styles(["mine"])) is None


def test_curve_of_a_single_seed_has_no_band() -> None:
    sequence = drawn_sequence("poles", 0)
    track = jittered(sequence, np.random.default_rng(0), 1.0, 0)
    (part,) = sections(score(track, sequence, tracker="mine"), {})
    (line,) = figures.success(part, styles(["mine"]))["data"]
    assert len(line["x"]) == 21


def test_animation_keeps_at_most_80_even_frames_with_their_boxes() -> None:
    sequence = drawn_sequence("poles", 0)
    frames = score(
        jittered(sequence, np.random.default_rng(0), 0.0, 0), sequence, tracker="mine"
    ).frames
    film = animation(sequence, {"mine": frames}, 10_000_000)
    assert film["frames"] == list(range(0, 120, 2))
    assert film["times"][1] == 0.08
    assert film["truth"][1] == film["tracks"]["mine"][1] == [24.0, 90.0, 40.0, 24.0]


def test_animation_comes_down_in_size_to_meet_its_budget() -> None:
    rng = np.random.default_rng(0)
    drawn = drawn_sequence("poles", 0)
    noisy = [
        Frame(
            rng.integers(0, 256, (480, 720, 3), dtype=np.uint8), one.time_s, one.index
        )
        for one in drawn.frames[:20]
    ]
    sequence = replace(drawn, frames=noisy, width=720, height=480)
    large = animation(sequence, {}, 100_000_000)["images"]
    small = animation(sequence, {}, 1_500_000)["images"]
    assert picture(large[0]).shape == (427, 640, 3)
    assert picture(small[0]).shape[1] < 640
    assert sum(map(len, small)) < 1_550_000


def test_still_keeps_the_colours_of_the_frame() -> None:
    first = stills(drawn_sequence("poles", 0))[0]
    red, green, blue = picture(first.source)[100, 30].tolist()[::-1]
    assert (red, green, blue) == pytest.approx((190, 40, 30), abs=6)
    assert first.box == (20.0, 90.0, 40.0, 24.0)


def picture(uri: str) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Decode a data URI to (H, W, 3) uint8, BGR."""
    raw = base64.b64decode(uri.removeprefix("data:image/jpeg;base64,"))
    image = cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return image.astype(np.uint8)


def test_target_in_full_view_has_no_occluded_still() -> None:
    found = stills(drawn_sequence("open-road", 0, has_pole=False))
    assert [still.caption.split(":")[0] for still in found] == [
        "First frame",
        "Last frame",
    ]


def test_target_hidden_by_half_a_percent_is_not_called_fully_visible() -> None:
    sequence = drawn_sequence("poles", 0, has_pole=False)
    visible = np.where(np.arange(120) == 7, 0.996, 1.0)
    truth = replace(sequence.truth, visible_fraction=visible)
    (_, occluded, _) = stills(replace(sequence, truth=truth))
    assert occluded.caption == "Most occluded: frame 7, 0.28 s, 99 % visible"


def test_every_tracker_has_a_look_of_its_own() -> None:
    labels = [f"tracker {i}" for i in range(20)] + ["still"]
    looks = styles(labels)
    assert len(set(looks.values())) == 21
    assert looks["still"].color == "#6B7280"


def test_colour_fades_to_the_same_colour_with_opacity() -> None:
    assert styles(["one"])["one"].faded(0.1) == "rgba(0, 114, 178, 0.1)"


def test_speed_beyond_a_thousand_has_no_decimals(parts: list[ReportSection]) -> None:
    fast = parts[0].runs.assign(fps=[1234.5, 20.0, 20.0] * 3)
    (close, loose, _) = tables.score_rows(replace(parts[0], runs=fast))
    column = [one.measure for one in tables.SCORE_COLUMNS].index("fps")
    assert close[3][column].mean == "1\N{NARROW NO-BREAK SPACE}234"
    assert loose[3][column].mean == "20"
