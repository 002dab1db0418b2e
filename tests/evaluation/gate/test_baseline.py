"""Baselines of the regression gate: what is kept, on disk and when one is updated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.core.errors import DatasetError
from simbench.evaluation.gate.baseline import Baseline
from simbench.evaluation.score_track import score_failure
from simbench.evaluation.scores import Scores
from tests.evaluation.gate.test_regression import FEW, baseline_of, suite


def test_row_has_every_score_by_seed_and_repetition() -> None:
    (row,) = baseline_of(suite(FEW)).rows
    assert row.values["success_50"] == [[0.8, 0.9], [1.0, 0.84]]
    assert row.seeds == [0, 1]
    assert row.digests == ["film 0", "film 1"]
    assert row.mean["success_50"] == pytest.approx(0.885)
    assert row.sd["success_50"] == pytest.approx(np.std([0.8, 0.9, 1.0, 0.84], ddof=1))
    assert [len(runs) for runs in row.tracks] == [2, 2]
    assert len({track for runs in row.tracks for track in runs}) == 4
    assert row.code == "code"


def test_equal_tracks_have_equal_digests() -> None:
    (row,) = baseline_of(suite(((40, 40), (45, 40)))).rows
    (same, again), (other, _) = row.tracks
    assert same == again != other


def test_baseline_of_some_trackers_keeps_the_rows_of_others() -> None:
    def both(tracker: str, kept: tuple[tuple[int, ...], ...]) -> list[Scores]:
        return [
            suite(kept, tracker=tracker, scenario=name) for name in ("poles", "weave")
        ]

    earlier = baseline_of(Scores.concat([*both("dsp", FEW), *both("still", FEW)]))
    low = ((10,), (10,))
    later = baseline_of(Scores.concat([*both("new", low), *both("dsp", low)]), "why")
    merged = later.with_rows_of(earlier)
    assert merged.reason == "why"
    assert [row.name for row in merged.rows] == [
        (scenario, "", tracker)
        for scenario in ("poles", "weave")
        for tracker in ("dsp", "still", "new")
    ]
    means = [row.mean["success_50"] for row in merged.rows]
    assert means == pytest.approx([0.2, 0.885, 0.2] * 2)


def test_new_baseline_must_state_its_reason() -> None:
    with pytest.raises(DatasetError, match="expected a reason, got none"):
        baseline_of(suite(FEW), reason="  ")


def test_new_baseline_of_failed_runs_is_refused() -> None:
    killed = score_failure(scenario="poles", seed=2, tracker="x", reason="killed")
    with pytest.raises(DatasetError, match="x on poles, seed 2: killed"):
        baseline_of(Scores.concat([suite(FEW), killed]))


def test_new_baseline_without_a_measure_is_refused() -> None:
    runs = suite(FEW).runs.assign(success_50=np.nan)
    with pytest.raises(DatasetError, match="expected success_50 of every run"):
        baseline_of(Scores(runs, suite(FEW).frames))


def test_new_baseline_with_other_repetitions_on_a_seed_is_refused() -> None:
    with pytest.raises(DatasetError, match="of 2 runs on each seed, got"):
        baseline_of(suite(((40, 41), (42,))))


def test_baseline_round_trips_through_disk(tmp_path: Path) -> None:
    before = baseline_of(suite(FEW))
    before.write(tmp_path / "baselines" / "ci.json")
    assert Baseline.read(tmp_path / "baselines" / "ci.json") == before


def test_baseline_without_rows_round_trips_through_disk(tmp_path: Path) -> None:
    before = Baseline("why", {}, {"a": 1}, [])
    before.write(tmp_path / "ci.json")
    assert Baseline.read(tmp_path / "ci.json") == before


def test_file_has_a_line_for_each_fact_so_that_changes_can_be_read(
    tmp_path: Path,
) -> None:
    baseline_of(suite(FEW)).write(tmp_path / "ci.json")
    lines = (tmp_path / "ci.json").read_text().splitlines()
    assert any(line.strip().startswith('"success_50": [[0.8, 0.9],') for line in lines)


def test_missing_baseline_is_named(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"ci\.json: baseline cannot be read"):
        Baseline.read(tmp_path / "ci.json")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        pytest.param("{", "not valid JSON", id="cut off"),
        pytest.param("[]", "the file", id="a list"),
        pytest.param('{"reason": "x"}', "versions: Field required", id="no versions"),
    ],
)
def test_broken_baseline_is_named_in_one_line(
    tmp_path: Path, text: str, fault: str
) -> None:
    (tmp_path / "ci.json").write_text(text)
    with pytest.raises(DatasetError, match=fault) as caught:
        Baseline.read(tmp_path / "ci.json")
    assert "\n" not in str(caught.value)


def changed(tmp_path: Path, **row: Any) -> Path:
    """Write a baseline whose row has other content, and return its path."""
    path = tmp_path / "ci.json"
    baseline_of(suite(FEW)).write(path)
    content = json.loads(path.read_text())
    content["rows"][0] |= row
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        pytest.param({"digests": []}, "digest for each of 2 seeds, got 0", id="none"),
        pytest.param({"digests": ["a"]}, "each of 2 seeds, got 1", id="too few"),
        pytest.param({"seeds": [], "digests": []}, "at least one seed", id="no seed"),
        pytest.param({"tracks": [["a", "b"]]}, "tracks for each of 2 seeds", id="one"),
        pytest.param({"tracks": [["a"], ["b"]]}, "of 1 runs on each seed", id="fewer"),
        pytest.param({"values": {}}, "precision_20, got none", id="no values"),
        pytest.param(
            {"sd": dict.fromkeys(("precision_20", "success_50"), 0.5)},
            "success_auc, got none|the sd",
            id="a mean missing",
        ),
    ],
)
def test_inconsistent_row_is_named(
    tmp_path: Path, change: dict[str, Any], fault: str
) -> None:
    path = changed(tmp_path, **change)
    with pytest.raises(
        DatasetError, match=f"condensation on poles: expected .*{fault}"
    ):
        Baseline.read(path)


def test_mean_and_deviation_must_be_those_of_the_values(tmp_path: Path) -> None:
    (row,) = baseline_of(suite(FEW)).rows
    path = changed(tmp_path, mean=row.mean | {"success_50": 0.9})
    with pytest.raises(
        DatasetError, match=r"the mean 0\.885 of its success_50, got 0\.9"
    ):
        Baseline.read(path)
    path = changed(tmp_path, sd=row.sd | {"success_50": 0.5})
    with pytest.raises(
        DatasetError, match=r"the sd 0\.08.* of its success_50, got 0\.5"
    ):
        Baseline.read(path)
