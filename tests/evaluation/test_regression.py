"""The regression gate: verdicts, messages and baselines on disk."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.regression import (
    TABLE_HEADINGS,
    Baseline,
    Check,
    compare,
    table_rows,
    write_junit,
)
from simbench.evaluation.scores import Scores, score, score_failure
from simbench.experiments.regression_suite import DEFAULT_SUITE
from tests.tiny_sequence import tiny_sequence

SEEDS = (0, 1, 2)
LONG = tiny_sequence(51)  # 50 scored frames: one frame is 0.02


def track_right_for(sequence: Sequence, kept: int, particles: int) -> Track:
    """Return a track that is right in the first ``kept`` scored frames only."""
    count = len(sequence)
    boxes = sequence.truth.boxes.copy()
    boxes[1 + kept :, 0] += 1000.0
    ones = np.ones(count)
    return Track(boxes, ones, np.full(count, particles), 0.1 * ones, seed=0)


def suite(
    kept: tuple[int, ...],
    *,
    particles: int = 100,
    tracker: str = "condensation",
    scenario: str = "poles",
) -> Scores:
    """Return scores of one tracker, by seed right in so many of 50 frames."""
    parts = []
    for seed, frames in zip(SEEDS, kept, strict=False):
        sequence = replace(LONG, name=scenario, seed=seed, digest=f"digest {seed}")
        track = track_right_for(sequence, frames, particles)
        parts.append(score(replace(track, tracker=tracker), sequence))
    return Scores.concat(parts)


def baseline_of(scores: Scores, reason: str = "the first") -> Baseline:
    return Baseline.from_scores(
        scores,
        reason=reason,
        versions={"simbench": "0.1.0"},
        settings={"seeds": list(SEEDS), "scenarios": ["poles"], "frames": 51},
    )


def verdicts(checks: list[Check]) -> dict[str, str]:
    return {check.measure: check.verdict for check in checks}


# Success 0.8, 0.9, 1.0 over seeds: mean 0.9, deviation 0.1, tolerance
# 3 * 0.1 / sqrt(3) + 0.02 = 0.193.
USUAL = (40, 45, 50)


def test_tolerance_is_three_standard_errors_and_a_minimum() -> None:
    (row,) = baseline_of(suite(USUAL)).rows
    assert row.mean["success_50"] == pytest.approx(0.9)
    assert row.sd["success_50"] == pytest.approx(0.1)
    assert row.tolerance("success_50") == pytest.approx(0.3 / np.sqrt(3) + 0.02)
    assert row.tolerance("particles_mean") == pytest.approx(2.0)


def test_same_scores_pass() -> None:
    checks = compare(baseline_of(suite(USUAL)), suite(USUAL))
    assert len(checks) == 3
    assert all(check.verdict == "ok" for check in checks)


def test_fall_within_the_spread_over_seeds_passes() -> None:
    checks = compare(baseline_of(suite(USUAL)), suite((36, 36, 36)))  # 0.9 to 0.72
    assert verdicts(checks)["success_50"] == "ok"


def test_fall_beyond_the_spread_over_seeds_fails() -> None:
    checks = compare(baseline_of(suite(USUAL)), suite((35, 35, 35)))  # 0.9 to 0.70
    assert verdicts(checks) == {
        "precision_20": "worse",
        "success_50": "worse",
        "particles_mean": "ok",
    }
    assert not checks[1].passed
    assert checks[1].message == (
        "poles / condensation: success_50 was 0.900 +- 0.193, is 0.700"
    )


def test_seeds_that_agree_have_the_minimum_tolerance() -> None:
    baseline = baseline_of(suite((45, 45, 45)))
    assert verdicts(compare(baseline, suite((44, 44, 44))))["success_50"] == "ok"
    assert verdicts(compare(baseline, suite((43, 43, 43))))["success_50"] == "worse"


def test_better_success_passes_as_better() -> None:
    checks = compare(baseline_of(suite((30, 30, 30))), suite((40, 40, 40)))
    assert verdicts(checks)["success_50"] == "better"
    assert all(check.passed for check in checks)


@pytest.mark.parametrize("particles", [97, 103])
def test_particle_usage_fails_when_it_changes_in_either_direction(
    particles: int,
) -> None:
    checks = compare(baseline_of(suite(USUAL)), suite(USUAL, particles=particles))
    assert verdicts(checks)["particles_mean"] == "changed"
    assert not checks[2].passed


def test_a_tenth_of_the_particles_fails_usage_and_success() -> None:
    checks = compare(baseline_of(suite(USUAL)), suite((5, 10, 15), particles=10))
    assert verdicts(checks)["particles_mean"] == "changed"
    assert verdicts(checks)["success_50"] == "worse"
    assert (checks[2].baseline, checks[2].current) == (100.0, 10.0)


def test_row_that_was_not_run_fails() -> None:
    baseline = baseline_of(suite(USUAL))
    (missing, new) = compare(baseline, suite(USUAL, tracker="other"))
    assert (missing.verdict, missing.passed) == ("missing", False)
    assert (new.verdict, new.passed, new.tracker) == ("new", True, "other")


def test_row_on_fewer_seeds_fails() -> None:
    (check,) = compare(baseline_of(suite(USUAL)), suite((40, 45)))
    assert (check.verdict, check.passed) == ("missing", False)
    assert "expected runs on seeds [0, 1, 2], got [0, 1]" in check.message


def test_other_sequences_fail() -> None:
    baseline = baseline_of(suite(USUAL))
    scores = suite(USUAL)
    moved = scores.runs.assign(digest=["digest 0", "digest 1", "another"])
    (check,) = compare(baseline, Scores(moved, scores.frames))
    assert (check.verdict, check.passed) == ("changed", False)
    assert "sequences are not those of the baseline" in check.message


def test_failed_run_fails_with_its_reason_and_its_lower_scores() -> None:
    killed = score_failure(
        scenario="poles", seed=2, tracker="condensation", reason="killed"
    )
    scores = Scores.concat([suite((40, 45)), killed])
    checks = compare(baseline_of(suite(USUAL)), scores)
    assert checks[0].message == "poles / condensation: failed on seed 2: killed"
    assert verdicts(checks)["run"] == "worse"
    assert verdicts(checks)["success_50"] == "worse"  # (0.8 + 0.9 + 0) / 3


def test_unknown_usage_fails() -> None:
    runs = suite(USUAL).runs.assign(particles_mean=np.nan)
    checks = compare(baseline_of(suite(USUAL)), Scores(runs, suite(USUAL).frames))
    assert verdicts(checks)["particles_mean"] == "changed"


def test_baseline_of_some_trackers_keeps_the_rows_of_others() -> None:
    def both(tracker: str, kept: tuple[int, ...]) -> list[Scores]:
        return [
            suite(kept, tracker=tracker, scenario=name) for name in ("poles", "weave")
        ]

    earlier = baseline_of(Scores.concat([*both("dsp", USUAL), *both("still", USUAL)]))
    low = (10, 10, 10)
    later = baseline_of(Scores.concat([*both("new", low), *both("dsp", low)]), "why")
    merged = later.with_rows_of(earlier)
    assert merged.reason == "why"
    assert [row.name for row in merged.rows] == [
        (scenario, "", tracker)
        for scenario in ("poles", "weave")
        for tracker in ("dsp", "still", "new")
    ]
    means = [row.mean["success_50"] for row in merged.rows]
    assert means == pytest.approx([0.2, 0.9, 0.2] * 2)


def test_suite_replaces_the_tracker_of_the_same_label() -> None:
    before = replace(DEFAULT_SUITE, trackers=["dsp", "still"])
    dsp = "dsp=condensation@particles=10"
    assert before.with_trackers(["kcf=still", dsp]).trackers == [
        dsp,
        "still",
        "kcf=still",
    ]


def test_new_baseline_must_state_its_reason() -> None:
    with pytest.raises(DatasetError, match="expected a reason, got none"):
        baseline_of(suite(USUAL), reason="  ")


def test_new_baseline_needs_two_seeds() -> None:
    with pytest.raises(DatasetError, match="at least 2 seeds for the tolerance, got 1"):
        baseline_of(suite((40,)))


def test_new_baseline_of_failed_runs_is_refused() -> None:
    killed = score_failure(scenario="poles", seed=2, tracker="x", reason="killed")
    with pytest.raises(DatasetError, match="x on poles, seed 2: killed"):
        baseline_of(Scores.concat([suite(USUAL), killed]))


def test_new_baseline_without_a_measure_is_refused() -> None:
    runs = suite(USUAL).runs.assign(success_50=np.nan)
    with pytest.raises(DatasetError, match="expected success_50 on every seed"):
        baseline_of(Scores(runs, suite(USUAL).frames))


def test_baseline_round_trips_through_disk(tmp_path: Path) -> None:
    before = baseline_of(suite(USUAL))
    before.write(tmp_path / "baselines" / "ci.json")
    assert Baseline.read(tmp_path / "baselines" / "ci.json") == before


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


def test_baseline_with_a_number_missing_is_named(tmp_path: Path) -> None:
    path = tmp_path / "ci.json"
    baseline_of(suite(USUAL)).write(path)
    text = json.loads(path.read_text())
    text["rows"][0]["mean"]["success_50"] = None
    path.write_text(json.dumps(text))
    with pytest.raises(DatasetError, match=r"rows\.0\.mean\.success_50"):
        Baseline.read(path)


def test_baseline_without_a_measure_is_named(tmp_path: Path) -> None:
    path = tmp_path / "ci.json"
    baseline_of(suite(USUAL)).write(path)
    text = json.loads(path.read_text())
    del text["rows"][0]["sd"]["success_50"]
    path.write_text(json.dumps(text))
    with pytest.raises(DatasetError, match="success_50"):
        Baseline.read(path)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        pytest.param({"digests": []}, "digest for each of 3 seeds, got 0", id="none"),
        pytest.param({"digests": ["a"]}, "each of 3 seeds, got 1", id="too few"),
        pytest.param({"seeds": [], "digests": []}, "at least one seed", id="no seed"),
    ],
)
def test_inconsistent_baseline_row_is_named(
    tmp_path: Path, change: dict[str, list[str]], fault: str
) -> None:
    path = tmp_path / "ci.json"
    baseline_of(suite(USUAL)).write(path)
    text = json.loads(path.read_text())
    text["rows"][0] |= change
    path.write_text(json.dumps(text))
    with pytest.raises(
        DatasetError, match=f"condensation on poles: expected .*{fault}"
    ):
        Baseline.read(path)


def test_junit_has_one_case_per_check_and_one_failure_per_failed_check(
    tmp_path: Path,
) -> None:
    checks = compare(baseline_of(suite(USUAL)), suite((35, 35, 35)))
    write_junit(tmp_path / "junit.xml", checks)
    root = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert (root.tag, root.get("tests"), root.get("failures")) == (
        "testsuite",
        "3",
        "2",
    )
    case = root.findall("testcase")[1]
    assert case.get("classname") == "simbench.poles"
    assert case.get("name") == "condensation: success_50"
    assert case.find("failure") is not None


def test_junit_shows_control_characters_as_escapes(tmp_path: Path) -> None:
    nan = float("nan")
    message = "poles: \x1b[31mred & <worse>\x00"
    check = Check("po\x0bles", "", "my\x1b", "run", nan, nan, nan, "worse", message)
    write_junit(tmp_path / "junit.xml", [check])
    case = ElementTree.parse(tmp_path / "junit.xml").getroot().find("testcase")
    assert case is not None
    assert case.get("classname") == "simbench.po les"
    assert case.get("name") == r"my\x1b: run"
    failure = case.find("failure")
    assert failure is not None
    assert failure.get("message") == r"poles: \x1b[31mred & <worse>\x00"


def test_table_rows_match_the_headings() -> None:
    rows = table_rows(compare(baseline_of(suite(USUAL)), suite((35, 35, 35))))
    assert all(len(row) == len(TABLE_HEADINGS) for row in rows)
    assert rows[1] == (
        "poles",
        "condensation",
        "success_50",
        "0.900",
        "0.193",
        "0.700",
        "worse",
    )
