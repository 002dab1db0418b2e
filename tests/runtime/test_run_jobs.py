"""Running jobs to the end: order, progress, and jobs that make others possible."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from simbench.runtime.pool import Job, JobEvent, WorkerPool
from simbench.runtime.run_jobs import run_jobs
from tests.runtime import misbehaving
from tests.runtime.test_pool import ROOT, job


@pytest.fixture(autouse=True)
def _tests_importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))  # workers inherit the path


def test_job_that_becomes_possible_by_the_end_of_another_is_run(
    tmp_path: Path,
) -> None:
    waiting = [job(misbehaving.answer, 1)]
    ended: list[JobEvent] = []

    def next_job() -> Job | None:
        return waiting.pop() if waiting else None

    def finish(event: JobEvent) -> None:
        ended.append(event)
        if event.value == 1:
            waiting.append(job(misbehaving.answer, 2))

    with WorkerPool(2, {}, tmp_path / "log") as pool:
        run_jobs(pool, next_job, finish)
    assert [(event.kind, event.value) for event in ended] == [("done", 1), ("done", 2)]


def test_failed_job_ends_and_progress_names_the_running_ones(tmp_path: Path) -> None:
    waiting = [job(misbehaving.answer, 1), job(misbehaving.fail)]
    ended: dict[str, str] = {}
    seen: set[Any] = set()

    def next_job() -> Job | None:
        return waiting.pop() if waiting else None

    def finish(event: JobEvent) -> None:
        ended[event.job.name] = event.kind

    def report(running: Mapping[Any, float]) -> None:
        seen.update(running)
        assert all(0.0 <= share <= 1.0 for share in running.values())

    with WorkerPool(1, {}, tmp_path / "log") as pool:
        run_jobs(pool, next_job, finish, report)
    assert ended == {"answer": "done", "fail": "failed"}
    assert seen == {"answer", "fail"}


def test_nothing_to_do_starts_no_worker(tmp_path: Path) -> None:
    with WorkerPool(1, {}, tmp_path / "log") as pool:
        run_jobs(pool, lambda: None, lambda event: None)
    assert not (tmp_path / "log").exists()
