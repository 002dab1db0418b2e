"""A real Dask cluster, a scheduler and two worker processes on the loopback device."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from distributed import Client

from simbench.core.errors import SimbenchError
from simbench.experiments.request import Request
from simbench.experiments.run import run_experiment
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, spread
from simbench.runtime import cluster as clusters
from simbench.runtime.cluster import Cluster, ClusterError
from simbench.runtime.pool import Job, JobEvent
from simbench.trackers.find_tracker import find_tracker
from tests.generation.dataset.small_recipe import small_recipe
from tests.generation.dataset.test_produce import content
from tests.runtime import cluster_jobs, misbehaving
from tests.runtime.test_pool import is_gone, wait_until

ROOT = Path(__file__).parents[2]
LIMIT_S = 120.0


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("dask")
    facts = folder / "scheduler.json"
    here = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(facts)]
    dask = [sys.executable, "-m", "dask"]
    commands = [
        [*dask, "scheduler", "--port", "0", *here],
        [*dask, "worker", "--nworkers", "2", "--nthreads", "1", *here],
    ]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}  # for the jobs of tests
    with (folder / "log").open("w") as log:
        processes = [
            subprocess.Popen(
                command, cwd=folder, env=environment, stdout=log, stderr=log
            )
            for command in commands
        ]
    with pytest.MonkeyPatch.context() as patch:  # a busy machine answers late
        patch.setattr(clusters, "_CONNECT_S", LIMIT_S)
        address = address_in(facts)
        with Client(address, timeout=LIMIT_S, set_as_default=False) as client:
            client.wait_for_workers(2, LIMIT_S)
        yield address
    for process in reversed(processes):
        process.terminate()
        process.wait(LIMIT_S)


def address_in(facts: Path) -> str:
    """Wait until a scheduler has written its address."""

    def address() -> str:
        try:
            return str(json.loads(facts.read_text())["address"])
        except (OSError, ValueError):  # not there, or half written
            return ""

    wait_until(lambda: bool(address()))
    return address()


def job(function: Any, *arguments: Any, limit_s: float = 60.0) -> Job:
    return Job(function.__name__, "a", function, arguments, limit_s)


def outcome(crew: Cluster, *jobs: Job) -> dict[str, tuple[str, Any]]:
    """Start jobs as there is room and return how each ended, by name."""
    waiting = list(jobs)
    ended: list[JobEvent] = []
    while waiting or not crew.is_idle:
        while waiting and crew.has_room:
            crew.start(waiting.pop(0))
        ended += crew.events(within_s=0.2)
    return {event.job.name: (event.kind, event.value) for event in ended}


def test_jobs_end_on_a_cluster_as_they_do_here(address: str) -> None:
    with Cluster(address) as crew:
        assert outcome(
            crew,
            job(misbehaving.answer, 7),
            job(misbehaving.fail),
            job(misbehaving.crash),
            job(misbehaving.hang, limit_s=0.3),
        ) == {
            "answer": ("done", 7),
            "fail": ("failed", "ValueError: this job cannot be done"),
            "crash": ("died", "process killed by SIGSEGV"),
            "hang": ("timeout", "timeout after 0.3 s"),
        }


@pytest.mark.gl
@pytest.mark.sumo
def test_cluster_makes_the_same_bytes_as_this_machine(
    address: str, tmp_path: Path
) -> None:
    wanted = DatasetRequest(spread([small_recipe()], 2), "got10k")
    url = f"dir://cluster::file://{tmp_path}"
    for place, cluster in (
        (str(tmp_path / "here"), ""),
        (url, address),  # each worker brings its own
    ):
        outcome = produce_dataset(wanted, place, command="x", cluster=cluster)
        assert outcome.made == 2
    assert content(tmp_path / "cluster") == {
        path: text.replace(str(tmp_path / "here").encode(), url.encode())
        for path, text in content(tmp_path / "here").items()
    }


@pytest.mark.gl
@pytest.mark.sumo
@pytest.mark.slow
def test_cluster_runs_trackers_to_the_same_scores_as_this_machine(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # the workers are elsewhere
    scenario = small_recipe(frames=4).scenario(0)
    request = Request((scenario,), (find_tracker("still"),), (0,))
    here = run_experiment(request, Path("here"), command="x")
    there = run_experiment(request, Path("there"), command="x", cluster=address)
    assert not there.failures
    names = map(str, here.scores.runs.columns)
    timed = [name for name in names if "fps" in name or "second" in name]
    first, second = (
        one.scores.runs.drop(columns=timed).to_dict("records") for one in (here, there)
    )
    assert repr(first) == repr(second)


def test_folder_that_workers_do_not_see_is_one_line(
    address: str, tmp_path: Path
) -> None:
    with pytest.raises(ClusterError, match=r"worker tcp://.*: does not see .*nowhere"):
        with Cluster(address, tmp_path / "nowhere"):
            pass


def test_workers_of_another_version_are_one_line(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "versions", lambda: {"numpy": "99.0"})
    with pytest.raises(
        ClusterError, match=r"worker tcp://.*numpy is \d.*, here 99\.0$"
    ):
        with Cluster(address):
            pass


def test_worker_of_another_version_that_joins_late_costs_no_job(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Cluster(address) as crew:
        monkeypatch.setattr(clusters, "versions", lambda: {"numpy": "99.0"})
        crew.start(job(misbehaving.answer, 7))
        with pytest.raises(ClusterError, match=r"its numpy is \d.*, here 99\.0$"):
            outcome(crew)


def test_job_that_its_workers_were_lost_with_is_lost(address: str) -> None:
    with Client(address, set_as_default=False) as client:
        future = client.submit(cluster_jobs.be_given_up)
        future.exception()  # waits for it
        lost = "lost", "the workers that tried it were lost"
        assert clusters._end_of(future) == lost


@pytest.mark.parametrize(
    "nowhere",
    [
        pytest.param("tcp://127.0.0.1:1", id="nobody listens"),
        pytest.param("nonsense", id="no address"),
        pytest.param("foo://a:1", id="unknown transport"),
    ],
)
@pytest.mark.timeout(120)  # left to itself, Dask tries for minutes
def test_scheduler_that_is_not_there_is_one_line(
    nowhere: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "_CONNECT_S", 5.0)
    with pytest.raises(SimbenchError, match="no Dask scheduler answers") as caught:
        with Cluster(nowhere):
            pass
    assert "\n" not in str(caught.value)


def test_cluster_can_be_used_from_a_notebook(address: str) -> None:
    async def cell() -> bool:  # a notebook runs what is typed within a loop
        with Cluster(address) as crew:
            return crew.has_room

    with ThreadPoolExecutor(1) as thread:  # tests with a browser leave a loop in ours
        assert thread.submit(asyncio.run, cell()).result()


def test_leaving_the_block_ends_what_is_under_way(address: str, tmp_path: Path) -> None:
    begun, late = tmp_path / "begun", tmp_path / "late"
    with Cluster(address) as crew:
        work = job(cluster_jobs.begin_then_write, 3600.0, begun, late, limit_s=3600.0)
        crew.start(work)
        wait_until(begun.exists)
    begun.write_text(begun.read_text().split()[0])
    wait_until(partial(is_gone, begun))
    assert not late.exists()


@pytest.mark.slow
def test_job_of_a_lost_worker_is_done_by_another(address: str, tmp_path: Path) -> None:
    begun, late = tmp_path / "begun", tmp_path / "late"
    with Cluster(address) as crew:
        crew.start(job(cluster_jobs.begin_then_write, 5.0, begun, late))
        wait_until(begun.exists)  # within these 5 s the worker is killed
        child, worker = map(int, begun.read_text().split())
        os.kill(worker, signal.SIGKILL)
        begun.unlink()
        wait_until(begun.exists)
        assert begun.read_text().split()[0] != str(child)
        assert outcome(crew) == {"begin_then_write": ("done", None)}
    assert late.exists()


@pytest.mark.slow
def test_scheduler_that_goes_away_is_one_line(tmp_path: Path) -> None:
    facts = tmp_path / "scheduler.json"
    here = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(facts)]
    dask = [sys.executable, "-m", "dask"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    scheduler = subprocess.Popen([*dask, "scheduler", "--port", "0", *here])
    worker = subprocess.Popen([*dask, "worker", *here], env=environment)
    try:
        address = address_in(facts)
        with Cluster(address) as crew:
            crew.start(job(misbehaving.hang))
            scheduler.kill()
            with pytest.raises(ClusterError, match="scheduler is lost"):
                outcome(crew)
    finally:
        worker.kill()
        worker.wait()
        scheduler.wait()
