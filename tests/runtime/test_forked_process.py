"""Workers are forked from a process that has imported what they need."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from simbench.runtime import forked_process
from simbench.runtime.forked_process import start_fork_server
from simbench.runtime.pool import Job, JobEvent, WorkerPool
from simbench.runtime.worker import ReportProgress


@pytest.fixture(autouse=True)
def _tests_importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))


def loaded(report: ReportProgress) -> set[str]:
    return set(sys.modules)


def parent(report: ReportProgress) -> int:
    return os.getppid()


def threads(report: ReportProgress) -> list[str]:
    tasks = Path("/proc/self/task").iterdir()
    return sorted((task / "comm").read_text().strip() for task in tasks)


def sleep(report: ReportProgress) -> None:
    time.sleep(3600)


def end_of(function: Callable[..., Any], tmp_path: Path) -> JobEvent:
    with WorkerPool(1, {}, tmp_path / "log") as pool:
        pool.start(Job("x", "a", function, (), 60.0))
        while True:
            for event in pool.events(1.0):
                if event.kind != "progress":
                    return event


def test_worker_starts_with_the_libraries_loaded(tmp_path: Path) -> None:
    modules = end_of(loaded, tmp_path).value
    assert {"numba", "pandas", "pyrender", "simbench.evaluation.scores"} <= modules


def test_worker_starts_without_threads_that_a_fork_would_lose(tmp_path: Path) -> None:
    others = end_of(threads, tmp_path).value
    others.remove(Path("/proc/self/comm").read_text().strip())
    assert set(others) <= {"jemalloc_bg_thd"}  # PyArrow's, prepared for forks


def test_one_server_forks_the_workers_of_all_pools(tmp_path: Path) -> None:
    assert end_of(parent, tmp_path).value == end_of(parent, tmp_path).value


def test_lost_server_costs_its_workers_only(tmp_path: Path) -> None:
    server = end_of(parent, tmp_path).value
    with WorkerPool(1, {}, tmp_path / "log") as pool:
        pool.start(Job("x", "a", sleep, (), 60.0))
        os.kill(server, signal.SIGKILL)
        ended = [event for event in pool.events(60.0) if event.kind != "progress"]
        while not ended:
            ended = [event for event in pool.events(60.0) if event.kind != "progress"]
    assert (ended[0].kind, ended[0].value) == ("lost", "process killed by SIGKILL")
    assert end_of(parent, tmp_path).value != server


def test_variables_that_libraries_read_at_import_start_another_server(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = end_of(parent, tmp_path).value
    monkeypatch.setenv("NUMBA_SIMBENCH_TEST", "1")
    assert end_of(parent, tmp_path).value != server


def test_forked_child_of_this_process_starts_its_own_server(tmp_path: Path) -> None:
    start_fork_server()
    child = os.fork()
    if not child:
        status = 1
        try:
            status = 3 if not forked_process._servers else 4
            status = 0 if status == 3 and end_of(loaded, tmp_path).value else status
        finally:
            forked_process._stop_all()
            os._exit(status)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
