"""A run folder as an experiment that grows: rows are added, never mixed or lost."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import simbench.experiments.run as run_module
import simbench.runtime.code_digest as code_digest_module
import simbench.trackers.weights.encoder as encoder_weights
from simbench.core.errors import DatasetError, TrackerError
from simbench.evaluation.scores import Scores
from simbench.experiments.rebuild_report import rebuild_report
from simbench.experiments.request import Request
from simbench.experiments.run import RunResult, run_experiment
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tasks import generate_sequence
from simbench.experiments.tracker_codes import tracker_codes
from simbench.runtime.code_digest import code_digest
from simbench.runtime.versions import versions
from simbench.scenarios.files.loading import load_scenario
from simbench.trackers.find_tracker import find_tracker
from simbench.trackers.parts.weights_file import pack_weights, read_weights

ROOT = Path(__file__).parents[2]
pytestmark = [pytest.mark.sumo, pytest.mark.gl]


@pytest.fixture(scope="module", autouse=True)
def _tests_importable() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT))  # workers inherit the path
        yield


def request(*trackers: str, seeds: tuple[int, ...] = (4,), frames: int = 6) -> Request:
    smoke = load_scenario("smoke").shortened(frames)
    return Request((smoke,), tuple(map(find_tracker, trackers)), seeds)


def run(asked: Request, path: Path, jobs: int = 0, **options: object) -> RunResult:
    """Run in this process, which is quick, unless told otherwise."""
    typed = f"run {[tracker.label for tracker in asked.trackers]} {asked.seeds}"
    return run_experiment(asked, path, command=typed, jobs=jobs, **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of one tracker, its sequences kept."""
    path = tmp_path_factory.mktemp("first") / "run"
    run(request("still"), path, keep_sequences=True)
    return path


@pytest.fixture
def there(first: Path, tmp_path: Path) -> Path:
    shutil.copytree(first, tmp_path / "run")
    return tmp_path / "run"


def test_other_trackers_and_seeds_add_rows(there: Path) -> None:
    before = Scores.read(there)
    found = run(request("walk=tests.runtime.misbehaving:Walk"), there).scores
    assert found.runs["tracker"].tolist() == ["still", "walk"]
    assert found.runs["fps"][0] == before.runs["fps"][0]  # it did not run again
    found = run(request("still", seeds=(5,)), there).scores
    rows = found.runs[["seed", "tracker"]].to_numpy().tolist()
    assert rows == [[4, "still"], [4, "walk"], [5, "still"]]
    page = (there / "report.html").read_text()
    assert "walk" in page
    facts = json.loads((there / "run.json").read_text())
    assert facts["seeds"] == [4, 5]
    assert facts["command"].splitlines() == [
        "run ['still'] (4,)",
        "run ['walk'] (4,)",
        "run ['still'] (5,)",
    ]
    assert [one["label"] for one in facts["trackers"]] == ["still", "walk"]
    (there / "report.html").unlink()
    rebuild_report(there, lambda done, of, doing: None)
    assert "walk" in (there / "report.html").read_text()


def test_earlier_command_again_changes_nothing(there: Path) -> None:
    run(request("walk=tests.runtime.misbehaving:Walk"), there)
    written = (there / "scores.parquet").stat().st_mtime_ns
    found = run(request("still"), there).scores
    assert found.runs["tracker"].tolist() == ["still", "walk"]
    assert (there / "scores.parquet").stat().st_mtime_ns == written


@pytest.mark.parametrize(
    ("other", "message"),
    [
        pytest.param(
            request("still=tests.runtime.misbehaving:Walk"),
            r"tracker still is still in the runs that are there, got still=tests",
            id="tracker",
        ),
        pytest.param(
            request("still", frames=8),
            "scenario smoke has other contents or frames",
            id="scenario",
        ),
    ],
)
def test_name_that_stands_for_something_else_is_refused_or_replaced(
    there: Path, other: Request, message: str
) -> None:
    before = {p: p.stat().st_mtime_ns for p in there.rglob("*") if p.name != ".lock"}
    with pytest.raises(DatasetError, match=f"{message}.*or pass --replace"):
        run(other, there)
    after = {p: p.stat().st_mtime_ns for p in there.rglob("*") if p.name != ".lock"}
    assert after == before
    found = run(other, there, replace=True).scores
    assert found.runs["tracker"].tolist() == ["still"]
    assert found.frames["frame"].max() == other.scenarios[0].frames - 1
    assert found.runs["status"].tolist() == ["ok"]


def test_replacing_runs_again_what_is_named_and_keeps_the_rest(there: Path) -> None:
    walk = request("walk=tests.runtime.misbehaving:Walk")
    before = run(walk, there).scores.runs["fps"]
    after = run(walk, there, replace=True).scores.runs["fps"]
    assert after[0] == before[0]
    assert after[1] != before[1]


def test_another_environment_is_named_and_its_results_are_made_again(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    newer = versions() | {"numpy": "99.0"}
    said: list[str] = []
    before = Scores.read(there)
    with monkeypatch.context() as patch:
        for module in (run_module, code_digest_module):
            patch.setattr(module, "versions", lambda: newer)
        code_digest.cache_clear()
        found = run(request("still"), there, notice=said.append).scores
    code_digest.cache_clear()
    assert found.runs["fps"][0] != before.runs["fps"][0]
    (line,) = said
    assert "results are made again" in line
    assert line.endswith("-> 99.0")


def test_frames_of_another_renderer_are_refused(tmp_path: Path) -> None:
    smoke = load_scenario("smoke").shortened(2)
    end = generate_sequence(smoke, 0, tmp_path / "a", "a GPU", lambda done, of: None)
    assert end is not None
    status, reason = end
    assert status == "failed"
    assert reason.startswith("expected a GPU to render, got ")


@pytest.mark.parametrize("name", ["run.json", ".lock"])
def test_foreign_folder_is_refused_untouched(tmp_path: Path, name: str) -> None:
    content = {
        name: '{"scenarios": []}',
        "report.html": "mine",
        "tmp/notes": "mine",
        "parts/notes": "mine",
        "sequences/notes": "mine",
    }
    for place, text in content.items():
        (tmp_path / place).parent.mkdir(exist_ok=True)
        (tmp_path / place).write_text(text)
    for replace in (False, True):
        with pytest.raises(DatasetError, match="expected a new, empty or run folder"):
            run(request("still"), tmp_path, replace=replace)
    for place, text in content.items():
        assert (tmp_path / place).read_text() == text


def test_file_in_the_place_of_a_run_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("mine")
    with pytest.raises(DatasetError, match="run: expected a folder for a run: found"):
        run(request("still"), tmp_path / "run")


def test_folder_of_a_run_killed_at_once_can_be_used(tmp_path: Path) -> None:
    (tmp_path / ".lock").touch()
    RunFolder(tmp_path).refuse_foreign()


def test_log_of_the_workers_is_bounded(tmp_path: Path) -> None:
    with RunFolder(tmp_path).locked():
        (tmp_path / "workers.log").write_text("a line\n" * 400_000)
    with RunFolder(tmp_path).locked():
        assert (tmp_path / "workers.log").stat().st_size <= 10**6


def test_tracker_cannot_raise_scores_by_patching_numpy(tmp_path: Path) -> None:
    cheat = request("one=tests.attack.bad_trackers:PatchesNumpy", "still")
    honest = request("one=tests.attack.bad_trackers:Walk", "still")
    found = run(cheat, tmp_path / "cheat", jobs=1).scores.runs
    expected = run(honest, tmp_path / "honest").scores.runs
    for measure in ("precision_20", "success_50", "center_error_px"):
        assert found[measure].tolist() == expected[measure].tolist()


def test_tracker_killed_from_outside_runs_again(tmp_path: Path) -> None:
    killed = "once=tests.experiments.test_growing_run:KilledOnce"
    KilledOnce.mark(tmp_path)
    found = run(request(f"{killed}@mark='{tmp_path / 'mark'}'"), tmp_path / "run", 1)
    assert found.scores.runs["status"].tolist() == ["ok"]


def test_tracker_always_killed_from_outside_is_not_stored(tmp_path: Path) -> None:
    killed = request("killed=tests.attack.bad_trackers:Killed")
    found = run(killed, tmp_path / "run", jobs=1)
    (row,) = found.scores.runs.to_dict("records")
    assert (row["status"], row["reason"]) == ("failed", "process killed by SIGKILL")
    assert not (tmp_path / "run" / "parts").exists()


class KilledOnce:
    """Is killed in its first run, as on a machine without memory left."""

    def __init__(self, mark: str = "") -> None:
        self.path = Path(mark)

    @staticmethod
    def mark(folder: Path) -> None:
        (folder / "mark").write_text("not yet")

    def init(self, frame: object, box: object, rng: object) -> None:
        self.box = box

    def update(self, frame: object) -> object:
        import os
        import signal

        from simbench.core.tracker import Estimate

        if self.path.read_text() == "not yet":
            self.path.write_text("killed")
            os.kill(os.getpid(), signal.SIGKILL)
        return Estimate(self.box)  # type: ignore[arg-type]


def test_data_files_of_a_tracker_enter_its_key(tmp_path: Path) -> None:
    weights = tmp_path / "weights.bin"
    weights.write_bytes(b"1")
    spec = f"tests.experiments.test_growing_run:ReadsFile@path='{weights}'"

    def code() -> str:
        (found,) = tracker_codes([find_tracker(spec)], timeout_s=60.0).values()
        return found

    before = code()
    assert code() == before
    weights.write_bytes(b"2")
    assert code() != before


def test_weights_that_a_built_in_tracker_is_given_enter_its_key(
    tmp_path: Path,
) -> None:
    shipped = Path(encoder_weights.__file__).parent
    for name in ("weights.npz", "weights.json"):
        shutil.copy(shipped / name, tmp_path)

    def code(spec: str) -> str:
        (found,) = tracker_codes([find_tracker(spec)], timeout_s=60.0).values()
        return found

    given = f"dlt@weights='{tmp_path / 'weights.npz'}'"
    codes = {code("dlt"), code(given)}
    retrained = pack_weights(
        read_weights(shipped / "weights.npz") | {"more": np.ones(1)}
    )
    (tmp_path / "weights.npz").write_bytes(retrained)
    digest = {"sha256": hashlib.sha256(retrained).hexdigest()}
    (tmp_path / "weights.json").write_text(json.dumps(digest))
    codes.add(code(given))
    assert len(codes) == 3


class ReadsFile:
    """Reads a file when it is constructed."""

    def __init__(self, path: str = "") -> None:
        self.weights = Path(path).read_bytes()

    def init(self, frame: object, box: object, rng: object) -> None: ...

    def update(self, frame: object) -> object: ...


def test_constructor_that_raises_is_refused_before_anything_is_made(
    tmp_path: Path,
) -> None:
    raising = request("tests.attack.bad_trackers:ConstructRaise")
    with pytest.raises(TrackerError, match="not made: ValueError: odd"):
        run(raising, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_all_in_this_process_gives_the_same_scores(
    there: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    several = request(
        "walk=tests.runtime.misbehaving:Walk", "raise=tests.runtime.misbehaving:Raise"
    )
    here = run(several, there, jobs=0).scores
    assert "RuntimeError: lost it" in capsys.readouterr().err
    apart = run(several, there, jobs=1, replace=True).scores
    columns = ["left", "top", "width", "height", "particles"]
    assert here.frames[columns].equals(apart.frames[columns])
    assert here.runs["reason"].tolist() == apart.runs["reason"].tolist()


def test_trackers_of_earlier_requests_stay_in_this_process_too(
    there: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(request("walk=tests.runtime.misbehaving:Walk"), there, jobs=0)

    def started(*_: object) -> None:
        raise AssertionError("another process was started")

    monkeypatch.setattr("simbench.experiments.tracker_codes.run_all", started)
    run(request("raise=tests.runtime.misbehaving:Raise"), there, jobs=0)
