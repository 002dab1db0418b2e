"""Generate the sequences of one simulation, write them in a layout, deliver them.

What a data set holds beside its layout::

    CARD.md, card.json          contents, see `simbench.datasets.card`
    dataset.json                what was requested, see
                                `simbench.generation.dataset.manifest`
    entries/NAME.KEY.json       a finished sequence: scenario, seed, digests, files
    entries/NAME.KEY.part       the folders of one that is being delivered
    truth/NAME/                 the full truth, see `simbench.datasets.truth_tables`
    channels/NAME/              depth and flow where requested, see
                                `simbench.datasets.channels`

KEY is a digest of all that decides the files, code included. An entry is written after
the files that it lists: a sequence with an entry is complete. An outdated sequence is
kept until the delivery of its replacement begins.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import cv2

from simbench.core.errors import SimbenchError, one_line
from simbench.core.sequence import Sequence
from simbench.datasets.card import summary_of
from simbench.datasets.channels import write_channels
from simbench.datasets.formats import find_format
from simbench.datasets.store import Store, open_store
from simbench.datasets.truth_tables import write_truth_tables
from simbench.runtime.pool import ReportProgress
from simbench.runtime.scratch import scratch_folder
from simbench.scenarios.schema import Scenario

__all__ = [
    "ENTRIES",
    "Result",
    "SequenceJob",
    "deliver",
    "make_sequence",
    "make_sequences",
    "own_folders",
    "put_json",
    "put_text",
]

ENTRIES = "entries"
Result = Literal["made", "failed", "stop"]

_DISK_FAULTS = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO}


@dataclass(frozen=True, slots=True)
class SequenceJob:
    """One sequence to generate.

    Attributes
    ----------
    name : str
        In the layout.
    key : str
        Digest of all that decides its files.
    scenario : Scenario
    seed : int
    camera, cameras : int
        Which camera films it, 0 being the first, and how many there are: where the
        scenario has fewer, more are sampled.
    layout, split : str
        See `simbench.datasets.formats.find_format`; an empty split is the layout's own.
    channels : tuple of str
        What is recorded beside images and truth.
    place : str
        Path or URL of the data set.
    local_folder : Path or None
        Where to leave the files if only another process can write to the place.
    replaces : tuple of str
        Paths of existing outdated or damaged files of the name in ``entries/``. If
        there are any, its folders are removed too.
    """

    name: str
    key: str
    scenario: Scenario
    seed: int
    layout: str
    split: str
    channels: tuple[str, ...]
    place: str
    local_folder: Path | None = None
    replaces: tuple[str, ...] = ()
    camera: int = 0
    cameras: int = 1


def make_sequences(
    jobs: tuple[SequenceJob, ...], report: ReportProgress
) -> list[tuple[Result, str]]:
    """Generate the sequences that cameras make of one simulation; deliver them.

    Parameters
    ----------
    jobs : tuple of SequenceJob
        Of one scenario and seed; their cameras differ.
    report : callable of (done, total)

    Returns
    -------
    list of (result, reason)
        Of each job.

    result : {"made", "failed", "stop"}
        ``failed`` where the scenario cannot be simulated, rendered or written in the
        layout; ``stop`` where all other sequences would fail too: the disk is full, or
        the place cannot be written to.
    reason : str
        One line that says why it was not made.
    """
    cv2.setNumThreads(1)
    try:
        with scratch_folder("made-") as scratch:
            found = _generate(jobs, Path(scratch), report)
            return [
                _hand_over(job, Path(scratch), one)
                for job, one in zip(jobs, found, strict=True)
            ]
    except (SimbenchError, OSError) as error:
        return [_failure(error)] * len(jobs)


def make_sequence(job: SequenceJob, report: ReportProgress) -> tuple[Result, str]:
    """Generate one sequence and deliver it, see `make_sequences`."""
    (result,) = make_sequences((job,), report)
    return result


def _hand_over(
    job: SequenceJob, scratch: Path, sequence: Sequence | SimbenchError
) -> tuple[Result, str]:
    """Write a generated sequence in its layout, and deliver it."""
    if isinstance(sequence, SimbenchError):
        return _failure(sequence)
    is_written = False
    try:
        root = scratch / f"root-{job.camera}"
        _write(job, sequence, root)
        is_written = True
        if job.local_folder is None:
            deliver(root, open_store(job.place), job)
        else:
            root.rename(job.local_folder)
    except (SimbenchError, OSError) as error:
        return _failure(error, stops=is_written)
    return "made", ""


def _failure(
    error: SimbenchError | OSError, *, stops: bool = False
) -> tuple[Result, str]:
    reason = str(error) if isinstance(error, SimbenchError) else one_line(error)
    return "stop" if stops or _is_disk_fault(error) else "failed", reason


def deliver(root: Path, store: Store, job: SequenceJob) -> None:
    """Move a finished sequence into a store, its entry last."""
    stem = f"{ENTRIES}/{job.name}.{job.key}"
    part, done = f"{stem}.part", f"{stem}.json"
    if done not in job.replaces and store.has(done):
        return  # a cluster worker believed lost: another one has delivered it
    entry = root / "entry.json"
    paths = [path for path in root.rglob("*") if path.is_file() and path != entry]
    files = {path.relative_to(root).as_posix(): path for path in sorted(paths)}
    content = json.loads(entry.read_text(encoding="utf-8"))
    content["bytes"] = sum(path.stat().st_size for path in files.values())
    content["files"] = list(files)
    content["sha256"] = {name: _sha256(path) for name, path in files.items()}
    folders = own_folders(job.name, files)
    put_json(store, part, folders)
    if job.replaces:  # entries first: without one the old files do not count
        store.remove([path for path in job.replaces if path != part])
        store.remove(folders)
    store.put(files)
    if store.has(part):  # if not, the same late worker: it is delivered, or removed
        put_json(store, done, content)
        store.remove([part])


def put_json(store: Store, path: str, content: Any) -> None:
    """Write a JSON file into a store."""
    text = json.dumps(content, indent=1, allow_nan=False, default=str)
    put_text(store, path, [text, "\n"])


def put_text(
    store: Store, path: str, chunks: Iterable[str], scratch: Path | None = None
) -> None:
    """Write a text file into a store, by way of a local folder ``scratch``."""
    with scratch_folder("text-", scratch) as folder:
        local = Path(folder) / "file"
        with local.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(chunks)
        store.require_lock()
        store.put({path: local})


def own_folders(name: str, paths: Iterable[str]) -> list[str]:
    """Return those of the folders above some files that have a name.

    Files elsewhere, or outside of the data set, are ignored.

    Examples
    --------
    >>> own_folders("a-0001", ["val/a-0001/1.jpg", "truth/a-0001/boxes", "../a-0001/x"])
    ['truth/a-0001', 'val/a-0001']
    """
    found = set()
    for path in map(PurePosixPath, paths):
        if name in path.parts and ".." not in path.parts and not path.is_absolute():
            found.add("/".join(path.parts[: path.parts.index(name) + 1]))
    return sorted(found)


def _is_disk_fault(error: BaseException | None) -> bool:
    """Whether the cause is a full or failing disk, which would fail every sequence.

    Of a fault in a child process, such as SUMO's, only the text is known.
    """
    seen: list[BaseException] = []
    while error is not None and error not in seen:  # one may be its own cause
        if isinstance(error, OSError) and error.errno in _DISK_FAULTS:
            return True
        if any(os.strerror(number) in str(error) for number in _DISK_FAULTS):
            return True
        seen.append(error)
        error = error.__cause__ or error.__context__
    return False


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _generate(
    jobs: tuple[SequenceJob, ...], scratch: Path, report: ReportProgress
) -> list[Sequence | SimbenchError]:
    """Generate the sequences of one scenario and seed."""
    # here, so that the parent process loads neither simulator nor renderer
    from simbench.generation.generate import generate_views
    from simbench.generation.more_cameras import with_cameras

    first = jobs[0]
    scenario = first.scenario
    if first.cameras != 1 + len(scenario.cameras):
        scenario = with_cameras(scenario, first.seed, first.cameras)
    folders = {job.camera: scratch / f"sequence-{job.camera}" for job in jobs}
    found = generate_views(
        scenario, first.seed, folders, channels=first.channels, progress=report
    )
    return [found[job.camera] for job in jobs]


def _write(job: SequenceJob, sequence: Sequence, root: Path) -> None:
    """Write a sequence below ``root`` in its layout, with its entry."""
    root.mkdir()
    layout = find_format(job.layout, job.split or None)
    in_layout = layout.write(sequence, job.name, root)
    write_truth_tables(sequence, root / "truth" / job.name)
    if job.layout != "native":  # which has them beside its images
        write_channels(root / "channels" / job.name, sequence.channels)
    entry = {
        "name": job.name,
        "key": job.key,
        "scenario": sequence.scenario,
        "seed": job.seed,
        "digests": dict(sequence.digests),
        "summary": summary_of(sequence),
        "layout": in_layout,
    }
    (root / "entry.json").write_text(json.dumps(entry, allow_nan=False))
