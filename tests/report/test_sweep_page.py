"""Report page of a sweep as text, and the data of its figures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.evaluation.score_track import score_missing
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.sweep_axes import Axis, Sweep
from simbench.evaluation.statistics.sweep_scores import SweepScores, sweep_scores
from simbench.report import sweep_figures, write_report
from simbench.report.palette import tracker_styles
from simbench.report.sweep_pictures import sweep_pictures
from tests.report.synthetic_sweep import one_dial, synthetic_sweep, two_dials

STYLES = tracker_styles(["firm", "frail"])


def written(folder: Path, sweep: Sweep) -> str:
    """Write the report of a sweep and return it."""
    scores, sequences, run, swept = synthetic_sweep(sweep)
    path = folder / "report.html"
    write_report(scores, sequences, run, path, swept=swept)
    text = path.read_text(encoding="utf-8")
    start = text.index("<script>/**\n* plotly.js")
    return text[:start] + text[text.index("</script>", start) :]


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(tmp_path_factory.mktemp("sweep"), one_dial())


@pytest.fixture(scope="module")
def swept() -> SweepScores:
    return synthetic_sweep(one_dial())[3]


def test_all_variants_share_one_chapter(html: str) -> None:
    assert html.count('class="chapter') == 1
    assert 'id="scenario-poles"' in html
    assert "<h1>poles by occlusion.hidden, 2 trackers, 3 seeds</h1>" in html


def test_breaking_points_come_first(html: str) -> None:
    found = html.index("beyond the range: above one half from 0 to 0.98")
    assert found < html.index('class="chapter')


def test_value_that_was_not_reached_has_its_reason(html: str) -> None:
    assert (
        "occlusion.hidden=1 (1 of 3 seeds): not reachable: nothing is that wide" in html
    )


def test_every_value_has_its_picture(html: str) -> None:
    assert html.count("<b>occlusion.hidden=") == 5
    assert html.count('<rect class="truth"') == 5
    assert "frame 20, 25 % visible, behind pole" in html


def test_sequences_of_all_variants_are_listed(html: str) -> None:
    assert html.count("<td>poles · occlusion.hidden=0.5</td>") == 3


def test_two_dials_have_a_map_for_each_tracker(tmp_path: Path) -> None:
    text = written(tmp_path, two_dials())
    assert text.count('data-plot="map-') == 2
    assert text.count('class="pictures') == 2
    assert 'data-plot="breaking"' in text
    assert 'data-plot="success"' not in text


def test_report_is_written_for_a_sweep_that_reached_no_value(tmp_path: Path) -> None:
    lost = [
        score_missing(
            scenario="poles",
            variant=variant,
            seed=0,
            tracker="firm",
            reason="not reachable: no",
            status="unreachable",
        )
        for variant in one_dial().points()
    ]
    scores = Scores.concat(lost)
    swept = sweep_scores(scores.runs, one_dial(), np.random.default_rng(0))
    write_report(scores, [], {}, tmp_path / "report.html", swept=swept)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "No value was reached" in text
    assert "data-plot=" not in text[: text.index("<script>/**\n* plotly.js")]
    assert "occlusion.hidden=0.5: not reachable: no" in text


def test_curves_are_at_the_values_achieved(swept: SweepScores) -> None:
    figure = sweep_figures.score_by_dial(swept, STYLES, "success_50", "share of frames")
    assert figure is not None
    assert [trace["meta"]["tracker"] for trace in figure["data"]] == [
        "firm",
        "frail",
    ]  # a line each: three seeds have no interval, so no band
    assert figure["data"][0]["x"] == [0.0, 0.245, 0.49, 0.735, 0.98]
    assert figure["data"][0]["y"] == [1.0] * 5


def test_band_is_the_interval_where_there_are_seeds_enough(swept: SweepScores) -> None:
    known = {"success_50.low": 0.6, "success_50.high": 0.9}
    many = replace(swept, points=swept.points.assign(**known))
    figure = sweep_figures.score_by_dial(many, STYLES, "success_50", "share of frames")
    assert figure is not None
    band = figure["data"][0]
    assert (band["fill"], max(band["y"]), min(band["y"])) == ("toself", 0.9, 0.6)


def test_breaking_point_is_marked_where_there_is_one(swept: SweepScores) -> None:
    figure = sweep_figures.score_by_dial(
        swept, STYLES, "success_50", "share of frames", has_breaking=True
    )
    assert figure is not None
    diamonds = [t for t in figure["data"] if t.get("marker", {}).get("symbol")]
    (mark,) = diamonds
    assert mark["meta"] == {"tracker": "frail"}
    assert mark["x"] == [pytest.approx(0.49, abs=0.01)]
    assert mark["error_x"]["array"][0] >= 0.0
    json.dumps(figure, allow_nan=False)  # JSON has no NaN


def test_figure_of_particles_is_left_out_without_particles(swept: SweepScores) -> None:
    none = replace(swept, points=swept.points.assign(**{"particles_mean.mean": 0.0}))
    assert sweep_figures.score_by_dial(none, STYLES, "particles_mean", "") is None


def map_of(swept: SweepScores) -> dict[str, Any]:
    figure = sweep_figures.success_map(swept, "frail")
    json.dumps(figure, allow_nan=False)
    heat, contour = figure["data"]
    assert contour["z"] == heat["z"]
    assert (contour["contours"]["start"], contour["contours"]["end"]) == (0.5, 0.5)
    return dict(heat)


def test_map_has_the_first_dial_across_and_the_second_up() -> None:
    swept = synthetic_sweep(two_dials())[3]
    heat = map_of(swept)
    assert heat["x"] == [0.0, 0.245, 0.49, 0.735, 0.98]
    assert heat["y"] == [0.0, 0.2]
    assert heat["z"][0][0] == 1.0
    assert heat["z"][1][0] == pytest.approx(1 - 8 / 39, abs=1e-3)


def test_map_is_empty_where_there_is_no_sequence() -> None:
    swept = synthetic_sweep(two_dials())[3]
    gone = swept.points["variant"] == "occlusion.hidden=0.5,noise=0.2"
    points = swept.points.copy()
    points.loc[gone, ["success_50.mean", "achieved.occlusion.hidden"]] = float("nan")
    assert map_of(replace(swept, points=points))["z"][1][2] is None


def test_breaking_point_beyond_the_range_is_an_open_mark_on_its_edge() -> None:
    swept = synthetic_sweep(two_dials())[3]
    firm, frail = sweep_figures.breaking_by_other(swept, STYLES)["data"]
    assert firm["marker"]["symbol"] == ["circle-open"] * 2
    assert firm["y"] == [0.98, 0.98]
    assert frail["marker"]["symbol"] == ["circle"] * 2
    assert frail["x"] == [0.0, 0.2]


def test_pictures_of_an_occlusion_are_the_most_hidden_frames() -> None:
    _, sequences, _, _ = synthetic_sweep(one_dial())
    (row,) = sweep_pictures(one_dial(), {one.variant: one for one in sequences})
    # without occlusion: the time of the deepest occlusion of the other values
    assert [one.caption.partition(",")[0] for one in row] == ["frame 20"] * 5
    # three widths of the car, 40 px of 320, are more than the minimum share
    assert [(one.width, one.height) for one in row] == [(120, 75)] * 5
    assert row[2].boxes[0][2:] == [40.0, 24.0]


def test_pictures_of_another_dial_are_at_the_same_time() -> None:
    _, sequences, _, _ = synthetic_sweep(one_dial())
    first = sequences[0]
    sweep = Sweep("poles", "", (Axis("displacement_px", (2.0, 4.0)),))
    slow, fast = sweep.points()
    twice = replace(first, frames=first.frames[::2], truth=_every_other(first.truth))
    (row,) = sweep_pictures(sweep, {slow: first, fast: twice})
    assert [one.caption.partition(",")[0] for one in row] == [
        "frame 20",
        "frame 10",
    ]
    moves = [after[0] - before[0] for before, after in (s.boxes for s in row)]
    assert moves == [2.0, 4.0]


def test_value_without_a_sequence_has_no_picture() -> None:
    _, sequences, _, _ = synthetic_sweep(one_dial())
    (row,) = sweep_pictures(one_dial(), {one.variant: one for one in sequences[:-1]})
    assert (row[-1].source, row[-1].caption) == ("", "not reached")
    assert sweep_pictures(one_dial(), {}) == []


def _every_other(truth: Any) -> Any:
    return replace(
        truth,
        boxes=truth.boxes[::2],
        visible_fraction=truth.visible_fraction[::2],
        absent=truth.absent[::2],
        occluders=truth.occluders[::2],
    )
