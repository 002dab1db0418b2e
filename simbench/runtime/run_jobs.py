"""Run jobs in a pool of workers: start them, receive their events, report progress."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from simbench.runtime.limits import environment
from simbench.runtime.pool import Job, JobEvent, Pool, WorkerPool
from simbench.runtime.scratch import scratch_folder

__all__ = ["Progress", "run_all", "run_jobs"]

Progress = Callable[[float, float, str], None]
"""Called with the work done, the total work, and what is being worked on."""

_WAIT_S = 0.5
_LOST_TRIES = 3


def run_jobs(
    pool: Pool,
    next_job: Callable[[], Job | None],
    on_end: Callable[[JobEvent], None],
    on_progress: Callable[[Mapping[Any, float]], None] | None = None,
) -> None:
    """Run jobs until no more can be started and none is running.

    A job that is lost, for no fault of its own, is run again, three times in all.

    Parameters
    ----------
    pool : Pool
    next_job : callable
        Returns a job that can start now, or None. It is called again after each event,
        since the end of one job may make others possible.
    on_end : callable
        Receives the last event of each job: every kind but ``progress``.
    on_progress : callable, optional
        Receives, at least twice a second, the name of each running job and the share
        of it that is done, in [0, 1].
    """
    running: dict[Any, float] = {}
    tries: Counter[Any] = Counter()
    again: deque[Job] = deque()
    while True:
        while pool.has_room and (job := again.popleft() if again else next_job()):
            running[job.name] = 0.0
            pool.start(job)
        if pool.is_idle:
            return
        if on_progress is not None:
            on_progress(running)
        for event in pool.events(_WAIT_S):
            if event.kind == "progress":
                running[event.job.name] = event.value
            else:
                del running[event.job.name]
                tries[event.job.name] += event.kind == "lost"
                if event.kind == "lost" and tries[event.job.name] < _LOST_TRIES:
                    again.append(event.job)
                else:
                    on_end(event)


def run_all(
    make_jobs: Callable[[Path], Iterable[Job]],
    workers: int,
    on_progress: Callable[[int, Mapping[Any, float]], None],
) -> dict[Any, JobEvent]:
    """Run independent jobs in worker processes of this machine.

    Parameters
    ----------
    make_jobs : callable
        Returns the jobs, given an empty folder for their temporary files.
    workers : int
        Processes at a time.
    on_progress : callable
        Receives the number of jobs that have ended and the running ones, as in
        `run_jobs`.

    Returns
    -------
    dict from name to JobEvent
        The last event of each job.
    """
    ended: dict[Any, JobEvent] = {}
    with scratch_folder("jobs-") as temporary:
        scratch = Path(temporary)
        waiting = iter(make_jobs(scratch))
        log = scratch / "workers.log"
        with WorkerPool(workers, environment(workers, scratch), log) as pool:
            run_jobs(
                pool,
                lambda: next(waiting, None),
                lambda event: ended.update({event.job.name: event}),
                lambda running: on_progress(len(ended), running),
            )
    return ended
