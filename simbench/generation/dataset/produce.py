"""Data sets, made sequence by sequence, by as many processes as there are.

Whatever interrupts it, the same call goes on where it was: what has an entry (see
`simbench.generation.dataset.make_sequence`) is left alone, what was on its way is
cleared and made again. At no time does a process hold, in memory or on its disk, more
pictures than those of the sequence it is making.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from simbench.core.errors import DatasetError, SimbenchError
from simbench.datasets.store import FolderStore, Store, open_store
from simbench.generation.dataset.index import index_files
from simbench.generation.dataset.make_sequence import SequenceJob, deliver, produce
from simbench.generation.dataset.manifest import Entries, Record, require_room
from simbench.generation.dataset.request import DatasetRequest, SequenceRequest
from simbench.generation.dataset.resume import (
    ExistingSequences,
    find_existing,
    require_same,
    tidy,
)
from simbench.runtime.cluster import open_pool
from simbench.runtime.code_digest import digest_of
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.locks import empty_folder
from simbench.runtime.pool import Job, JobEvent, Pool
from simbench.scenarios.achieved_dials import most_frames

__all__ = ["ProductionResult", "produce_dataset"]

Progress = Callable[[float, float, str], None]

_THOUSANDTHS = 1000.0


@dataclass(frozen=True, slots=True)
class ProductionResult:
    """What came out of a production.

    Attributes
    ----------
    made, kept : int
        Sequences made now, and those that were there already.
    lost : dict from str to str
        One line for each sequence that could not be made, by its name.
    again : int
        Of those made, how many took the place of one that was made otherwise.
    """

    made: int
    kept: int
    lost: dict[str, str]
    again: int = 0


def produce_dataset(
    wanted: DatasetRequest,
    place: str,
    *,
    command: str,
    licence: str = "",
    replace: bool = False,
    jobs: int = 1,
    cluster: str = "",
    progress: Progress | None = None,
) -> ProductionResult:
    """Make all sequences of a data set that are not there yet, and its index.

    Parameters
    ----------
    wanted : DatasetRequest
    place : str
        Local folder or fsspec URL: new, empty, or a data set in the same layout, which
        is then added to.
    command : str
        What the user typed, for ``dataset.json``.
    licence : str
        Of the pictures, for the card; where empty, as declared before.
    replace : bool
        Whether finished sequences of the same names may be made again where scenario,
        code or library versions are others now.
    jobs : int
        Worker processes at a time.
    cluster : str
        Address of a Dask scheduler whose workers do the work instead.
    progress : callable of (done, total, what), optional
        Counts sequences.

    Returns
    -------
    ProductionResult

    Raises
    ------
    DatasetError
        If the place cannot be used, or stops being usable, or holds sequences that
        may not be replaced.
    ClusterError
        If the cluster cannot, or does.
    """
    store = open_store(place)
    if cluster and store.is_private:
        raise DatasetError(f"{store}: the workers of a cluster cannot write there")
    require_room(store)
    with store.locked(), empty_folder(_scratch(store)) as scratch:
        shared = store.path if isinstance(store, FolderStore) else None
        log = scratch / "workers.log"
        record = Record.begun(store, wanted, command, licence)
        standing = find_existing(store, wanted)
        if not replace:
            require_same(standing, wanted, store)
        with open_pool(jobs, cluster, scratch, log, shared) as crew:
            record.write()
            tidy(store)
            making = _Making(wanted, standing, store, scratch)
            while making.step(crew):
                store.still_ours()
                if progress is not None:
                    progress(*making.standing())
        if progress is not None:
            progress(1.0, 1.0, "writing the index")
        _write(index_files(store, record.content), store, scratch / "index")
        if making.lost and log.exists():  # says more than a line
            store.take({"workers.log": log})
        record.end(len(Entries(store)), making.lost)
    return ProductionResult(making.made, making.kept, making.lost, making.again)


class _Making:
    """Which sequences wait, which are under way, and which are lost."""

    def __init__(
        self,
        wanted: DatasetRequest,
        there: ExistingSequences,
        store: Store,
        scratch: Path,
    ) -> None:
        self.wanted = wanted
        self.there = there
        self.store = store
        self.scratch = scratch
        self.waiting = (wish for wish in wanted if wish.name not in there.finished)
        self.next = next(self.waiting, None)
        self.otherwise = set(there.otherwise)
        self.kept = len(there.finished)
        self.made = 0
        self.again = 0
        self.lost: dict[str, str] = {}
        self.under_way: dict[str, float] = {}

    def step(self, crew: Pool) -> bool:
        """Give out work, wait for news and hear it; return whether anything is left."""
        while self.next is not None and crew.has_room:
            wish, self.next = self.next, next(self.waiting, None)
            try:
                order = self.order(wish)
            except SimbenchError as error:  # drawn values that do not go together
                self.lost[wish.name] = str(error)
                continue
            self.under_way[order.name] = 0.0
            limit_s = generation_limit_s(most_frames(order.scenario))
            crew.start(Job(order, "film", produce, (order,), limit_s))
        for event in crew.events(within_s=0.5):
            self.hear(event)
        return self.next is not None or not crew.is_idle

    def order(self, wish: SequenceRequest) -> SequenceJob:
        return SequenceJob(
            name=wish.name,
            key=wish.key,
            scenario=wish.recipe.scenario(wish.seed),
            seed=wish.seed,
            layout=self.wanted.layout,
            split=self.wanted.split,
            channels=self.wanted.channels,
            place=self.store.address,
            left_at=self.scratch / wish.name if self.store.is_private else None,
            replaces=tuple(self.there.replaced.get(wish.name, ())),
        )

    def hear(self, event: JobEvent) -> None:
        order: SequenceJob = event.job.name
        if event.kind == "progress":
            self.under_way[order.name] = min(event.value / _THOUSANDTHS, 1.0)
            return
        del self.under_way[order.name]
        if event.kind == "timeout":
            result, reason = "lost", f"timeout after {event.job.limit_s:g} s"
        elif event.kind == "done":
            result, reason = event.value
        else:
            result, reason = "lost", event.value
        if result == "stop":
            raise DatasetError(reason)
        if result == "lost":
            self.lost[order.name] = reason
            return
        if order.left_at is not None:
            deliver(order.left_at, self.store, order)
            shutil.rmtree(order.left_at)
        self.made += 1
        self.again += order.name in self.otherwise

    def standing(self) -> tuple[float, float, str]:
        """Return the sequences done, all of them, and what is being done."""
        done = self.kept + self.made + len(self.lost)
        doing = next(iter(self.under_way), "")
        title = f"{done} of {len(self.wanted)} sequences; {doing}"
        return done + sum(self.under_way.values()), len(self.wanted), title


def _write(
    files: Iterable[tuple[str, Iterable[str]]], store: Store, folder: Path
) -> None:
    for path, chunks in files:
        local = folder / path
        local.parent.mkdir(parents=True, exist_ok=True)
        with local.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(chunks)
        store.still_ours()
        store.take({path: local})


def _scratch(store: Store) -> Path:
    """Return where workers make their files: beside their place, if that is local."""
    if isinstance(store, FolderStore):
        return store.path / ".scratch"
    if store.is_private:  # another process may have one of the same name
        return Path(tempfile.mkdtemp(prefix="simbench-"))
    name = f"simbench-{os.getuid()}-{digest_of(str(store))[:12]}"
    return Path(tempfile.gettempdir()) / name
