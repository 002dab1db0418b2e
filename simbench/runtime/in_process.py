"""A pool that runs each job in the calling process, for debuggers and profilers."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from types import TracebackType
from typing import Self

from simbench.core.errors import one_line
from simbench.runtime.pool import Job, JobEvent, JobLostError

__all__ = ["InProcessPool"]


class InProcessPool:
    """The interface of `simbench.runtime.pool.WorkerPool` without processes.

    Nothing is isolated and no limit is kept: a job that hangs hangs the caller.
    """

    def __init__(self) -> None:
        self._ended: list[JobEvent] = []

    def __enter__(self) -> Self:
        """Return the pool itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Do nothing: every job has ended."""

    @property
    def is_idle(self) -> bool:
        """Whether no job has an event left."""
        return not self._ended

    @property
    def has_room(self) -> bool:
        """Whether another job may start: one at a time."""
        return not self._ended

    def start(self, job: Job) -> None:
        """Run a job to its end."""
        try:
            value = job.function(*job.arguments, _ignore)
            self._ended.append(JobEvent(job, "done", value))
        except JobLostError as error:
            self._ended.append(JobEvent(job, "lost", str(error)))
        except Exception as error:  # as in a worker: the job's fault is an event
            traceback.print_exc()
            self._ended.append(JobEvent(job, "failed", one_line(error)))

    def events(self, within_s: float) -> Iterator[JobEvent]:
        """Yield the end of the job that was started."""
        ended, self._ended = self._ended, []
        yield from ended


def _ignore(done: int, total: int) -> None:
    """Take the progress of a job, which nobody can show while it runs."""
