"""The command ``compare``: one run's trackers, two runs' versions, and its files."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from simbench.cli import execute
from simbench.cli.compare import _MEASURES
from simbench.evaluation.score_columns import RUN_TYPES
from simbench.evaluation.score_track import score
from simbench.evaluation.scores import Scores
from simbench.experiments.run_folder import RunFolder
from tests.report.synthetic_run import jittered, synthetic_sequence


def run_of(folder: Path, shifts: dict[str, float], seeds: int = 8) -> Path:
    """Write a run folder of trackers that miss by so many pixels."""
    parts = []
    for seed in range(seeds):
        sequence = synthetic_sequence("poles", seed)
        for tracker, shift in shifts.items():
            found = jittered(sequence, np.random.default_rng(seed), 0.0, 10)
            found.boxes[1:, 0] += shift
            object.__setattr__(found, "tracker", tracker)
            parts.append(score(found, sequence))
    folder.mkdir()
    RunFolder(folder).write_facts({"finished": True})
    Scores.concat(parts).write(folder)
    return folder


def test_trackers_of_a_run_are_compared_in_text_and_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = run_of(tmp_path / "run", {"good": 2.0, "bad": 30.0, "still": 40.0})
    out = tmp_path / "tables"
    assert execute(["compare", str(run), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "*marked*: no other is shown to be better" in printed
    assert "good − bad" in printed and "better" in printed
    assert "n too small" not in printed
    markdown = (out / "comparison.md").read_text()
    assert "| good | **1.000 [" in markdown
    assert "| all | good | bad | 8 | +1.000 |" in markdown
    assert "\\textbf{1.000 [" in (out / "comparison.tex").read_text()
    rows = (out / "comparison.csv").read_text().splitlines()
    assert rows[0].startswith("scenario,first,second,n,difference")
    assert len(rows) == 4  # three pairs; one scenario is all of them
    ElementTree.parse(out / "critical-difference.svg")


def test_means_of_many_scenarios_fit_a_narrow_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    run = run_of(tmp_path / "run", {"directional-45": 2.0, "condensation": 30.0})
    once = Scores.read(run)
    places = [f"scenario-{number}" for number in range(7)]
    parts = [Scores(once.runs.assign(scenario=p), once.frames) for p in places]
    Scores.concat(parts).write(run)
    assert execute(["compare", str(run)]) == 0
    lines = capsys.readouterr().out.split("first")[0].splitlines()
    assert max(map(len, lines)) <= 80
    assert [line.split(",")[0] for line in lines if ", n = 8" in line] == places
    assert sum("directional-45" in line for line in lines) == 8  # over all, too


def test_too_few_seeds_say_how_many_are_needed_and_mark_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shifts = {"good": 2.0, "bad": 30.0, "still": 40.0}
    run = run_of(tmp_path / "run", shifts, seeds=6)
    assert execute(["compare", str(run), "--out", str(tmp_path / "tables")]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "n too small: 3 comparisons need 7 instances (seeds) or more" in printed
    assert "*marked*" not in printed
    markdown = (tmp_path / "tables" / "comparison.md").read_text()
    assert "- n too small: 3 comparisons need 7 " in markdown


def test_two_runs_are_compared_label_by_label(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = run_of(tmp_path / "before", {"mine": 2.0, "old": 1.0})
    after = run_of(tmp_path / "after", {"mine": 30.0, "new": 1.0})
    command = ["compare", str(before), str(after), "--json"]
    assert execute([*command, "--measure", "success_auc"]) == 0
    found = json.loads(capsys.readouterr().out)
    (one,) = found["comparisons"]
    assert (one["first"], one["second"], one["n"]) == ("mine", "mine", 8)
    assert one["verdict"] == "worse" and one["difference"] < -0.5
    assert found["notices"] == []


def test_every_measure_is_a_column_of_scores() -> None:
    assert set(_MEASURES) <= set(RUN_TYPES)


def test_two_runs_without_a_pair_say_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = run_of(tmp_path / "before", {"mine": 2.0})
    after = run_of(tmp_path / "after", {"yours": 2.0})
    assert execute(["compare", str(before), str(after)]) == 2
    expected = "expected a tracker of the same label, scenario and seed in both runs"
    assert expected in capsys.readouterr().err


def test_films_that_differ_between_runs_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = run_of(tmp_path / "before", {"mine": 2.0})
    after = run_of(tmp_path / "after", {"mine": 2.0})
    scores = Scores.read(after)
    digests = scores.runs["digest"].str.replace("7", "8")
    Scores(scores.runs.assign(digest=digests), scores.frames).write(after)
    assert execute(["compare", str(before), str(after)]) == 0
    assert "1 of 8 films differ between the runs" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("shifts", "option", "message"),
    [
        ({"one": 2.0}, [], "expected two trackers or more, got none"),
        ({"a": 2.0, "b": 2.0}, ["--measure", "succes_50"], "mean 'success_50'?"),
        ({"a": 2.0, "b": 2.0}, ["--measure", "center_error_px"], "--measure: expected"),
    ],
)
def test_mistake_is_one_line(
    tmp_path: Path,
    shifts: dict[str, float],
    option: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    run = run_of(tmp_path / "run", shifts)
    assert execute(["compare", str(run), *option]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
