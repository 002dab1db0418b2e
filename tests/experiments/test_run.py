"""A run from request to folder: a fault costs its own row, nothing is done twice."""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest
from pandas.testing import assert_frame_equal
from PIL import Image

from simbench.core.errors import DatasetError, SimbenchError
from simbench.evaluation.run_tracker import track_seed
from simbench.evaluation.scores import Scores
from simbench.experiments.experiment import Experiment
from simbench.experiments.frame_pictures import write_frame_pictures
from simbench.experiments.grid import finished_scores, run_request
from simbench.experiments.plan import SequenceTask, plan
from simbench.experiments.rebuild_report import rebuild_report
from simbench.experiments.request import Request
from simbench.experiments.run import RunResult, run_experiment
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tracker_codes import tracker_codes
from simbench.runtime import pool as workers
from simbench.runtime.forked_process import ForkedProcess, fork_worker
from simbench.runtime.opengl_renderer import opengl_renderer
from simbench.runtime.scratch import SCRATCH_MARK
from simbench.scenarios.files.loading import load_scenario
from simbench.trackers.find_tracker import find_tracker
from tests.blind_scenario import blind_smoke
from tests.runtime.test_pool import wait_until

ROOT = Path(__file__).parents[2]
pytestmark = [pytest.mark.sumo, pytest.mark.gl]


@pytest.fixture(scope="module", autouse=True)
def _tests_importable() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT))  # workers inherit the path
        yield


def asked(*trackers: str, timeout_s: float = 60.0, repetitions: int = 1) -> Request:
    module = "tests.runtime.misbehaving"
    found = tuple(find_tracker(f"{t.lower()}={module}:{t}") for t in trackers)
    smoke = load_scenario("smoke")
    return Request((smoke,), found, (4,), repetitions, timeout_s)


def planned(request: Request, folder: RunFolder) -> list[SequenceTask]:
    codes = tracker_codes(request.trackers, timeout_s=60.0)
    return plan(Experiment((request,)), folder.absolute(), codes, opengl_renderer())


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """A run folder in which one tracker ran, its sequence kept."""
    folder = RunFolder(tmp_path_factory.mktemp("filmed"))
    run_request(asked("Walk"), folder, keep_sequences=True)
    return folder


@pytest.fixture(scope="module")
def finished(
    filmed: RunFolder, tmp_path_factory: pytest.TempPathFactory
) -> tuple[RunFolder, RunResult]:
    """A run that came to its end, and what came out of it."""
    path = tmp_path_factory.mktemp("finished") / "run"
    with RunFolder(path).locked():  # so that it is ours
        shutil.copytree(filmed.sequences, path / "sequences")
    outcome = run_experiment(asked("Walk"), path, command="", keep_sequences=True)
    return RunFolder(path), outcome


@pytest.fixture
def folder(filmed: RunFolder, tmp_path: Path) -> RunFolder:
    """A fresh run folder with the sequence already filmed."""
    shutil.copytree(filmed.sequences, tmp_path / "run" / "sequences")
    return RunFolder(tmp_path / "run")


def test_each_fault_costs_its_own_row_and_nothing_else(folder: RunFolder) -> None:
    trackers = ("Walk", "Raise", "Nan", "Interrupt", "Leave", "Crash")
    scores, _ = run_request(asked(*trackers), folder, jobs=2)
    runs = scores.runs.set_index("tracker")
    assert runs.index.tolist() == [t.lower() for t in trackers]
    assert runs["status"].to_dict() == {
        "walk": "ok",
        "raise": "failed",
        "nan": "failed",
        "interrupt": "failed",
        "leave": "failed",
        "crash": "failed",
    }
    assert runs["reason"]["raise"] == "frame 3: exception: RuntimeError: lost it"
    assert runs["reason"]["nan"].startswith("frame 3: not-a-number: box must be finite")
    reason = "frame 1: exception: KeyboardInterrupt: as if typed"
    assert runs["reason"]["interrupt"] == reason
    ended = "frame 1: crash: process ended with exit status 0"
    assert runs["reason"]["leave"] == ended
    assert runs["reason"]["crash"] == "frame 1: crash: process killed by SIGSEGV"
    assert set(runs["frames"]) == {24}
    assert "RuntimeError: lost it" in folder.output("smoke", 4, "raise", 0).read_text()


def test_tracker_that_hangs_costs_its_own_row(folder: RunFolder) -> None:
    scores, _ = run_request(asked("Hang", timeout_s=5.0), folder)
    (run,) = scores.runs.to_dict("records")
    assert (run["status"], run["frames"]) == ("failed", 24)
    assert run["reason"] == "frame 1: timeout: the run took more than 5 s"
    printed = f"about to hang; temporary files: {folder.path / 'tmp'}\n"
    assert folder.output("smoke", 4, "hang", 0).read_text() == printed


def test_worker_that_never_starts_is_no_score_and_is_tried_again(
    folder: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fork_and_kill(pipe: Connection, *, at_once: bool) -> ForkedProcess:
        process = fork_worker(pipe, at_once=at_once)
        process.kill()
        return process

    with monkeypatch.context() as patch:
        patch.setattr(workers, "fork_worker", fork_and_kill)
        scores, _ = run_request(asked("Walk"), folder)
    (run,) = scores.runs.to_dict("records")
    assert run["status"] == "failed"
    assert run["reason"] == "process killed by SIGKILL"
    assert math.isnan(run["success_50"])  # nothing was measured
    assert not folder.parts.exists()
    again, _ = run_request(asked("Walk"), folder)
    assert again.runs["status"].tolist() == ["ok"]


def test_rows_come_in_the_order_of_the_request(folder: RunFolder) -> None:
    scores, _ = run_request(asked("Walk", "Nan", repetitions=2), folder, jobs=2)
    found = scores.runs[["tracker", "repetition"]].to_numpy().tolist()
    assert found == [["walk", 0], ["walk", 1], ["nan", 0], ["nan", 1]]


def test_track_depends_on_its_seed_and_not_on_the_workers(
    filmed: RunFolder, folder: RunFolder
) -> None:
    alone = run_request(asked("Walk"), filmed)[0]
    beside, _ = run_request(asked("Slow", "Nan", "Walk"), folder, jobs=2)
    lefts = beside.frames.loc[beside.frames["tracker"] == "walk", "left"]
    assert lefts.tolist() == alone.frames["left"].tolist()
    assert alone.runs["track_seed"].tolist() == [str(track_seed(4, "walk", 0))]


def test_repetitions_draw_differently(folder: RunFolder) -> None:
    scores, _ = run_request(asked("Walk", repetitions=2), folder)
    last = scores.frames.groupby("repetition")["left"].last()
    assert last[0] != last[1]


def test_what_is_done_is_not_done_again(folder: RunFolder) -> None:
    first, _ = run_request(asked("Walk"), folder)
    second, _ = run_request(asked("Walk", "Nan"), folder)
    was, now = first.runs.iloc[0], second.runs.iloc[0]
    assert (
        now["seconds_total"] == was["seconds_total"]
    )  # the time of another run differs


@pytest.mark.parametrize("name", ["scores.parquet", "frames.parquet"])
def test_part_that_cannot_be_read_is_done_again(folder: RunFolder, name: str) -> None:
    first, _ = run_request(asked("Walk"), folder)
    (part,) = folder.parts.iterdir()
    (part / name).write_bytes((part / name).read_bytes()[:100])
    second, _ = run_request(asked("Walk"), folder)
    assert second.frames["left"].tolist() == first.frames["left"].tolist()
    assert Scores.read(part).runs["status"].tolist() == ["ok"]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        pytest.param("scores.parquet", None, id="no scores"),
        pytest.param("frames.parquet", b"PAR1", id="cut frames"),
        pytest.param("report.html", None, id="no report", marks=pytest.mark.slow),
        pytest.param("report.html", b"<html>", id="cut report", marks=pytest.mark.slow),
    ],
)
def test_finished_run_is_made_whole_again_by_the_same_call(
    finished: tuple[RunFolder, RunResult],
    tmp_path: Path,
    name: str,
    content: bytes | None,
) -> None:
    request, (before, first) = asked("Walk"), finished
    folder = RunFolder(tmp_path / "run")
    shutil.copytree(before.path, folder.path)
    (part,) = folder.parts.iterdir()
    written = part.stat().st_mtime_ns
    (folder.path / name).unlink()
    if content is not None:
        (folder.path / name).write_bytes(content)
    second = run_experiment(request, folder.path, command="", keep_sequences=True)
    assert folder.is_finished(request.digest)
    assert part.stat().st_mtime_ns == written  # from parts
    assert second.scores.runs["fps"].tolist() == first.scores.runs["fps"].tolist()


def test_run_whose_facts_are_damaged_is_refused_until_it_is_to_be_replaced(
    copied: RunFolder,
) -> None:
    (copied.path / "run.json").write_bytes(b"{")
    with pytest.raises(DatasetError, match=r"not valid JSON.*or pass --replace"):
        run_experiment(asked("Walk"), copied.path, command="")
    assert Scores.read(copied.path).runs["tracker"].tolist() == ["walk"]
    run_experiment(asked("Walk"), copied.path, command="", replace=True)
    assert copied.is_finished(asked("Walk").digest)


@pytest.fixture
def copied(finished: tuple[RunFolder, RunResult], tmp_path: Path) -> RunFolder:
    """A run of its own that came to its end, its sequence kept."""
    shutil.copytree(finished[0].path, tmp_path / "copied")
    return RunFolder(tmp_path / "copied")


def test_run_without_its_pictures_is_finished_only_where_they_are_not_asked_for(
    copied: RunFolder,
) -> None:
    tasks = planned(asked("Walk"), copied)
    assert finished_scores(tasks, with_sequences=True) is not None
    shutil.rmtree(copied.sequences)
    assert finished_scores(tasks) is not None
    assert finished_scores(tasks, with_sequences=True) is None


def test_pictures_that_were_kept_stay_when_a_later_call_does_not_ask_for_them(
    copied: RunFolder,
) -> None:
    kept = list(copied.sequences.iterdir())
    copied.report.unlink()
    run_experiment(asked("Walk"), copied.path, command="")
    assert copied.report.exists()
    assert list(copied.sequences.iterdir()) == kept
    assert copied.keeps_sequences


def test_only_folders_of_sequences_are_removed(copied: RunFolder) -> None:
    (copied.sequences / "notes.txt").write_text("mine")
    copied.remove_sequences()
    assert [path.name for path in copied.sequences.iterdir()] == ["notes.txt"]


def test_temporary_files_of_a_killed_run_are_removed(folder: RunFolder) -> None:
    left_over = folder.path / "tmp" / "simbench-traffic-x" / "road.net.xml"
    left_over.parent.mkdir(parents=True)
    left_over.touch()
    (folder.path / "tmp" / SCRATCH_MARK).touch()  # so that it is ours
    with folder.scratch() as temporary:
        assert temporary.is_absolute()
        assert [path.name for path in temporary.iterdir()] == [SCRATCH_MARK]
        (temporary / "new").touch()
    assert not (folder.path / "tmp").exists()


def test_sequences_other_than_the_first_are_removed(
    filmed: RunFolder, folder: RunFolder
) -> None:
    (name,) = [path.name for path in filmed.sequences.iterdir()]
    _, sequences = run_request(asked("Walk"), folder)
    assert [path.name for path in folder.sequences.iterdir()] == [name]
    (sequence,) = sequences
    assert sequence.seed == 4
    assert sequence.frames[23].index == 23


def test_report_again_shows_the_sequences_that_were_kept(
    finished: tuple[RunFolder, RunResult], tmp_path: Path
) -> None:
    folder = RunFolder(tmp_path / "run")
    shutil.copytree(finished[0].path, folder.path)
    folder.report.unlink()
    reported: list[float] = []
    rebuild_report(folder.path, lambda done, of, doing: reported.append(done))
    assert folder.report.exists()
    assert reported == []  # nothing was filmed


def test_scenario_that_cannot_be_filmed_costs_its_rows(tmp_path: Path) -> None:
    walk = (find_tracker("walk=tests.runtime.misbehaving:Walk"),)
    request = Request((blind_smoke(),), walk, (4,))
    folder = RunFolder(tmp_path)
    scores, sequences = run_request(request, folder)
    assert sequences == []
    assert scores.runs["status"].tolist() == ["failed"]
    assert scores.runs["success_50"].isna().all()  # nothing was measured
    assert scores.runs["reason"][0].startswith("no sequence: blind: ")
    assert not folder.parts.exists()  # so it is tried again


def test_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(DatasetError, match="found other files"):
        RunFolder(tmp_path).locked().__enter__()


def test_folder_of_a_run_under_way_is_refused(tmp_path: Path) -> None:
    with RunFolder(tmp_path).locked():
        with pytest.raises(DatasetError, match="another run is writing here"):
            RunFolder(tmp_path).locked().__enter__()
    with RunFolder(tmp_path).locked():
        pass


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(None, "not a run folder", id="none"),
        pytest.param("{", "not valid JSON", id="broken"),
        pytest.param("[]", "found another", id="something else"),
    ],
)
def test_broken_run_json_is_refused(
    tmp_path: Path, text: str | None, message: str
) -> None:
    if text is not None:
        (tmp_path / "run.json").write_text(text)
    with pytest.raises(DatasetError, match=message):
        RunFolder(tmp_path).read_facts()


def simbench(*arguments: str, cwd: Path) -> subprocess.Popen[str]:
    """Start the command line in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "simbench", *arguments],
        cwd=cwd,
        env=os.environ | {"PYTHONPATH": str(ROOT), "SIMBENCH_TEST_GO": str(cwd / "go")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def members(group: int) -> list[str]:
    """Return the living processes of a process group."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(fields[2]) == group and fields[0] != "Z":
            found.append(stat.parent.name)
    return found


def test_interrupted_run_stops_cleanly_and_goes_on(
    filmed: RunFolder, tmp_path: Path
) -> None:
    command = (
        "run smoke --seeds 4 --jobs 1 --out out --trackers "
        "walk=tests.runtime.misbehaving:Walk,waits=tests.runtime.misbehaving:Waits"
    ).split()
    parts = tmp_path / "out" / "parts"
    first = simbench(*command, cwd=tmp_path)

    def is_a_part_done() -> bool:
        assert first.poll() is None, first.stderr.read() if first.stderr else ""
        return parts.exists() and any(parts.glob("[!.]*"))

    wait_until(is_a_part_done)
    os.killpg(first.pid, signal.SIGINT)  # as a terminal does: to the workers too
    _, said = first.communicate(timeout=120)
    assert first.returncode == 130
    assert said == "simbench: stopped; the same command resumes it\n"
    # the last to go is Python's own tracker of shared resources: after its parent
    wait_until(lambda: not members(first.pid))
    (done,) = parts.iterdir()
    written = (done / "scores.parquet").stat().st_mtime_ns
    assert not (tmp_path / "out" / "scores.parquet").exists()

    (tmp_path / "go").touch()
    second = simbench(*command, cwd=tmp_path)
    printed, said = second.communicate(timeout=120)
    assert (second.returncode, said) == (0, "")
    assert "report: out/report.html" in printed
    assert (done / "scores.parquet").stat().st_mtime_ns == written
    assert Scores.read(tmp_path / "out").runs["status"].tolist() == ["ok", "ok"]
    facts = json.loads((tmp_path / "out" / "run.json").read_text())
    assert facts["finished"]
    assert facts["seeds"] == [4]
    assert facts["trackers"][1] == {
        "label": "waits",
        "spec": "waits=tests.runtime.misbehaving:Waits",
    }
    assert facts["versions"]["opengl"]
    assert not (tmp_path / "out" / "sequences").exists()


def test_other_rules_score_the_same_tracks_again(copied: RunFolder) -> None:
    parts = {path: path.stat().st_mtime_ns for path in copied.parts.iterdir()}
    before = Scores.read(copied.path)
    found = run_experiment(asked("Walk"), copied.path, command="", rules="otb").scores
    assert found.runs["rules"].tolist() == ["otb"]
    assert found.runs["frames_scored"].tolist() == [24]
    assert_frame_equal(Scores.read(copied.path).runs, found.runs)
    assert "Rules of <b>otb</b>" in copied.report.read_text(encoding="utf-8")
    run_experiment(asked("Walk"), copied.path, command="")
    assert_frame_equal(Scores.read(copied.path).runs, before.runs)
    assert_frame_equal(Scores.read(copied.path).frames, before.frames)
    after = {path: path.stat().st_mtime_ns for path in copied.parts.iterdir()}
    assert after == parts  # no tracker ran


def test_unknown_rules_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(SimbenchError, match=r"rules: .*did you mean 'got10k'"):
        run_experiment(asked("Walk"), tmp_path / "run", command="", rules="got10")
    assert not (tmp_path / "run").exists()


def test_frames_are_drawn_with_estimate_and_truth(
    copied: RunFolder, tmp_path: Path
) -> None:
    frames = Scores.read(copied.path).frames
    chosen = frames[frames["frame"].isin([2, 5])]
    paths = write_frame_pictures(copied.path, chosen, tmp_path, lambda *_: None)
    assert [path.name for path in paths] == [
        "smoke-0004-walk-0-000002.png",
        "smoke-0004-walk-0-000005.png",
    ]
    drawn = np.array(Image.open(paths[0]))
    assert drawn.shape == (480, 640, 3)  # enlarged fourfold
    row = chosen.iloc[0]
    for prefix, colour in (("truth_", (255, 255, 255)), ("", (230, 60, 40))):
        left, top = round(4 * row[f"{prefix}left"]), round(4 * row[f"{prefix}top"])
        middle = top + round(2 * row[f"{prefix}height"])
        assert tuple(drawn[middle, left].tolist()) == colour


@pytest.mark.parametrize(
    ("protocol", "starts"),
    [
        pytest.param("tre", [0, 1, 2, 3, 4], id="tre"),
        pytest.param("multistart", [0, 23], id="multistart"),
        pytest.param("sre", [0] * 12, id="sre"),
    ],
)
def test_protocol_starts_the_tracker_again_and_again(
    folder: RunFolder, protocol: str, starts: list[int]
) -> None:
    request = replace(asked("Walk"), protocol=protocol)
    scores, _ = run_request(request, folder)
    assert scores.runs["start_frame"].tolist() == starts
    assert scores.runs["repetition"].tolist() == list(range(len(starts)))
    assert set(scores.runs["status"]) == {"ok"}
    assert scores.runs["frames"].sum() == len(scores.frames)
    assert scores.runs["track_seed"].nunique() == len(starts)


def test_tracker_that_fails_is_restarted_and_a_second_call_finds_it(
    folder: RunFolder,
) -> None:
    request = replace(asked("Raise"), protocol="restart")
    scores, _ = run_request(request, folder)
    # it raises in its third update, and is started again five frames later
    assert scores.runs["start_frame"].tolist() == [0, 8, 16]
    assert set(scores.runs["failure_kind"]) == {"raised"}
    parts = {path: path.stat().st_mtime_ns for path in folder.parts.iterdir()}
    again, _ = run_request(request, folder)
    assert_frame_equal(again.runs, scores.runs)
    assert {p: p.stat().st_mtime_ns for p in folder.parts.iterdir()} == parts


def test_folder_holds_one_protocol(copied: RunFolder) -> None:
    request = replace(asked("Walk"), protocol="tre")
    with pytest.raises(DatasetError, match="by the protocol ope, got tre"):
        run_experiment(request, copied.path, command="")
