"""Find recorded sequences, and have worker processes generate and compare them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from simbench.core.errors import DatasetError
from simbench.datasets.store import Store, open_store
from simbench.datasets.stored_files import read_files
from simbench.experiments.run_folder import RunFolder
from simbench.generation.dataset.manifest import MANIFEST, EntryFile, read_manifest
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.pool import Job, JobEvent
from simbench.runtime.run_jobs import Progress, run_all
from simbench.verification.difference import VerificationResult
from simbench.verification.oracle import OracleResult, cast_recorded
from simbench.verification.ray_caster import require_embree
from simbench.verification.regenerate import (
    Recorded,
    in_dataset,
    in_folder,
    verify_sequence,
)
from simbench.verification.spacing import evenly_spaced

__all__ = [
    "RecordedSequence",
    "find_recorded_sequences",
    "verify",
    "verify_by_rays",
]

_CAST_LIMIT_S: Final = 30.0  # a frame


@dataclass(frozen=True, slots=True, eq=False)
class RecordedSequence:
    """One recorded sequence to verify.

    Attributes
    ----------
    name : str
    read : callable
        Reads what is recorded; picklable.
    count_frames : callable
        Returns how many frames are to be rendered, 0 where unknown; it may have to read
        the record.
    """

    name: str
    read: Callable[[], Recorded]
    count_frames: Callable[[], int]


def find_recorded_sequences(
    place: str, sample: int | None = None
) -> tuple[list[RecordedSequence], int]:
    """Return the recorded sequences in a place, and how many there are in all.

    Parameters
    ----------
    place : str
        A sequence folder, a folder of sequence folders, a run folder, or path or URL
        of a data set. Unfinished sequences are among them, so that they are reported.
    sample : int, optional
        Return only so many, evenly spaced.

    Raises
    ------
    DatasetError
        If there is none, or the place cannot be read.
    """
    store = open_store(place)
    if MANIFEST in store.names(""):
        manifest = read_manifest(store)
        how = {key: manifest[key] for key in ("format", "split", "channels")}
        files = EntryFile.list_in(store)
        if not files:
            raise DatasetError(f"{place}: nothing to verify: no sequence is finished")
        return [
            RecordedSequence(
                file.name,
                partial(in_dataset, place, how, file),
                partial(_frames_of_entry, store, file),
            )
            for file in evenly_spaced(files, sample)
        ], len(files)
    folders = _sequence_folders(Path(place))
    return [
        RecordedSequence(
            folder.name,
            partial(in_folder, folder, Path(place)),
            partial(_frames_in, folder),
        )
        for folder in evenly_spaced(folders, sample)
    ], len(folders)


def _frames_of_entry(store: Store, file: EntryFile) -> int:
    """Return the number of frames in an entry, which is read only when needed."""
    try:
        (content,) = read_files(store, [file.path])
        return int(file.parse(content, store)["summary"]["frames"])
    except (DatasetError, KeyError, TypeError, ValueError):
        return 0  # the worker reports what is wrong


def _sequence_folders(path: Path) -> list[Path]:
    if _is_sequence_folder(path):
        return [path]
    is_run = (path / "run.json").is_file()
    parent = RunFolder(path).sequences if is_run else path
    try:
        found = sorted(filter(_is_sequence_folder, parent.iterdir()))
    except OSError as error:
        reason = "it keeps no sequences (simbench run --keep-sequences does)"
        reason = reason if is_run else error.strerror or "unreadable"
        raise DatasetError(f"{path}: nothing to verify: {reason}") from None
    if not found:
        raise DatasetError(
            f"{path}: nothing to verify: expected a sequence, a folder of sequences, a "
            "run folder or a data set"
        )
    return found


def _is_sequence_folder(folder: Path) -> bool:
    """Whether a folder is a native sequence, finished or not."""
    return (folder / "sequence.json").is_file() or (folder / "frames").is_dir()


def _frames_in(folder: Path) -> int:
    return sum(1 for _ in (folder / "frames").glob("*.png"))


def verify(
    sequences: Iterable[RecordedSequence],
    *,
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[VerificationResult]:
    """Generate sequences again from their scenarios and seeds and compare them.

    Parameters
    ----------
    sequences : iterable of RecordedSequence
        See `find_recorded_sequences`.
    jobs : int
        Worker processes at a time; each renders in a process that is not this one.
    progress : callable of (done, total, what), optional

    Returns
    -------
    list of VerificationResult
        One a sequence, in their order.
    """
    order = list(sequences)

    def make_job(sequence: RecordedSequence, scratch: Path) -> Job:
        arguments = (sequence.name, sequence.read, scratch)
        limit_s = generation_limit_s(sequence.count_frames())
        return Job(sequence, "generate", verify_sequence, arguments, limit_s)

    events = _run(order, make_job, jobs, progress)
    return [
        event.value
        if event.kind == "done"
        else VerificationResult(event.job.name.name, (), event.value)
        for event in events
    ]


def verify_by_rays(
    sequences: Iterable[RecordedSequence],
    frames: int,
    *,
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[OracleResult]:
    """Render sequences again, and compare their truth with rays cast at the meshes.

    Parameters
    ----------
    sequences : iterable of RecordedSequence
        See `find_recorded_sequences`.
    frames : int
        How many frames of each, evenly spaced.
    jobs, progress
        As of `verify`.

    Returns
    -------
    list of OracleResult
        One a sequence, in their order.

    Raises
    ------
    SimbenchError
        If Embree is not installed.
    """
    require_embree()
    order = list(sequences)

    def make_job(sequence: RecordedSequence, _: Path) -> Job:
        arguments = (sequence.name, sequence.read, frames)
        count = sequence.count_frames()
        limit_s = generation_limit_s(count) + _CAST_LIMIT_S * min(frames, count)
        return Job(sequence, "generate", cast_recorded, arguments, limit_s)

    events = _run(order, make_job, jobs, progress)
    return [
        event.value
        if event.kind == "done"
        else OracleResult(event.job.name.name, fault=event.value)
        for event in events
    ]


def _run(
    order: list[RecordedSequence],
    make_job: Callable[[RecordedSequence, Path], Job],
    jobs: int,
    progress: Progress | None,
) -> list[JobEvent]:
    """Run a job for each sequence, given a free name; return their last events."""

    def make_jobs(scratch: Path) -> Iterator[Job]:
        for number, sequence in enumerate(order):
            yield make_job(sequence, scratch / str(number))

    def report(ended: int, running: Mapping[RecordedSequence, float]) -> None:
        if progress is not None:
            name = next((sequence.name for sequence in running), "")
            done = ended + sum(running.values())
            progress(done, len(order), f"generating again: {name}")

    events = run_all(make_jobs, jobs, report)
    return [events[sequence] for sequence in order]
