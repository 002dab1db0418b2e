"""Make the entries of a catalogue, several at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from simbench.report.catalogue.entry import Entry, EntryRequest, make_entry
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.pool import Job
from simbench.runtime.run_jobs import Progress, run_all

__all__ = ["make_entries"]


def make_entries(
    requests: Sequence[EntryRequest],
    *,
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Entry]:
    """Return the catalogue entries of scenarios, in the order of the requests.

    Parameters
    ----------
    requests : sequence of EntryRequest
    jobs : int
        Processes at a time.
    progress : callable of (done, total, what), optional

    Returns
    -------
    list of Entry
        One that could not be rendered says so in its ``problem``.
    """
    # the longest first, so that the last one does not leave other workers idle
    order = sorted(range(len(requests)), key=lambda n: -requests[n].frames)

    def make_jobs(_: Path) -> Iterator[Job]:
        for number in order:
            limit_s = generation_limit_s(requests[number].frames)
            yield Job(number, "generate", make_entry, (requests[number],), limit_s)

    def report(ended: int, running: Mapping[int, float]) -> None:
        if progress is not None:
            first = next((requests[number].source for number in running), "")
            title = f"rendering {first}" if first else "writing the page"
            progress(ended, len(requests), title)

    events = run_all(make_jobs, jobs, report)
    return [
        events[number].value
        if events[number].kind == "done"
        else Entry(request, problem=f"{request.source}: {events[number].value}")
        for number, request in enumerate(requests)
    ]
