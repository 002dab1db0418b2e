"""Worker processes: a job that hangs, crashes or exits costs only itself.

Each worker has its own pipe: killing one leaves no lock held and cuts no message of
another.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Protocol, Self

from simbench.core.errors import one_line
from simbench.runtime.exit_status import exit_reason, is_killed_from_outside
from simbench.runtime.forked_process import (
    fork_worker,
    start_fork_server,
)
from simbench.runtime.messages import Inbox, send
from simbench.runtime.worker import JobLostError, ReportProgress, WorkerSettings

__all__ = [
    "AT_ONCE",
    "Job",
    "JobEvent",
    "JobLostError",
    "Pool",
    "ReportProgress",
    "WorkerPool",
]

AT_ONCE: Final = "at once"
"""Kind of jobs that do not wait until what other workers need has been imported."""

_START_LIMIT_S = 300.0  # to start a process and import what the job needs
_EXIT_LIMIT_S = 5.0


@dataclass(frozen=True, slots=True)
class Job:
    """One function call to make in a worker.

    Attributes
    ----------
    name : object
        Returned with every event of the job; hashable.
    kind : str
        Only jobs of the same kind share a process: one that renders never runs a
        tracker.
    function : callable
        Importable by name; called with ``arguments`` and, last, a `ReportProgress`.
    arguments : tuple
        Picklable.
    limit_s : float, s
        Wall time from the call on, after which the process is killed.
    """

    name: Any
    kind: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    limit_s: float


@dataclass(frozen=True, slots=True)
class JobEvent:
    """Progress or the end of a job.

    Attributes
    ----------
    job : Job
    kind : {"progress", "done", "failed", "died", "timeout", "lost"}
        All but ``progress`` end the job: the function returned or raised, its process
        ended, or it was killed at its time limit. ``lost`` is not the function's
        fault: it was never called, another process killed its worker, or it raised
        `JobLostError`.
    value : object
        The share done, in [0, 1]; what the function returned; or one line that says
        what went wrong.
    """

    job: Job
    kind: Literal["progress", "done", "failed", "died", "timeout", "lost"]
    value: Any


class Pool(Protocol):
    """Workers that run jobs: those of this machine, or of a cluster."""

    @property
    def is_idle(self) -> bool:
        """Whether no job is running."""

    @property
    def has_room(self) -> bool:
        """Whether another job may start."""

    def start(self, job: Job) -> None:
        """Start a job."""

    def events(self, within_s: float) -> Iterator[JobEvent]:
        """Wait for events, at most ``within_s`` seconds, and yield them."""


class _Worker:
    """One process and its current job."""

    def __init__(self, kind: str, settings: WorkerSettings) -> None:
        self.kind = kind
        self.pipe, child_end = multiprocessing.Pipe()
        with child_end:
            self.process = fork_worker(child_end, at_once=kind == AT_ONCE)
        with contextlib.suppress(OSError):  # it died: the end of the pipe tells
            send(self.pipe, settings)
        self.job: Job | None = None
        self._inbox = Inbox(self.pipe)
        self.has_begun = False
        self.deadline = float("inf")

    def send(self, job: Job) -> None:
        self.job = job
        self.has_begun = False
        self.deadline = time.monotonic() + _START_LIMIT_S
        with contextlib.suppress(OSError):  # it died idle: the end of the pipe tells
            send(self.pipe, (job.function, job.arguments))

    def messages(self) -> Iterator[tuple[Any, Any]]:
        """Yield kind and value of the whole messages that have come, see `Inbox`.

        Raises
        ------
        ValueError
            If it sent something else.
        """
        for kind, value in self._inbox.messages():
            if kind not in ("started", "progress", "done", "failed", "lost"):
                raise ValueError(f"a message {kind!r}")
            yield kind, value

    def begin(self, job: Job) -> None:
        """Record that the job's function is called now."""
        self.has_begun = True
        self.deadline = time.monotonic() + job.limit_s

    def stop(self) -> None:
        """Let the worker exit by itself, so that its exit status tells; or kill it."""
        self.pipe.close()
        self.process.has_ended(_EXIT_LIMIT_S)
        self.kill()

    def kill(self, *, awaited: bool = True) -> None:
        if awaited:
            self.process.kill()
        else:
            self.process.kill(0.0)
        self.process.close()
        self.pipe.close()


class WorkerPool:
    """A few worker processes, started on demand and stopped when the block ends.

    Parameters
    ----------
    size : int
        Jobs at a time.
    environment : mapping
        Variables that workers have beside those of this process.
    log : Path
        File that receives what the workers print.
    """

    def __init__(self, size: int, environment: Mapping[str, str], log: Path) -> None:
        self._size = size
        self._environment = environment
        self._log = log
        self._workers: list[_Worker] = []

    def __enter__(self) -> Self:
        """Return the pool itself."""
        start_fork_server()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Kill every worker, and wait for the end of those that run a job.

        Those may be writing. The others have no more to do, but it takes the system up
        to a second to take down their memory.
        """
        for worker in self._workers:
            worker.kill(awaited=worker.job is not None)
        self._workers = []

    @property
    def is_idle(self) -> bool:
        """Whether no job is running."""
        return not self._busy

    @property
    def has_room(self) -> bool:
        """Whether another job may start."""
        return len(self._busy) < self._size

    def start(self, job: Job) -> None:
        """Send a job to an idle worker of its kind, or to a new one."""
        idle = (w for w in self._workers if w.job is None and w.kind == job.kind)
        worker = next(idle, None)
        if worker is None:
            variables = {**os.environ, **self._environment}
            worker = _Worker(job.kind, WorkerSettings(str(self._log), variables))
            self._workers.append(worker)
        worker.send(job)

    def events(self, within_s: float) -> Iterator[JobEvent]:
        """Wait for events, at most ``within_s`` seconds, and yield them."""
        busy = self._busy
        watched: list[Any] = [end for w in busy for end in (w.pipe, w.process)]
        ready = wait(watched, within_s)
        for worker in busy:
            if worker.pipe in ready:
                yield from self._received(worker)
            elif worker.process.has_ended():
                yield from self._ended(worker)  # though another holds its pipe
        for worker in self._busy:
            if worker.job is not None and time.monotonic() > worker.deadline:
                job = worker.job
                self._workers.remove(worker)
                worker.kill()
                if worker.has_begun:
                    yield JobEvent(job, "timeout", f"timeout after {job.limit_s:g} s")
                else:
                    late = f"its process did not start within {_START_LIMIT_S:g} s"
                    yield JobEvent(job, "lost", late)

    @property
    def _busy(self) -> list[_Worker]:
        return [worker for worker in self._workers if worker.job is not None]

    def _received(self, worker: _Worker) -> Iterator[JobEvent]:
        try:
            for kind, value in worker.messages():
                if worker.job is None:
                    raise ValueError(f"a message {kind!r} without a job")
                if kind == "started":
                    worker.begin(worker.job)
                    continue
                job = worker.job
                if kind != "progress":
                    worker.job = None
                yield JobEvent(job, kind, value)
        except (EOFError, OSError):
            yield from self._ended(worker)
        except Exception as error:  # garbage: pickle may raise anything
            reason = f"its process sent an unreadable message: {one_line(error)}"
            yield from self._ended(worker, reason)

    def _ended(self, worker: _Worker, reason: str = "") -> Iterator[JobEvent]:
        """Remove a worker that is of no more use; its job, if any, ends."""
        self._workers.remove(worker)
        if reason:
            worker.kill()
        else:
            worker.stop()
        if worker.job is None:
            return
        exit_code = worker.process.exit_code
        is_killed = is_killed_from_outside(exit_code)
        is_lost = bool(reason) or is_killed or not worker.has_begun
        yield JobEvent(
            worker.job,
            "lost" if is_lost else "died",
            reason or exit_reason(exit_code),
        )
