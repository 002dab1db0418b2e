"""The regression gate: verdicts and messages, in the same environment and another."""

from __future__ import annotations

from collections.abc import Sequence as Series
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.gate.baseline import Baseline
from simbench.evaluation.gate.gate_report import (
    TABLE_HEADINGS,
    markdown_summary,
    table_rows,
    write_junit,
)
from simbench.evaluation.gate.regression import Check, compare, environment_changes
from simbench.evaluation.score_track import score, score_failure
from simbench.evaluation.scores import Scores
from tests.tiny_sequence import tiny_sequence

LONG = tiny_sequence(51)  # 50 scored frames: one frame is 0.02
HERE = {"simbench": "0.3", "numpy": "2.0", "opengl": "one"}
ELSEWHERE = HERE | {"opengl": "another"}


def track_right_for(sequence: Sequence, kept: int, particles: int) -> Track:
    """Return a track that is right in the first ``kept`` scored frames only."""
    count = len(sequence)
    boxes = sequence.truth.boxes.copy()
    boxes[1 + kept :, 0] += 1000.0
    ones = np.ones(count)
    return Track(boxes, ones, np.full(count, particles), 0.1 * ones, seed=0)


def suite(
    kept: Series[Series[int]] | NDArray[np.int64],
    *,
    particles: int = 100,
    tracker: str = "condensation",
    scenario: str = "poles",
) -> Scores:
    """Return scores of one tracker, by seed and repetition right in so many frames."""
    parts = []
    for seed, runs in enumerate(kept):
        for repetition, frames in enumerate(runs):
            once = scored_once(int(frames), particles)
            names: dict[str, Any] = {"scenario": scenario, "tracker": tracker}
            names |= {"seed": seed, "repetition": repetition}
            named = once.runs.assign(**names, digest=f"film {seed}")
            parts.append(Scores(named, once.frames.assign(**names)))
    return Scores.concat(parts)


@cache
def scored_once(kept: int, particles: int) -> Scores:
    return score(track_right_for(LONG, kept, particles), replace(LONG, seed=0))


def baseline_of(scores: Scores, reason: str = "the first") -> Baseline:
    return Baseline.from_scores(
        scores,
        reason=reason,
        versions=HERE,
        settings={"seeds": [0, 1], "scenarios": ["poles"]},
        codes=dict.fromkeys(scores.runs["tracker"], "code"),
    )


def verdicts(checks: list[Check]) -> dict[str, str]:
    return {check.measure: check.verdict for check in checks}


def drawn(seed: int, lost: int = 0) -> NDArray[np.int64]:
    """Return kept frames of 2 seeds with 20 runs each: success .9, deviation .06."""
    rng = np.random.default_rng(seed)
    return np.clip(rng.integers(40, 51, (2, 20)) - lost, 0, 50)


FEW = ((40, 45), (50, 42))


def test_equal_runs_in_the_same_environment_are_identical() -> None:
    scores = suite(drawn(0))
    (check,) = compare(baseline_of(scores), scores, versions=HERE)
    assert (check.verdict, check.passed, check.pairs) == ("identical", True, 40)
    assert check.message == "condensation: 40 runs are equal to the bit"


def test_new_version_of_simbench_is_no_other_environment() -> None:
    assert environment_changes(HERE, HERE | {"simbench": "0.4"}) == {}
    assert environment_changes(HERE, ELSEWHERE) == {"opengl": ("one", "another")}
    assert environment_changes(HERE, {}) == {
        "numpy": ("2.0", ""),
        "opengl": ("one", ""),
    }


def test_estimate_that_differs_in_its_last_bit_is_told_although_scores_are_equal() -> (
    None
):
    scores = suite(drawn(0))
    moved = scores.frames.copy()
    left = moved["left"].to_numpy(np.float64).copy()
    left[1100] = np.nextafter(left[1100], np.inf)
    moved["left"] = left
    codes = {"condensation": "other code"}
    found = compare(
        baseline_of(scores), Scores(scores.runs, moved), versions=HERE, codes=codes
    )
    assert found[0].message == (
        "condensation: 1 of 40 runs differ, the first poles, seed 1, repetition 1; "
        "its code or a parameter is another"
    )
    assert verdicts(found) == {
        "tracks": "ok",
        "precision_20": "ok",
        "success_50": "ok",
        "success_auc": "ok",
        "particles_mean": "ok",
    }


def test_code_that_is_not_repeatable_is_told() -> None:
    codes = {"condensation": "code"}
    found = compare(
        baseline_of(suite(drawn(0))), suite(drawn(1)), versions=HERE, codes=codes
    )
    assert "its code is the same: it is not repeatable" in found[0].message


def test_few_runs_that_differ_in_the_same_environment_fail() -> None:
    found = compare(baseline_of(suite(FEW)), suite(((40, 45), (50, 43))), versions=HERE)
    assert verdicts(found)["tracks"] == "changed"
    assert "fewer than 30 runs cannot tell" in found[0].message


def test_other_draws_of_unchanged_code_pass_in_another_environment() -> None:
    found = compare(baseline_of(suite(drawn(0))), suite(drawn(1)), versions=ELSEWHERE)
    assert all(check.passed for check in found)
    assert len(found) == 4


def test_fall_of_five_frames_in_fifty_fails_in_another_environment() -> None:
    fallen = suite(drawn(1, lost=5))
    found = compare(baseline_of(suite(drawn(0))), fallen, versions=ELSEWHERE)
    assert verdicts(found) == {
        "precision_20": "worse",
        "success_50": "worse",
        "success_auc": "worse",
        "particles_mean": "ok",
    }
    worst = found[1]
    assert worst.baseline - worst.current == pytest.approx(0.1, abs=0.03)
    assert worst.p < 0.001
    assert worst.message.startswith("condensation: success_50 was 0.898, is 0.")
    assert worst.place == "all"


def test_fall_on_one_scenario_is_not_hidden_by_a_rise_on_another() -> None:
    def both(lost: int, seed: int) -> Scores:
        return Scores.concat(
            [
                suite(drawn(seed, lost=lost)),
                suite(drawn(seed + 5, lost=-lost), scenario="weave"),
            ]
        )

    found = compare(baseline_of(both(0, 0)), both(8, 1), versions=ELSEWHERE)
    failed = [check for check in found if not check.passed]
    assert {(check.place, check.verdict) for check in failed} == {("poles", "worse")}
    assert failed[0].message.startswith("condensation on poles: precision_20 was")
    risen = [check for check in found if check.verdict == "better"]
    assert {check.place for check in risen} == {"weave"}


def test_proven_fall_that_does_not_matter_passes() -> None:
    steady = np.full((2, 40), 40)
    scores = suite(steady)
    runs = scores.runs.assign(success_auc=scores.runs["success_auc"] - 0.004)
    found = compare(
        baseline_of(scores), Scores(runs, scores.frames), versions=ELSEWHERE
    )
    assert verdicts(found)["success_auc"] == "ok"
    assert {c.measure: c.p for c in found}["success_auc"] < 0.001


def test_better_success_passes_as_better() -> None:
    found = compare(
        baseline_of(suite(drawn(0, lost=10))), suite(drawn(1)), versions=ELSEWHERE
    )
    assert verdicts(found)["success_50"] == "better"
    assert all(check.passed for check in found)


@pytest.mark.parametrize(
    ("particles", "verdict"), [(97, "changed"), (99, "ok"), (103, "changed")]
)
def test_particle_usage_must_stay_within_two_percent(
    particles: int, verdict: str
) -> None:
    other = suite(drawn(1), particles=particles)
    found = compare(baseline_of(suite(drawn(0))), other, versions=ELSEWHERE)
    assert verdicts(found)["particles_mean"] == verdict


def test_few_runs_fail_elsewhere_only_if_they_fall_far() -> None:
    steady = [[45]] * 9
    near, far = [[44]] * 9, [[40]] * 9
    baseline = baseline_of(suite(steady))
    assert all(c.passed for c in compare(baseline, suite(near), versions=ELSEWHERE))
    found = compare(baseline, suite(far), versions=ELSEWHERE)
    assert verdicts(found)["success_50"] == "worse"


def test_row_that_was_not_run_fails() -> None:
    baseline = baseline_of(suite(FEW))
    (missing, new) = compare(baseline, suite(FEW, tracker="other"), versions=HERE)
    assert (missing.verdict, missing.passed) == ("missing", False)
    assert (new.verdict, new.passed, new.tracker) == ("new", True, "other")


@pytest.mark.parametrize(
    ("kept", "reason"),
    [
        pytest.param(FEW[:1], "expected runs on seeds [0, 1], got [0]", id="seeds"),
        pytest.param(
            [runs[:1] for runs in FEW], "expected 2 repetitions, got 1", id="runs"
        ),
    ],
)
def test_row_with_fewer_runs_fails(kept: Series[Series[int]], reason: str) -> None:
    (check,) = compare(baseline_of(suite(FEW)), suite(kept), versions=HERE)
    assert (check.verdict, check.passed) == ("missing", False)
    assert reason in check.message


def test_other_films_fail_in_the_same_environment_only() -> None:
    scores = suite(FEW)
    moved = scores.runs.assign(digest=["film 0", "film 0", "x", "x"])
    changed = Scores(moved, scores.frames)
    found = compare(baseline_of(scores), changed, versions=HERE)
    assert (found[0].measure, found[0].verdict) == ("films", "changed")
    assert "seed 1: the film is another in the same environment" in found[0].message
    elsewhere = compare(baseline_of(scores), changed, versions=ELSEWHERE)
    assert all(check.passed for check in elsewhere)


def test_failed_run_fails_with_its_reason() -> None:
    killed = score_failure(
        scenario="poles", seed=1, tracker="condensation", reason="killed", repetition=1
    )
    scores = Scores.concat([suite([FEW[0], FEW[1][:1]]), killed])
    found = compare(baseline_of(suite(FEW)), scores, versions=ELSEWHERE)
    assert found[0].message == "poles / condensation: failed on seed 1: killed"
    assert verdicts(found)["run"] == "worse"


def test_unknown_usage_fails() -> None:
    runs = suite(drawn(1)).runs.assign(particles_mean=np.nan)
    unknown = Scores(runs, suite(drawn(1)).frames)
    found = compare(baseline_of(suite(drawn(0))), unknown, versions=ELSEWHERE)
    assert verdicts(found)["particles_mean"] == "changed"


def test_junit_has_one_case_per_check_and_one_failure_per_failed_check(
    tmp_path: Path,
) -> None:
    fallen = suite(drawn(1, lost=9))
    checks = compare(baseline_of(suite(drawn(0))), fallen, versions=ELSEWHERE)
    write_junit(tmp_path / "junit.xml", checks)
    root = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert (root.tag, root.get("tests"), root.get("failures")) == (
        "testsuite",
        "4",
        "3",
    )
    case = root.findall("testcase")[1]
    assert case.get("classname") == "simbench.all"
    assert case.get("name") == "condensation: success_50"
    assert case.find("failure") is not None


def test_junit_shows_control_characters_as_escapes(tmp_path: Path) -> None:
    nan = float("nan")
    message = "poles: \x1b[31mred & <worse>\x00"
    check = Check("po\x0bles", "", "my\x1b", "run", nan, nan, nan, 0, "worse", message)
    write_junit(tmp_path / "junit.xml", [check])
    case = ElementTree.parse(tmp_path / "junit.xml").getroot().find("testcase")
    assert case is not None
    assert case.get("classname") == "simbench.po les"
    assert case.get("name") == r"my\x1b: run"
    failure = case.find("failure")
    assert failure is not None
    assert failure.get("message") == r"poles: \x1b[31mred & <worse>\x00"


def test_summary_says_what_failed_and_what_differs_in_the_environment() -> None:
    fallen = suite(drawn(1, lost=9))
    baseline = baseline_of(suite(drawn(0)))
    checks = compare(baseline, fallen, versions=ELSEWHERE)
    changed = environment_changes(HERE, ELSEWHERE)
    text = markdown_summary(checks, changed, {"condensation": Path("a|b.mp4")})
    assert text.startswith("## simbench check: failed\n\n3 of 4 checks failed.\n")
    assert "the environment is another (opengl one → another)" in text
    assert "- **condensation: success\\_50" not in text  # shown as it is
    assert "a\\|b.mp4" in text
    assert text.count("| worse |") == 3


def test_table_rows_match_the_headings() -> None:
    fallen = suite(drawn(1, lost=9))
    checks = compare(baseline_of(suite(drawn(0))), fallen, versions=ELSEWHERE)
    rows = table_rows(checks)
    assert all(len(row) == len(TABLE_HEADINGS) for row in rows)
    assert rows[3][:2] == ("all", "condensation")
    assert rows[3][2:5] == ("particles_mean", "100.0", "100.0")
