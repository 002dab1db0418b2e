"""A worker pool on a Dask cluster.

Dask cannot stop a task that hangs or crashes its process without losing the worker. So
each task runs its job in a child process, with the same pool as on one machine: it may
hang, crash or die there, and its time limit holds.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import queue
import tempfile
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

from simbench.core.errors import SimbenchError, one_line
from simbench.runtime.code_digest import package_digest
from simbench.runtime.in_process import InProcessPool
from simbench.runtime.limits import environment
from simbench.runtime.opengl_renderer import opengl_renderer
from simbench.runtime.pool import Job, JobEvent, Pool, WorkerPool
from simbench.runtime.versions import versions

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["Cluster", "ClusterError", "open_pool"]

_CONNECT_S = 5.0
_NO_WORKERS_S = 30.0  # how long a cluster may have no workers
_CHECK_EVERY_S = 2.0
_JOBS_PER_THREAD = 2  # one that runs and one that waits on the cluster

JobEnd = tuple[Literal["done", "failed", "died", "timeout", "lost"], Any]


class ClusterError(SimbenchError):
    """A cluster that cannot be reached or used."""


def open_pool(
    jobs: int, cluster: str, scratch: Path, log: Path, shared: Path | None
) -> contextlib.AbstractContextManager[Pool]:
    """Return a pool on this machine or, where an address is given, on a cluster.

    Parameters
    ----------
    jobs : int
        Processes at a time on this machine; 0 to run jobs in this process.
    cluster : str
        Address of a Dask scheduler such as ``tcp://scheduler:8786``, or empty.
    scratch : Path
        Folder for temporary files on this machine.
    log : Path
        File that receives what the workers of this machine print.
    shared : Path or None
        A folder that the workers of a cluster must see as this process does.
    """
    if cluster:
        return Cluster(cluster, shared)
    if jobs == 0:
        return InProcessPool()
    return WorkerPool(jobs, environment(jobs, scratch), log)


class Cluster:
    """A pool on the workers of a Dask cluster, with the interface of `WorkerPool`.

    Parameters
    ----------
    address : str
        Of the scheduler.
    shared : Path, optional
        A folder that every worker must see as this process does.

    Raises
    ------
    ClusterError
        When the block is entered: if Dask is not installed, the scheduler does not
        answer or has no workers, or a worker has other versions or does not see the
        folder. Later: if the scheduler or all workers are lost, or a worker of other
        versions has joined.
    """

    def __init__(self, address: str, shared: Path | None = None) -> None:
        self._address = address
        self._shared = shared
        self._jobs: dict[Future, Job] = {}
        self._ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._client: Client = None
        self._threads = 0
        self._checked_at = 0.0
        self._had_workers_at = 0.0

    def __enter__(self) -> Self:
        """Connect, and check the workers."""
        self._client = _connected(self._address)
        try:
            self._wait_for_workers()
            self._check_workers()
        except BaseException:
            self._client.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Cancel running tasks; they notice it and end their processes."""
        with contextlib.suppress(Exception):
            self._client.cancel(list(self._jobs), force=True)
        with contextlib.suppress(Exception):
            self._client.close(timeout=_CONNECT_S)

    @property
    def is_idle(self) -> bool:
        """Whether no job is running."""
        return not self._jobs

    @property
    def has_room(self) -> bool:
        """Whether another job may start."""
        self._update()
        return len(self._jobs) < _JOBS_PER_THREAD * max(self._threads, 1)

    def start(self, job: Job) -> None:
        """Submit a job to the cluster."""
        identity = _identity()
        future = self._client.submit(_run_in_child, job, identity, pure=False)
        self._jobs[future] = job
        future.add_done_callback(self._ended.put)

    def events(self, within_s: float) -> Iterator[JobEvent]:
        """Wait for the end of a job, at most ``within_s`` seconds; yield its event."""
        self._update()
        with contextlib.suppress(queue.Empty):
            future = self._ended.get(timeout=within_s)
            job = self._jobs.pop(future)
            if future.status not in ("finished", "error"):
                raise ClusterError(f"{self._address}: the scheduler is lost")
            kind, value = _end_of(future)
            yield JobEvent(job, kind, value)

    def _update(self) -> None:
        """Update the size of the cluster, every two seconds, and detect its loss."""
        now = time.monotonic()
        if now - self._checked_at < _CHECK_EVERY_S:
            return
        self._checked_at = now
        try:
            self._threads = sum(self._client.nthreads().values())
        except Exception as error:  # each transport has its own errors
            raise ClusterError(
                f"{self._address}: the scheduler is lost: {one_line(error)}"
            ) from None
        if self._threads:
            self._had_workers_at = now
        elif now - self._had_workers_at > _NO_WORKERS_S:
            raise ClusterError(
                f"{self._address}: no worker has been there for {_NO_WORKERS_S:.0f} s"
            )

    def _wait_for_workers(self) -> None:
        self._had_workers_at = time.monotonic()
        self._update()
        while not self._threads:
            time.sleep(0.2)
            self._update()

    def _check_workers(self) -> None:
        """Refuse workers whose results would differ from those of this machine."""
        identities = self._client.run(_identity, on_error="return")
        for worker, identity in identities.items():
            if not isinstance(identity, dict):
                raise ClusterError(f"worker {worker}: {one_line(identity)}")
            _require_same(identity, _identity(), worker)
        if self._shared is None:
            return
        seen = self._client.run(_sees_folder, self._shared.absolute())
        without_folder = [worker for worker, sees in seen.items() if not sees]
        if without_folder:
            raise ClusterError(
                f"worker {without_folder[0]}: does not see {self._shared.absolute()}: "
                "expected a folder that all share, or the URL of one"
            )


def _connected(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError:
        raise ClusterError(
            "a cluster needs Dask: pip install 'simbench-tracking[cluster]'"
        ) from None
    for name in list(logging.root.manager.loggerDict):
        if name.startswith("distributed"):  # its long messages are one line here
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        # Check first: a client that fails to connect is slow to close. In a thread:
        # the caller's thread may have a running event loop, as in a notebook.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(asyncio.run, _identify_scheduler(address)).result()
        return Client(address, timeout=_CONNECT_S, set_as_default=False)
    except Exception as error:  # each transport has its own errors
        raise ClusterError(
            f"{address}: no Dask scheduler answers there: {one_line(error)}"
        ) from None


async def _identify_scheduler(address: str) -> None:
    from distributed.core import rpc

    async with rpc(address, timeout=_CONNECT_S) as scheduler:
        await asyncio.wait_for(scheduler.identity(), _CONNECT_S)


def _identity() -> dict[str, str]:
    """Return the versions that decide the bytes of results, and the code digest."""
    return versions() | {
        "simbench code": package_digest()[:16],
        "opengl": opengl_renderer(),
    }


def _require_same(theirs: Mapping[str, str], ours: Mapping[str, str], who: str) -> None:
    for name, wanted in ours.items():
        found = theirs.get(name, "")
        if found != wanted:
            raise ClusterError(
                f"worker {who}: its {name} is {found or 'missing'}, "
                f"here {wanted or 'missing'}"
            )


def _sees_folder(folder: Path) -> bool:
    return folder.is_dir()


def _end_of(future: Future) -> JobEnd:
    from distributed import KilledWorker

    if future.status == "finished":
        end: JobEnd = future.result()
        return end
    error = future.exception()
    if isinstance(error, ClusterError):  # nothing is wrong with the job
        raise error
    if isinstance(error, KilledWorker):
        return "lost", "the workers that tried it were lost"
    return "failed", one_line(error)


def _run_in_child(job: Job, identity: dict[str, str]) -> JobEnd:
    """Run a job in a child process; this runs on the cluster's workers."""
    from distributed import get_worker

    worker = get_worker()
    task = worker.get_current_task()
    _require_same(_identity(), identity, worker.address)  # it may have joined later
    with tempfile.TemporaryDirectory(prefix="simbench-task-") as scratch:
        folder = Path(scratch)
        variables = environment(worker.state.nthreads + 1, folder)
        with WorkerPool(1, variables, folder / "workers.log") as pool:
            pool.start(job)
            while task in worker.state.tasks and _is_needed(worker, task):
                for event in pool.events(within_s=0.5):
                    if event.kind != "progress":
                        return event.kind, event.value
    return "lost", "it was cancelled"


def _is_needed(worker: Any, task: str) -> bool:
    """Whether a task is still needed: Dask marks cancelled ones that it cannot stop."""
    state: str = worker.state.tasks[task].state
    return state not in ("cancelled", "resumed")
