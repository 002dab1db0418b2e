"""Results of a sweep: means by value of the dial, breaking points, descriptions."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from pandas.testing import assert_frame_equal

from simbench.core.errors import DatasetError
from simbench.evaluation.score_track import score_missing
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.sweep_scores import SweepScores, sweep_scores
from simbench.report.sweep_text import (
    breaking_table,
    describe_breaking_point,
    notes,
    point_table,
)
from tests.report.synthetic_sweep import one_dial, synthetic_sweep, two_dials


@pytest.fixture(scope="module")
def swept() -> SweepScores:
    return synthetic_sweep(one_dial())[3]


def points_of(swept: SweepScores, tracker: str) -> pd.DataFrame:
    return swept.points[swept.points["tracker"] == tracker].reset_index(drop=True)


def test_point_has_the_mean_over_seeds_and_for_few_the_range(
    swept: SweepScores,
) -> None:
    frail = points_of(swept, "frail")
    # lost for a quarter of 39 frames, rounded: 10
    assert frail.loc[1, "success_50.mean"] == pytest.approx(29 / 39)
    assert frail["success_50.low"].isna().all()  # 3 seeds: n too small
    assert frail.loc[1, "success_50.min"] == pytest.approx(29 / 39)
    assert frail.loc[1, "particles_mean.mean"] == 50.0
    assert frail["seeds"].tolist() == [3, 3, 3, 3, 2]


def test_point_has_the_mean_achieved_value(swept: SweepScores) -> None:
    firm = points_of(swept, "firm")
    assert firm["achieved.occlusion.hidden"].tolist() == pytest.approx(
        [0.0, 0.245, 0.49, 0.735, 0.98]
    )


def test_unknown_achieved_value_is_as_requested() -> None:
    points = synthetic_sweep(two_dials())[3].points
    assert np.allclose(points["achieved.noise"], points["requested.noise"])


def test_sequence_that_cannot_be_generated_is_excluded_from_the_mean(
    swept: SweepScores,
) -> None:
    row = points_of(swept, "firm").iloc[-1]
    assert (row["seeds"], row["missing"]) == (2, 1)
    assert row["success_50.mean"] == 1.0
    assert row["reason"] == "not reachable: nothing is that wide"


def test_killed_tracker_scores_zero_at_the_achieved_value_of_its_sequence(
    swept: SweepScores,
) -> None:
    row = points_of(swept, "frail").iloc[-1]
    assert row["success_50.mean"] == 0.0
    assert row["achieved.occlusion.hidden.min"] == pytest.approx(0.98)


def test_breaking_points_of_both_trackers(swept: SweepScores) -> None:
    firm, frail = swept.breaking.to_dict("records")
    assert (firm["tracker"], firm["state"]) == ("firm", "beyond")
    assert (firm["low"], firm["high"]) == (np.inf, np.inf)
    assert (frail["tracker"], frail["state"], frail["seeds"]) == ("frail", "within", 3)
    assert frail["value"] == pytest.approx(0.49, abs=0.01)
    assert frail["low"] <= frail["value"] <= frail["high"]


def test_two_dials_give_a_breaking_point_per_value_of_the_second() -> None:
    swept = synthetic_sweep(two_dials())[3]
    frail = swept.breaking[swept.breaking["tracker"] == "frail"]
    assert frail["other"].tolist() == [0.0, 0.2]
    without, noisy = frail["value"]
    assert without - noisy == pytest.approx(0.2, abs=0.03)
    assert len(swept.points) == 20


def test_point_without_sequences_has_no_scores() -> None:
    scores = synthetic_sweep(one_dial())[0]
    variant = "occlusion.hidden=1"
    lost = [
        score_missing(
            scenario="poles",
            variant=variant,
            seed=seed,
            tracker=tracker,
            reason="not reachable: no",
            status="unreachable",
        )
        for tracker in ("firm", "frail")
        for seed in (0, 1, 2)
    ]
    kept = Scores(scores.runs[scores.runs["variant"] != variant], scores.frames)
    runs = Scores.concat([kept, *lost]).runs
    swept = sweep_scores(runs, one_dial(), np.random.default_rng(0))
    row = points_of(swept, "firm").iloc[-1]
    assert (row["seeds"], row["missing"]) == (0, 3)
    assert np.isnan([row["success_50.mean"], row["achieved.occlusion.hidden"]]).all()
    assert notes(swept) == ["occlusion.hidden=1: not reachable: no"]
    assert point_table(swept)[1][-1][2:4] == ["-", "-"]
    assert swept.breaking["range_high"].tolist() == pytest.approx([0.735, 0.735])


def test_sweep_without_sequences_has_no_breaking_points() -> None:
    rows = [
        score_missing(
            scenario="poles",
            variant=variant,
            seed=0,
            tracker="firm",
            reason="no",
            status="unreachable",
        )
        for variant in one_dial().points()
    ]
    runs = Scores.concat(rows).runs
    swept = sweep_scores(runs, one_dial(), np.random.default_rng(0))
    assert len(swept.breaking) == 0
    assert len(swept.points) == 5


def test_same_generator_gives_the_same_tables(swept: SweepScores) -> None:
    again = synthetic_sweep(one_dial())[3]
    assert_frame_equal(again.points, swept.points)
    assert_frame_equal(again.breaking, swept.breaking)


def test_sweep_scores_round_trip_through_disk(
    swept: SweepScores, tmp_path: Path
) -> None:
    swept.write(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "breaking_points.parquet",
        "sweep.parquet",
    ]
    again = SweepScores.read(tmp_path, swept.sweep)
    assert_frame_equal(again.points, swept.points)
    assert_frame_equal(again.breaking, swept.breaking)


def test_table_of_another_sweep_is_named(swept: SweepScores, tmp_path: Path) -> None:
    swept.write(tmp_path)
    with pytest.raises(
        DatasetError, match=r"sweep\.parquet: .* lacks requested\.noise"
    ):
        SweepScores.read(tmp_path, two_dials())


def test_table_has_requested_and_achieved_values_once_per_point(
    swept: SweepScores,
) -> None:
    headings, rows = point_table(swept)
    assert headings[:3] == ["occlusion.hidden", "tracker", "success"]
    assert [row[0] for row in rows[:4]] == ["0 → 0", "", "0.25 → 0.245", ""]
    assert rows[2][1:] == ["firm", "1.00", "1.00", "0.95", "50"]


def test_point_off_its_dial_has_a_star_and_a_note(swept: SweepScores) -> None:
    runs = synthetic_sweep(one_dial())[0].runs
    name = "achieved.occlusion.hidden"
    far = runs.assign(**{name: runs[name].mask(runs["seed"] == 0, runs[name] - 0.1)})
    off = sweep_scores(far, one_dial(), np.random.default_rng(0))
    assert point_table(off)[1][2][0] == "0.25 → 0.212*"
    assert (
        "occlusion.hidden=0.25: beyond the tolerance on 1 of 3 seeds: "
        "achieved occlusion.hidden 0.145 to 0.245"
    ) in notes(off)
    assert not any("tolerance" in note for note in notes(swept))


def test_point_with_missing_sequences_has_a_note(swept: SweepScores) -> None:
    assert notes(swept) == [
        "occlusion.hidden=1 (1 of 3 seeds): not reachable: nothing is that wide"
    ]


def test_breaking_table_names_the_dial_and_the_other(swept: SweepScores) -> None:
    headings, rows = breaking_table(swept)
    assert headings == ["tracker", "breaking point of occlusion.hidden"]
    assert rows[0] == ["firm", "beyond the range: above one half from 0 to 0.98"]
    headings, rows = breaking_table(synthetic_sweep(two_dials())[3])
    assert headings == ["tracker", "noise", "breaking point of occlusion.hidden"]
    assert [row[1] for row in rows] == ["0", "0.2", "0", "0.2"]


@pytest.mark.parametrize(
    ("state", "ends", "words"),
    [
        ("within", (0.4, 0.5), "0.45 (0.4 to 0.5)"),
        ("within", (np.nan, np.nan), "0.45 (n too small)"),
        ("within", (-np.inf, np.inf), "0.45 (under 0 to above 1)"),
        (
            "beyond",
            (0.8, np.inf),
            "beyond the range: above one half from 0 to 1 (0.8 to above 1)",
        ),
        ("below", (-np.inf, -np.inf), "below the range: under one half from 0 to 1"),
    ],
)
def test_breaking_point_in_words(
    state: str, ends: tuple[float, float], words: str
) -> None:
    assert describe_breaking_point(_broken(state, *ends, dial="noise")) == words


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ("beyond", "below the range: above one half from 0 to 1"),
        ("below", "beyond the range: under one half from 0 to 1"),
    ],
)
def test_range_of_a_dial_that_is_harder_downwards_is_left_at_its_other_end(
    state: str, words: str
) -> None:
    assert (
        describe_breaking_point(_broken(state, np.nan, np.nan, dial="contrast"))
        == words
    )


def _broken(state: str, low: float, high: float, dial: str) -> SimpleNamespace:
    ends = {"low": low, "high": high, "range_low": 0, "range_high": 1}
    return SimpleNamespace(state=state, value=0.45, dial=dial, **ends)
