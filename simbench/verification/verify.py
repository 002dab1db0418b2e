"""Find recorded sequences, and have them made anew by processes of their own."""

from __future__ import annotations

import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from simbench.core.errors import DatasetError
from simbench.datasets.store import Store, open_store
from simbench.experiments.run_folder import RunFolder
from simbench.generation.dataset.manifest import RECORD, EntryFile, read_record
from simbench.runtime.limits import environment, generation_limit_s
from simbench.runtime.pool import Job, JobEvent, WorkerPool
from simbench.verification.compare_sequences import VerificationResult
from simbench.verification.remake import STEPS, remake_entry, remake_sequence

__all__ = ["Progress", "Subject", "chosen_evenly", "find_targets_to_verify", "verify"]

Progress = Callable[[float, float, str], None]


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """One recorded sequence to verify.

    Attributes
    ----------
    name : str
    remake : callable
        `remake_sequence` or `remake_entry`.
    arguments : tuple
        Its first ones: what is recorded where.
    count_frames : callable
        Returns how many are to be filmed, 0 where that cannot be told; it may have to
        read what is recorded.
    """

    name: str
    remake: Callable[..., VerificationResult]
    arguments: tuple[Any, ...]
    count_frames: Callable[[], int]


def find_targets_to_verify(
    place: str, sample: int | None = None
) -> tuple[list[Subject], int]:
    """Return the recorded sequences in a place, and how many there are in all.

    Parameters
    ----------
    place : str
        A sequence folder, a folder of sequence folders, a run folder, or path or URL
        of a data set. What looks like a sequence but is unfinished is among them: to
        miss it would hide it.
    sample : int, optional
        Return only so many, evenly spread.

    Raises
    ------
    DatasetError
        If there is none, or the place cannot be read.
    """
    store = open_store(place)
    if RECORD in store.names(""):
        record = read_record(store)
        how = {key: record.get(key) for key in ("format", "split", "channels")}
        files = [one for one in EntryFile.listed(store) if one.kind == "json"]
        if not files:
            raise DatasetError(f"{place}: nothing to verify: no sequence is finished")
        return [
            Subject(
                name=file.name,
                remake=remake_entry,
                arguments=(place, how, file),
                count_frames=partial(_frames_told, store, file),
            )
            for file in chosen_evenly(files, sample)
        ], len(files)
    folders = _sequence_folders(Path(place))
    subjects = [
        Subject(folder.name, remake_sequence, (folder,), partial(_frame_count, folder))
        for folder in chosen_evenly(folders, sample)
    ]
    return subjects, len(folders)


def _frames_told(store: Store, file: EntryFile) -> int:
    """Return what an entry says; it is not read before its turn comes, nor held."""
    try:
        (content,) = store.read([file.path])
        return int(file.parsed(content, store)["summary"]["frames"])
    except (DatasetError, KeyError, TypeError, ValueError):
        return 0  # the worker will say what is wrong


def _sequence_folders(path: Path) -> list[Path]:
    if _looks_like_one(path):
        return [path]
    is_run = (path / "run.json").is_file()
    parent = RunFolder(path).sequences if is_run else path
    try:
        found = sorted(filter(_looks_like_one, parent.iterdir()))
    except OSError as error:
        why = "it keeps no sequences (simbench run --keep-sequences does)"
        why = why if is_run else error.strerror or "unreadable"
        raise DatasetError(f"{path}: nothing to verify: {why}") from None
    if not found:
        raise DatasetError(
            f"{path}: nothing to verify: wanted a sequence, a folder of sequences, a "
            "run folder or a data set"
        )
    return found


def _looks_like_one(folder: Path) -> bool:
    return (folder / "sequence.json").is_file() or (folder / "frames").is_dir()


def _frame_count(folder: Path) -> int:
    return sum(1 for _ in (folder / "frames").glob("*.png"))


def chosen_evenly(what: Sequence[Any], count: int | None) -> Sequence[Any]:
    """Return ``count`` of a sequence, evenly spread; all where None or more."""
    if count is None or count >= len(what):
        return what
    chosen = np.linspace(0, len(what) - 1, count).round().astype(int)
    return [what[index] for index in chosen]


def verify(
    subjects: Iterable[Subject], *, jobs: int = 1, progress: Progress | None = None
) -> list[VerificationResult]:
    """Make sequences anew from their scenarios and seeds and compare them.

    Parameters
    ----------
    subjects : iterable of Subject
        See `find_targets_to_verify`.
    jobs : int
        Processes at a time. None of them is this one, which may have filmed before.
    progress : callable of (done, total, what), optional

    Returns
    -------
    list of VerificationResult
        One a subject, in their order.
    """
    order = list(subjects)
    waiting = deque(enumerate(order))
    found: dict[Subject, VerificationResult] = {}
    under_way: dict[Subject, float] = {}
    with tempfile.TemporaryDirectory(prefix="simbench-verify-") as temporary:
        scratch = Path(temporary)
        log = scratch / "workers.log"
        with WorkerPool(jobs, environment(jobs, scratch), log) as crew:
            while waiting or not crew.is_idle:
                while waiting and crew.has_room:
                    number, subject = waiting.popleft()
                    under_way[subject] = 0.0
                    crew.start(_job(subject, scratch / str(number)))
                for event in crew.events(within_s=0.5):
                    _hear(event, found, under_way)
                if progress is not None:
                    done = len(found) + sum(under_way.values())
                    what = next((subject.name for subject in under_way), "")
                    progress(done, len(order), f"making again: {what}")
    return [found[subject] for subject in order]


def _job(subject: Subject, scratch: Path) -> Job:
    arguments = (*subject.arguments, scratch)
    limit_s = generation_limit_s(subject.count_frames())
    return Job(subject, "film", subject.remake, arguments, limit_s)


def _hear(
    event: JobEvent,
    found: dict[Subject, VerificationResult],
    under_way: dict[Subject, float],
) -> None:
    subject: Subject = event.job.name
    if event.kind == "progress":
        under_way[subject] = min(event.value / STEPS, 1.0)
        return
    del under_way[subject]
    is_done = event.kind == "done"
    found[subject] = (
        event.value if is_done else VerificationResult(subject.name, (), event.value)
    )
