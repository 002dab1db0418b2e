"""Sweeps, and runs of variants, as a user calls them."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from simbench.cli import execute
from simbench.evaluation.scores import Scores
from simbench.experiments.run import RunResult
from simbench.experiments.run_folder import RunFolder
from simbench.scenarios.files.loading import read_raw_scenario
from tests.report.synthetic_sweep import one_dial, synthetic_sweep


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        pytest.param(
            ["--vary", "noise=0:1"], "expected DIAL=FIRST:LAST:STEP", id="form"
        ),
        pytest.param(["--vary", "colour=0,1"], "got 'colour'", id="no dial"),
        pytest.param(["--vary", "noise=0,7"], "dials.noise", id="out of range"),
        pytest.param(["--vary", "noise=0:1:0"], "step above 0", id="step of zero"),
        pytest.param(
            ["--vary", "noise=0,1"] * 2,
            "expected different dials, got noise twice",
            id="one dial twice",
        ),
        pytest.param(
            ["--vary", "noise=0,0.1", "--seeds", "1:1"], "seeds must be", id="no seeds"
        ),
        pytest.param([], "Missing option '--vary'", id="nothing to vary"),
    ],
)
def test_mistake_is_one_line_and_exit_status_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["sweep", "smoke", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert list(Path().iterdir()) == []


@pytest.mark.sumo
@pytest.mark.gl
def test_sweep_leaves_tables_and_a_report_says_what_it_missed_and_is_not_done_twice(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = (
        "sweep smoke --vary target_px=15,5000 --trackers still --seeds 0 --frames 3 "
        "--out out --jobs 1"
    ).split()
    assert execute(command) == 0
    first = capsys.readouterr().out
    assert "breaking point of target_px" in first
    assert "target_px=5000: not reachable: smoke: " in " ".join(first.split())
    runs = Scores.read(Path("out")).runs
    assert runs["variant"].tolist() == ["target_px=15", "target_px=5000"]
    assert runs["status"].tolist() == ["ok", "unreachable"]
    assert runs["achieved.target_px"][0] == pytest.approx(15.0, rel=0.1)
    assert len(pd.read_parquet("out/sweep.parquet")) == 2
    assert len(pd.read_parquet("out/breaking_points.parquet")) == 1
    facts = json.loads(Path("out/run.json").read_text())
    assert facts["sweep"]["axes"] == [{"dial": "target_px", "values": [15.0, 5000.0]}]

    written = Path("out/report.html").stat().st_mtime_ns
    assert execute(command) == 0
    again = capsys.readouterr().out
    assert "breaking point of target_px" in again
    assert first.endswith(again)  # before that it says how far it is, if it is slow
    assert Path("out/report.html").stat().st_mtime_ns == written

    before = Path("out/report.html").read_text()
    assert execute(["report", "out"]) == 0  # films again what can be filmed
    assert Path("out/report.html").read_text() == before

    # a value that is known to be out of reach is not tried again
    (unreached,) = (
        part
        for part in Path("out/parts").iterdir()
        if Scores.read(part).runs["status"].tolist() == ["unreachable"]
    )
    written = (unreached / "scores.parquet").stat().st_mtime_ns
    Path("out/scores.parquet").unlink()
    assert execute(command) == 0
    assert Scores.read(Path("out")).runs["status"].tolist() == ["ok", "unreachable"]
    assert (unreached / "scores.parquet").stat().st_mtime_ns == written


@pytest.mark.parametrize(
    ("status", "failures"),
    [
        pytest.param(["ok", "unreachable"], 0, id="a value that is not reached"),
        pytest.param(["ok", "failed"], 1, id="a failure"),
        pytest.param(["unreachable"] * 2, 2, id="nothing is reached"),
    ],
)
def test_sweep_fails_by_failures_or_where_nothing_is_reached(
    status: list[str], failures: int
) -> None:
    scores, _, _, swept = synthetic_sweep(one_dial())
    runs = scores.runs.iloc[:2].assign(status=status)
    outcome = RunResult(Scores(runs, scores.frames), RunFolder(Path("run")), swept)
    assert len(outcome.failures) == failures
    assert all("poles@occlusion.hidden=0, seed 0" in one for one in outcome.failures)


@pytest.mark.sumo
@pytest.mark.gl
def test_run_shows_variants_of_one_scenario_apart(
    capsys: pytest.CaptureFixture[str],
) -> None:
    story = read_raw_scenario("smoke") | {
        "frames": 3,
        "occluders": [],
        "variants": {"clear": {}, "grainy": {"imaging.noise": 0.3}},
    }
    Path("own.yaml").write_text(json.dumps(story))  # which YAML is too
    wanted = (
        "run own.yaml@clear own.yaml@grainy --trackers still --seeds 0 --out out -j 1"
    )
    assert execute(wanted.split()) == 0
    said = capsys.readouterr().out
    assert "smoke@clear" in said
    assert "smoke@grainy" in said
    page = Path("out/report.html").read_text()
    assert 'id="scenario-smoke-clear"' in page
    assert 'id="scenario-smoke-grainy"' in page
    assert page.count("data-player>") == 2
