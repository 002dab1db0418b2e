"""Worker processes that may hang, crash or die without costing more than their job.

Each worker has a pipe of its own, so that killing one can leave no lock held and no
message cut that another one needs. Workers are spawned, not forked: a forked child of
a process that holds an OpenGL context hangs in its first picture.

This module loads in every worker before anything else. It imports nothing that reads
the environment when it is imported (numpy, numba and Mesa do).
"""

from __future__ import annotations

import contextlib
import faulthandler
import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Protocol, Self

from simbench.core.one_line import one_line

__all__ = ["Job", "JobEvent", "Pool", "ReportProgress", "WorkerPool"]

ReportProgress = Callable[[int, int], None]
"""What a job calls with the frames done and their total."""

_REPORT_EVERY_S = 0.1
_START_LIMIT_S = 300.0  # to start a process and import what the job needs
_LEAVE_S = 5.0


@dataclass(frozen=True, slots=True)
class Job:
    """One call to make in a worker.

    Attributes
    ----------
    name : object
        Comes back with every event of the job.
    kind : str
        Only workers of the same kind share a process: what films never runs a
        tracker.
    function : callable
        Importable by name; called with ``arguments`` and, last, a `ReportProgress`.
    arguments : tuple
        Picklable.
    limit_s : float, s
        Wall time, from the call on, after which the process is killed.
    """

    name: Any
    kind: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    limit_s: float


@dataclass(frozen=True, slots=True)
class JobEvent:
    """What a worker has to say about its job.

    Attributes
    ----------
    job : Job
    kind : {"progress", "done", "failed", "died", "timeout", "lost"}
        All but ``progress`` end the job: the function returned or raised, its process
        ended, or it was killed at its limit. ``lost`` is no doing of the function's:
        it was never called, or its worker went away.
    value : object
        The frames done, what the function returned, or one line that says what went
        wrong.
    """

    job: Job
    kind: Literal["progress", "done", "failed", "died", "timeout", "lost"]
    value: Any


class Pool(Protocol):
    """Whoever does jobs: workers of this machine, or of many."""

    @property
    def is_idle(self) -> bool:
        """Whether no job is under way."""

    @property
    def has_room(self) -> bool:
        """Whether another job may start."""

    def start(self, job: Job) -> None:
        """Have a job done."""

    def events(self, within_s: float) -> Iterator[JobEvent]:
        """Wait until something happens, at most ``within_s``, and say what."""


class _Worker:
    """One process and the job it is at."""

    def __init__(self, kind: str, environment: Mapping[str, str], log: Path) -> None:
        context = multiprocessing.get_context("spawn")
        self.kind = kind
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(
            target=_serve,
            args=(theirs, dict(environment), str(log)),
            name=f"simbench-{kind}",
        )
        with _interrupts_ignored():
            self.process.start()
        theirs.close()
        self.job: Job | None = None
        self.has_begun = False
        self.deadline = float("inf")

    def give(self, job: Job) -> None:
        self.job = job
        self.has_begun = False
        self.deadline = time.monotonic() + _START_LIMIT_S
        with contextlib.suppress(OSError):  # it died idle: the pipe's end says so
            self.pipe.send_bytes(pickle.dumps((job.function, job.arguments)))

    def begin(self, job: Job) -> None:
        """Note that the job's function is called now: what comes is its doing."""
        self.has_begun = True
        self.deadline = time.monotonic() + job.limit_s

    def dismiss(self) -> None:
        """Tell a worker that no more work will come."""
        self.pipe.close()

    def leave(self) -> None:
        """Let a worker end by itself, so that it tells how; or kill it after all."""
        self.dismiss()
        self.process.join(_LEAVE_S)
        self.kill()

    def kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


class WorkerPool:
    """A few workers, started when there is work for them and gone when the block ends.

    Parameters
    ----------
    size : int
        Jobs at a time.
    environment : mapping
        Variables set in a worker before it imports anything heavy.
    log : Path
        Where what the workers print goes.
    """

    def __init__(self, size: int, environment: Mapping[str, str], log: Path) -> None:
        self._size = size
        self._environment = environment
        self._log = log
        self._workers: list[_Worker] = []

    def __enter__(self) -> Self:
        """Return the crew itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End every worker, whatever it is at."""
        for worker in self._busy:
            worker.kill()
        for worker in self._workers:
            worker.dismiss()  # all of them before the first is waited for
        for worker in self._workers:
            worker.leave()
        self._workers = []

    @property
    def is_idle(self) -> bool:
        """Whether no job is under way."""
        return not self._busy

    @property
    def has_room(self) -> bool:
        """Whether another job may start."""
        return len(self._busy) < self._size

    def start(self, job: Job) -> None:
        """Give a job to an idle worker of its kind, or to a new one."""
        idle = (w for w in self._workers if w.job is None and w.kind == job.kind)
        worker = next(idle, None)
        if worker is None:
            worker = _Worker(job.kind, self._environment, self._log)
            self._workers.append(worker)
        worker.give(job)

    def events(self, within_s: float) -> Iterator[JobEvent]:
        """Wait until something happens, at most ``within_s``, and say what."""
        pipes = {worker.pipe: worker for worker in self._busy}
        for ready in wait(list(pipes), within_s):
            yield from self._heard(pipes[ready])  # type: ignore[index]  # our own pipes
        for worker in self._busy:
            if worker.job is not None and time.monotonic() > worker.deadline:
                job = worker.job
                self._workers.remove(worker)
                worker.kill()
                if worker.has_begun:
                    yield JobEvent(job, "timeout", "did not return")
                else:
                    late = f"its process did not start within {_START_LIMIT_S:g} s"
                    yield JobEvent(job, "lost", late)

    @property
    def _busy(self) -> list[_Worker]:
        return [worker for worker in self._workers if worker.job is not None]

    def _heard(self, worker: _Worker) -> Iterator[JobEvent]:
        job = worker.job
        if job is None:
            return
        try:
            kind, value = worker.pipe.recv()
        except (EOFError, OSError):
            self._workers.remove(worker)
            worker.leave()
            ending = _exit_reason(worker.process.exitcode)
            yield JobEvent(job, "died" if worker.has_begun else "lost", ending)
            return
        if kind == "started":
            worker.begin(job)
            return
        if kind != "progress":
            worker.job = None
        yield JobEvent(job, kind, value)


def _exit_reason(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return f"process killed by {signal.Signals(-exit_code).name}"
    return f"process ended with exit status {exit_code}"


@contextlib.contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Let what starts in this block ignore Ctrl-C from its first instruction on."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _serve(pipe: Connection, environment: Mapping[str, str], log: str) -> None:
    """Do jobs until the pipe closes; the whole life of a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.update(environment)
    tempfile.tempdir = None  # so that a TMPDIR among them is looked at
    _print_to(log)
    threading.Thread(target=_die_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, OSError):
        while True:
            order = pipe.recv_bytes()
            try:
                function, arguments = pickle.loads(order)  # imports what it needs
                pipe.send(("started", None))
                answer = "done", function(*arguments, _Reporter(pipe))
            except BaseException as error:  # Ctrl-C is ignored: so all are the job's
                traceback.print_exc()
                answer = "failed", one_line(error)
            pipe.send(answer)


def _print_to(log: str) -> None:
    """Send whatever this process prints, in C or in Python, to a file."""
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    os.dup2(file, sys.stdout.fileno())
    os.dup2(file, sys.stderr.fileno())
    faulthandler.enable()


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


class _Reporter:
    """Sends progress, but not more often than anyone can see."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._next = 0.0

    def __call__(self, done: int, total: int) -> None:
        if time.monotonic() >= self._next:
            self._pipe.send(("progress", done))
            self._next = time.monotonic() + _REPORT_EVERY_S
