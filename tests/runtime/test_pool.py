"""Worker processes: every way a job can end, and that none of them costs another."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from simbench.runtime import pool as workers
from simbench.runtime.pool import Job, JobEvent, WorkerPool
from tests.runtime import misbehaving

ROOT = Path(__file__).parents[2]
PATIENT_S = 120.0


@pytest.fixture(autouse=True)
def _tests_importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))  # workers inherit the path


@pytest.fixture
def crew(tmp_path: Path) -> Iterator[WorkerPool]:
    with WorkerPool(2, {"SIMBENCH_TEST": "seen"}, tmp_path / "log") as crew:
        yield crew


def wait_until(is_so: Callable[[], bool]) -> None:
    """Wait for a condition that comes true by itself, on a busy machine too."""
    limit = time.monotonic() + PATIENT_S
    while not is_so():
        assert time.monotonic() < limit
        time.sleep(0.02)


def is_gone(told: Path) -> bool:
    """Whether the process that a file names has ended."""
    try:
        stat = Path(f"/proc/{told.read_text()}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return True
    return stat.rpartition(")")[2].split()[0] == "Z"


def job(function: Any, *arguments: Any, limit_s: float = 60.0, kind: str = "a") -> Job:
    return Job(function.__name__, kind, function, arguments, limit_s)


def outcome(crew: WorkerPool, *jobs: Job) -> list[JobEvent]:
    """Start jobs as there is room and return the event that ended each, by name."""
    waiting = list(jobs)
    ended: list[JobEvent] = []
    while waiting or not crew.is_idle:
        while waiting and crew.has_room:
            crew.start(waiting.pop(0))
        ended += [e for e in crew.events(within_s=0.2) if e.kind != "progress"]
    return sorted(ended, key=lambda event: str(event.job.name))


@pytest.mark.parametrize(
    ("work", "kind", "value"),
    [
        pytest.param(job(misbehaving.answer, 7), "done", 7, id="returns"),
        pytest.param(
            job(misbehaving.fail),
            "failed",
            "ValueError: this job cannot be done",
            id="raises",
        ),
        pytest.param(
            job(misbehaving.interrupt),
            "failed",
            "KeyboardInterrupt",
            id="raises what Ctrl-C raises",
        ),
        pytest.param(
            job(misbehaving.leave, 0),
            "died",
            "process ended with exit status 0",
            id="exits with status 0",
        ),
        pytest.param(
            job(misbehaving.leave, 3),
            "died",
            "process ended with exit status 3",
            id="exits with status 3",
        ),
        pytest.param(
            job(misbehaving.crash), "died", "process killed by SIGSEGV", id="crashes"
        ),
        pytest.param(
            job(misbehaving.hang, limit_s=0.3),
            "timeout",
            "timeout after 0.3 s",
            id="hangs",
        ),
    ],
)
def test_job_ends_with_one_event_that_says_how(
    crew: WorkerPool, work: Job, kind: str, value: object
) -> None:
    (event,) = outcome(crew, work)
    assert (event.kind, event.value) == (kind, value)


def test_job_whose_process_does_not_start_in_time_is_lost(
    crew: WorkerPool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers, "_START_LIMIT_S", 0.0)
    crew.start(job(misbehaving.answer, misbehaving.HangsWhenLoaded()))
    (event,) = crew.events(within_s=0.0)
    late = "its process did not start within 0 s"
    assert (event.kind, event.value) == ("lost", late)


def test_job_given_to_a_worker_that_is_dead_is_lost(crew: WorkerPool) -> None:
    (first,) = outcome(crew, job(misbehaving.process_id))
    os.kill(first.value, signal.SIGKILL)
    (event,) = outcome(crew, job(misbehaving.answer, 7))
    assert (event.kind, event.value) == ("lost", "process killed by SIGKILL")


def test_jobs_after_and_beside_a_crash_are_done(crew: WorkerPool) -> None:
    works = [
        job(misbehaving.crash),
        job(misbehaving.answer, 1),
        job(misbehaving.hang, limit_s=0.3),
        job(misbehaving.leave, 0),
        job(misbehaving.process_id),
    ]
    kinds = {event.job.name: event.kind for event in outcome(crew, *works)}
    assert kinds == {
        "answer": "done",
        "crash": "died",
        "hang": "timeout",
        "leave": "died",
        "process_id": "done",
    }


def test_worker_is_used_again_for_its_own_kind_only(crew: WorkerPool) -> None:
    ids = [
        outcome(crew, job(misbehaving.process_id, kind=kind))[0].value
        for kind in ("a", "a", "b", "a")
    ]
    assert ids[0] == ids[1] == ids[3] != ids[2]


def test_progress_is_reported(crew: WorkerPool) -> None:
    crew.start(job(misbehaving.answer, 7))
    events: list[JobEvent] = []
    while not crew.is_idle:
        events += crew.events(within_s=1.0)
    assert [(event.kind, event.value) for event in events] == [
        ("progress", 0.5),
        ("done", 7),
    ]


def test_environment_is_set_in_workers_only(
    crew: WorkerPool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SIMBENCH_TEST", raising=False)
    (event,) = outcome(crew, job(misbehaving.variable, "SIMBENCH_TEST"))
    assert event.value == "seen"


def test_workers_put_temporary_files_where_they_are_told(tmp_path: Path) -> None:
    with WorkerPool(1, {"TMPDIR": str(tmp_path)}, tmp_path / "log") as crew:
        (event,) = outcome(crew, job(misbehaving.temporary_folder))
    assert event.value == str(tmp_path)


def test_traceback_of_a_failed_job_is_in_the_log(
    crew: WorkerPool, tmp_path: Path
) -> None:
    outcome(crew, job(misbehaving.fail))
    assert "this job cannot be done" in (tmp_path / "log").read_text()


def test_log_that_cannot_be_written_loses_the_job_without_a_traceback(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "no folder" / "log"
    with WorkerPool(1, {}, log) as pool:
        (event,) = outcome(pool, job(misbehaving.answer, 7))
    assert event.kind == "lost"
    assert event.value == f"{log}: cannot be used: No such file or directory"
    assert capfd.readouterr().err == ""


def test_leaving_the_block_ends_a_worker_at_work(tmp_path: Path) -> None:
    told = tmp_path / "told"
    with WorkerPool(1, {}, tmp_path / "log") as crew:
        crew.start(job(misbehaving.tell_and_hang, told))
        wait_until(told.exists)
    wait_until(partial(is_gone, told))


def test_leaving_the_block_ends_idle_workers_and_loses_nothing_that_they_printed(
    tmp_path: Path,
) -> None:
    with WorkerPool(1, {}, tmp_path / "log") as crew:
        (event,) = outcome(crew, job(misbehaving.says, "no end of line"))
    assert (tmp_path / "log").read_text() == "no end of line"
    pid_file = tmp_path / "pid"
    pid_file.write_text(str(event.value))
    wait_until(lambda: is_gone(pid_file))


@pytest.mark.parametrize("renders", [True, False])
def test_workers_of_a_command_that_makes_films_have_imported_what_that_needs(
    renders: bool, tmp_path: Path
) -> None:
    program = f"""
import pathlib, sys
sys.path.insert(0, {str(ROOT)!r})
from simbench.runtime.forked_process import start_fork_server
from simbench.runtime.pool import WorkerPool
from tests.runtime import misbehaving
from tests.runtime.test_pool import job, outcome
start_fork_server(renders={renders})
with WorkerPool(1, {{}}, pathlib.Path({str(tmp_path / "log")!r})) as crew:
    for name in ("simbench.generation.generate", "pandas"):
        print(outcome(crew, job(misbehaving.has_imported, name))[0].value)
"""
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [str(renders), "True"]


def test_workers_die_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    told = tmp_path / "told"
    program = f"""
import os, pathlib, signal, sys
sys.path.insert(0, {str(ROOT)!r})
from simbench.runtime.pool import WorkerPool, Job
from tests.runtime import misbehaving
from tests.runtime.test_pool import wait_until
with WorkerPool(1, {{}}, pathlib.Path({str(tmp_path / "log")!r})) as crew:
    told = pathlib.Path({str(told)!r})
    crew.start(Job("x", "a", misbehaving.tell_and_hang, (told,), 3600.0))
    wait_until(told.exists)
    os.kill(os.getpid(), signal.SIGKILL)
"""
    done = subprocess.run([sys.executable, "-c", program], check=False)
    assert done.returncode == -9
    wait_until(partial(is_gone, told))
