"""Generate data sets, sequence by sequence, with any number of worker processes.

A repeated call continues where it was interrupted: sequences with an entry (see
`simbench.generation.dataset.make_sequence`) are kept, unfinished ones are removed and
generated again. No process holds, on its disk, more frames than those of the sequences
of one simulation, and in memory more than a few.
"""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby
from pathlib import Path

from simbench.core.errors import DatasetError, SimbenchError
from simbench.datasets.store import FolderStore, Store, open_store
from simbench.generation.dataset.index import index_files
from simbench.generation.dataset.make_sequence import (
    Result,
    SequenceJob,
    deliver,
    make_sequences,
    put_json,
    put_text,
)
from simbench.generation.dataset.manifest import (
    MANIFEST,
    Entries,
    new_manifest,
    refuse_other_files,
)
from simbench.generation.dataset.request import DatasetRequest, SequenceRequest
from simbench.generation.dataset.resume import (
    ExistingSequences,
    find_existing,
    refuse_outdated,
    remove_unfinished,
)
from simbench.runtime.cluster import open_pool
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.locks import empty_folder
from simbench.runtime.pool import Job, JobEvent
from simbench.runtime.run_jobs import Progress, run_jobs
from simbench.runtime.scratch import scratch_folder
from simbench.runtime.worker_log import shorten
from simbench.scenarios.achieved_dials import max_rendered_frames

__all__ = ["ProductionResult", "produce_dataset"]


@dataclass(frozen=True, slots=True)
class ProductionResult:
    """Counts and failures of a call of `produce_dataset`.

    Attributes
    ----------
    made, kept : int
        Sequences generated now, and those that existed already.
    failed : dict from str to str
        By name, one line for each sequence that could not be generated.
    replaced : int
        How many of those made replaced one of another scenario, code or version.
    """

    made: int
    kept: int
    failed: dict[str, str]
    replaced: int = 0


def produce_dataset(
    request: DatasetRequest,
    place: str,
    *,
    command: str,
    licence: str = "",
    replace: bool = False,
    jobs: int = 1,
    cluster: str = "",
    progress: Progress | None = None,
) -> ProductionResult:
    """Generate all sequences of a data set that do not exist yet, and its index.

    Parameters
    ----------
    request : DatasetRequest
    place : str
        Local folder or fsspec URL: new, empty, or a data set in the same layout, which
        is then extended.
    command : str
        Command line of the user, for ``dataset.json``.
    licence : str
        Of the frames, for the card; where empty, as declared before.
    replace : bool
        Whether finished sequences of the same names may be generated again where
        scenario, code or library versions have changed.
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
    refuse_other_files(store)
    with store.locked(partial(_tell, progress)), _scratch(store) as scratch:
        shared = store.path if isinstance(store, FolderStore) else None
        log = scratch / "workers.log"
        manifest = new_manifest(store, request, command, licence)
        existing = find_existing(store, request)
        if not replace:
            refuse_outdated(existing, request, store)
        with open_pool(jobs, cluster, scratch, log, shared) as pool:
            put_json(store, MANIFEST, manifest)
            remove_unfinished(store)
            work = _ProductionState(request, existing, store, scratch, progress)
            run_jobs(pool, work.next_job, work.finish, work.report)
        if progress is not None:
            progress(1.0, 1.0, "writing the index")
        for path, chunks in index_files(store, manifest):
            put_text(store, path, chunks, scratch)
        if work.failed and log.exists():  # it tells more than one line
            shorten(log)
            store.put({"workers.log": log})
        manifest["sequences"] = len(Entries(store))
        manifest["productions"][-1] |= {"finished": True, "lost": work.failed}
        put_json(store, MANIFEST, manifest)
    return ProductionResult(work.made, work.kept, work.failed, work.replaced)


@dataclass
class _ProductionState:
    """The state of a production: sequences that wait, are done, and failed."""

    request: DatasetRequest
    existing: ExistingSequences
    store: Store
    scratch: Path
    progress: Progress | None
    made: int = 0
    replaced: int = 0
    failed: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        finished = self.existing.finished
        self.kept = len(finished)
        waiting = (one for one in self.request if one.name not in finished)
        self.waiting = groupby(waiting, lambda one: (one.recipe.label, one.seed))

    def next_job(self) -> Job | None:
        for _, group in self.waiting:
            sequences = list(group)
            try:
                jobs = tuple(map(self.sequence_job, sequences))
            except SimbenchError as error:  # sampled values that contradict each other
                self.failed |= {sequence.name: str(error) for sequence in sequences}
                continue
            # to reach dials, the first camera films even if only another is missing
            films = len(jobs) + (jobs[0].camera > 0)
            limit_s = generation_limit_s(films * max_rendered_frames(jobs[0].scenario))
            return Job(jobs[0].name, "generate", make_sequences, (jobs,), limit_s)
        return None

    def sequence_job(self, sequence: SequenceRequest) -> SequenceJob:
        is_private = self.store.is_private
        return SequenceJob(
            name=sequence.name,
            key=sequence.key,
            scenario=sequence.recipe.scenario(sequence.seed),
            seed=sequence.seed,
            layout=self.request.layout,
            split=self.request.split,
            channels=self.request.channels,
            place=self.store.address,
            local_folder=self.scratch / sequence.name if is_private else None,
            replaces=tuple(self.existing.to_replace.get(sequence.name, ())),
            camera=sequence.camera,
            cameras=sequence.cameras,
        )

    def finish(self, event: JobEvent) -> None:
        (jobs,) = event.job.arguments
        is_done = event.kind == "done"
        results = event.value if is_done else [("failed", event.value)] * len(jobs)
        for job, (result, reason) in zip(jobs, results, strict=True):
            self._finish_sequence(job, result, reason)

    def _finish_sequence(self, job: SequenceJob, result: Result, reason: str) -> None:
        if result == "stop":
            raise DatasetError(reason)
        if result == "failed":
            self.failed[job.name] = reason
            return
        if job.local_folder is not None:
            deliver(job.local_folder, self.store, job)
            shutil.rmtree(job.local_folder)
        self.made += 1
        self.replaced += job.name in self.existing.outdated

    def report(self, running: Mapping[str, float]) -> None:
        """Report the sequences done, all of them, and one that is being generated."""
        self.store.check_lock()
        if self.progress is not None:
            done = self.kept + self.made + len(self.failed)
            name = next(iter(running), "")
            title = f"{done} of {len(self.request)} sequences; {name}"
            self.progress(done + sum(running.values()), len(self.request), title)


@contextlib.contextmanager
def _scratch(store: Store) -> Iterator[Path]:
    """Yield a folder for temporary files: in the data set, if that is local."""
    if isinstance(store, FolderStore):
        with empty_folder(store.path / ".scratch") as folder:
            yield folder
    else:
        with scratch_folder("production-") as name:
            yield Path(name)


def _tell(progress: Progress | None, line: str) -> None:
    if progress is not None:
        progress(0.0, 1.0, line)
