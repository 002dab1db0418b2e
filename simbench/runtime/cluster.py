"""A crew whose workers are those of a Dask cluster.

Dask cannot stop a task that hangs or crashes its process without losing the worker. So
each task does its job in a child process, with the same machinery as on one machine: it
may hang, crash or die there, and its limit of time holds.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import multiprocessing
import queue
import tempfile
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self

from simbench.core.errors import SimbenchError
from simbench.core.one_line import one_line
from simbench.runtime.code_digest import package_digest
from simbench.runtime.limits import environment
from simbench.runtime.pool import Job, JobEvent, Pool, WorkerPool
from simbench.runtime.versions import versions

if TYPE_CHECKING:
    from distributed import Client, Future

__all__ = ["Cluster", "ClusterError", "open_pool"]

_CONNECT_S = 5.0
_WORKERS_S = 30.0  # that a cluster may be without any
_LOOK_EVERY_S = 2.0
_AHEAD = 2  # jobs for each thread of the cluster: one at work, one that waits there

Ending = tuple[Literal["done", "failed", "died", "timeout", "lost"], Any]


class ClusterError(SimbenchError):
    """A cluster that cannot be reached or worked with."""


def open_pool(
    jobs: int, cluster: str, scratch: Path, log: Path, shared: Path | None
) -> contextlib.AbstractContextManager[Pool]:
    """Return workers of this machine or, where an address is given, of a cluster.

    Parameters
    ----------
    jobs : int
        Processes at a time on this machine.
    cluster : str
        Address of a Dask scheduler such as ``tcp://scheduler:8786``, or empty.
    scratch : Path
        Folder for temporary files on this machine.
    log : Path
        Where what the workers of this machine print goes.
    shared : Path or None
        A folder that the workers of a cluster must see as this process does.
    """
    if cluster:
        return Cluster(cluster, shared)
    return WorkerPool(jobs, environment(jobs, scratch), log)


class Cluster:
    """The workers of a Dask cluster, with the interface of `WorkerPool`.

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
        self._looked = 0.0
        self._seen = 0.0

    def __enter__(self) -> Self:
        """Connect, and look at the workers."""
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
        """Take back what is under way; the tasks notice, and end their processes."""
        with contextlib.suppress(Exception):
            self._client.cancel(list(self._jobs), force=True)
        with contextlib.suppress(Exception):
            self._client.close(timeout=_CONNECT_S)

    @property
    def is_idle(self) -> bool:
        """Whether no job is under way."""
        return not self._jobs

    @property
    def has_room(self) -> bool:
        """Whether another job may start."""
        self._look()
        return len(self._jobs) < _AHEAD * max(self._threads, 1)

    def start(self, job: Job) -> None:
        """Hand a job to the cluster."""
        portrait = _portrait()
        future = self._client.submit(_perform, job, portrait, pure=False)
        self._jobs[future] = job
        future.add_done_callback(self._ended.put)

    def events(self, within_s: float) -> Iterator[JobEvent]:
        """Wait until a job ends, at most ``within_s``, and say how."""
        self._look()
        with contextlib.suppress(queue.Empty):
            future = self._ended.get(timeout=within_s)
            job = self._jobs.pop(future)
            if future.status not in ("finished", "error"):
                raise ClusterError(f"{self._address}: the scheduler is lost")
            kind, value = _ending(future)
            yield JobEvent(job, kind, value)

    def _look(self) -> None:
        """See now and then how large the cluster is, and whether it is there."""
        now = time.monotonic()
        if now - self._looked < _LOOK_EVERY_S:
            return
        self._looked = now
        try:
            self._threads = sum(self._client.nthreads().values())
        except Exception as error:  # each transport has its own
            raise ClusterError(
                f"{self._address}: the scheduler is lost: {one_line(error)}"
            ) from None
        if self._threads:
            self._seen = now
        elif now - self._seen > _WORKERS_S:
            raise ClusterError(
                f"{self._address}: no worker has been there for {_WORKERS_S:.0f} s"
            )

    def _wait_for_workers(self) -> None:
        self._seen = time.monotonic()
        self._look()
        while not self._threads:
            time.sleep(0.2)
            self._look()

    def _check_workers(self) -> None:
        """Refuse workers whose results would not be ours."""
        portraits = self._client.run(_portrait, on_error="return")
        for worker, portrait in portraits.items():
            if not isinstance(portrait, dict):
                raise ClusterError(f"worker {worker}: {one_line(portrait)}")
            _require_same(portrait, _portrait(), worker)
        if self._shared is None:
            return
        seen = self._client.run(_sees, self._shared.absolute())
        blind = [worker for worker, sees in seen.items() if not sees]
        if blind:
            raise ClusterError(
                f"worker {blind[0]}: does not see {self._shared.absolute()}: wanted a "
                "folder that all share, or the URL of one"
            )


def _connected(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError:
        raise ClusterError(
            "a cluster needs Dask: pip install 'simbench-tracking[cluster]'"
        ) from None
    for name in list(logging.root.manager.loggerDict):
        if name.startswith("distributed"):  # what it says at length is one line here
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        # Knock first: a client that fails to connect is slow to go. In a thread: the
        # caller's may have a loop of its own that runs, as a notebook's does.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(asyncio.run, _knock(address)).result()
        return Client(address, timeout=_CONNECT_S, set_as_default=False)
    except Exception as error:  # each transport has its own
        raise ClusterError(
            f"{address}: no Dask scheduler answers there: {one_line(error)}"
        ) from None


async def _knock(address: str) -> None:
    from distributed.core import rpc

    async with rpc(address, timeout=_CONNECT_S) as scheduler:
        await asyncio.wait_for(scheduler.identity(), _CONNECT_S)


def _portrait() -> dict[str, str]:
    """Return what decides the bytes that a process makes."""
    return versions() | {"simbench code": package_digest()[:16]}


def _require_same(theirs: Mapping[str, str], ours: Mapping[str, str], who: str) -> None:
    for name, wanted in ours.items():
        found = theirs.get(name, "")
        if found != wanted:
            raise ClusterError(
                f"worker {who}: its {name} is {found or 'missing'}, "
                f"here {wanted or 'missing'}"
            )


def _sees(folder: Path) -> bool:
    return folder.is_dir()


def _ending(future: Future) -> Ending:
    from distributed import KilledWorker

    if future.status == "finished":
        ending: Ending = future.result()
        return ending
    error = future.exception()
    if isinstance(error, ClusterError):  # nothing is wrong with the job
        raise error
    if isinstance(error, KilledWorker):
        return "lost", "the workers that tried it were lost"
    return "failed", one_line(error)


def _perform(job: Job, portrait: dict[str, str]) -> Ending:
    """Do a job in a child process; this is what runs on the cluster's workers."""
    from distributed import get_worker

    worker = get_worker()
    task = worker.get_current_task()
    _require_same(_portrait(), portrait, worker.address)  # it may have joined late
    with tempfile.TemporaryDirectory(prefix="simbench-task-") as scratch:
        place = Path(scratch)
        bounds = environment(worker.state.nthreads + 1, place)
        with _children_allowed(), WorkerPool(1, bounds, place / "workers.log") as crew:
            crew.start(job)
            while task in worker.state.tasks and _is_wanted(worker, task):
                for event in crew.events(within_s=0.5):
                    if event.kind != "progress":
                        return event.kind, event.value
    return "lost", "it was called off"


def _is_wanted(worker: Any, task: str) -> bool:
    """Whether somebody waits for a task: Dask marks those that it cannot stop."""
    state: str = worker.state.tasks[task].state
    return state not in ("cancelled", "resumed")


@contextlib.contextmanager
def _children_allowed() -> Iterator[None]:
    """Let a daemon, as Dask's workers are, start processes of its own.

    multiprocessing forbids it since a daemon's children would be left behind. Ours
    watch their parent, and leave with it.
    """
    config = multiprocessing.current_process()._config  # type: ignore[attr-defined]
    before = config.get("daemon")
    config["daemon"] = False
    try:
        yield
    finally:
        config["daemon"] = before
