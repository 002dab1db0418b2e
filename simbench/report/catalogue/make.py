"""Looking at many scenarios, several at a time."""

from __future__ import annotations

import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

from simbench.report.catalogue.entry import Entry, EntryRequest, look_at
from simbench.runtime.limits import environment, generation_limit_s
from simbench.runtime.pool import Job, WorkerPool

__all__ = ["make_entries"]


def make_entries(
    wishes: Sequence[EntryRequest],
    *,
    jobs: int = 1,
    progress: Callable[[float, float, str], None] | None = None,
) -> list[Entry]:
    """Return the entries of scenarios, in their order.

    Parameters
    ----------
    wishes : sequence of EntryRequest
    jobs : int
        Processes at a time.
    progress : callable of (done, total, what), optional

    Returns
    -------
    list of Entry
        One that could not be filmed says so in its ``problem``.
    """
    # the longest first, so that the last one does not leave other workers idle
    order = sorted(range(len(wishes)), key=lambda n: -wishes[n].frames)
    waiting = deque(order)
    entries: dict[int, Entry] = {}
    with tempfile.TemporaryDirectory(prefix="simbench-catalogue-") as temporary:
        scratch = Path(temporary)
        log = scratch / "workers.log"
        with WorkerPool(jobs, environment(jobs, scratch), log) as crew:
            while waiting or not crew.is_idle:
                while waiting and crew.has_room:
                    number = waiting.popleft()
                    limit_s = generation_limit_s(wishes[number].frames)
                    arguments = (wishes[number],)
                    crew.start(Job(number, "film", look_at, arguments, limit_s))
                for event in crew.events(within_s=0.5):
                    number = event.job.name
                    if event.kind == "done":
                        entries[number] = event.value
                    elif event.kind != "progress":
                        said = f"{wishes[number].source}: {event.value}"
                        entries[number] = Entry(wishes[number], problem=said)
                if progress is not None:
                    left = [wishes[n].source for n in order if n not in entries]
                    what = f"looking at {left[0]}" if left else "writing the page"
                    progress(len(entries), len(order), what)
    return [entries[number] for number in range(len(wishes))]
