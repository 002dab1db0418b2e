"""Generate a recorded sequence again and compare: the jobs of ``verify``."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from simbench.core.bounded_read import path_below
from simbench.core.errors import DatasetError, SimbenchError, one_line
from simbench.core.sequence import Sequence
from simbench.datasets.channels import CHANNELS
from simbench.datasets.native import read_sequence
from simbench.datasets.store import FolderStore, Store, open_store
from simbench.datasets.stored_files import read_files, require_readable
from simbench.generation.dataset.make_sequence import SequenceJob, make_sequence
from simbench.generation.dataset.manifest import EntryFile
from simbench.generation.digests import (
    PARTS,
    frame_digest,
    frames_digest,
    truth_digests,
)
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.mistakes import mistakes_in
from simbench.verification.compare_sequences import SequenceFiles, compare_sequences
from simbench.verification.difference import DAMAGE, VerificationResult

__all__ = [
    "Recorded",
    "entry_files",
    "folder_files",
    "in_dataset",
    "in_folder",
    "regenerated_files",
    "verify_sequence",
]

_ENTRY = "entry.json"


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded sequence: its files, and the job that generates it again.

    Attributes
    ----------
    files : SequenceFiles
    job : SequenceJob
    subfolder : str
        Where the same files are below those that the job generates.
    """

    files: SequenceFiles
    job: SequenceJob
    subfolder: str = ""


def verify_sequence(
    name: str, read: Callable[[], Recorded], scratch: Path, report: ReportProgress
) -> VerificationResult:
    """Generate a recorded sequence again, compare, and remove what was generated.

    Parameters
    ----------
    name : str
    read : callable
        `in_folder` or `in_dataset` of a sequence.
    scratch : Path
        Free name for a folder.
    report : callable of (done, total)
    """
    try:
        recorded = read()
        job = replace(recorded.job, local_folder=scratch)
        result, reason = make_sequence(job, report)
        if result != "made":
            raise DatasetError(reason)
        regenerated = regenerated_files(scratch, recorded.subfolder)
        differences = tuple(compare_sequences(recorded.files, regenerated))
        then, now = recorded.files.made_with, regenerated.made_with
        changes = {
            key: (then[key], now.get(key, ""))
            for key in then
            if then[key] != now.get(key, "")
        }
        return VerificationResult(name, differences, environment_changes=changes)
    except SimbenchError as error:
        return VerificationResult(name, fault=str(error))
    except DAMAGE as error:
        return VerificationResult(name, fault=f"damaged record: {one_line(error)}")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def in_folder(folder: Path, place: Path) -> Recorded:
    """Read what is recorded in a native sequence folder.

    Parameters
    ----------
    folder : Path
    place : Path
        The folder that the user named: nothing outside of it is read.
    """
    if folder != place:
        path_below(place, folder.relative_to(place).as_posix())
    sequence = read_sequence(folder)
    channels = tuple(name for name in CHANNELS if name in sequence.channels)
    how = {"format": "native", "split": "", "channels": channels}
    origin = {"scenario": sequence.scenario, "seed": sequence.seed}
    job = _job("sequence", "", origin, how)
    return Recorded(folder_files(folder, sequence), job, subfolder=job.name)


def in_dataset(place: str, manifest: Mapping[str, Any], file: EntryFile) -> Recorded:
    """Read what is recorded about a sequence of a data set.

    Parameters
    ----------
    place : str
        Path or URL of the data set.
    manifest : mapping
        The ``format``, ``split`` and ``channels`` of the data set.
    file : EntryFile
        Its entry, see `simbench.generation.dataset.make_sequence`.
    """
    store = open_store(place)
    (content,) = read_files(store, [file.path])
    entry = file.parse(content, store)
    require_readable(store, entry["files"])  # before the work of generating them
    job = _job(file.name, file.key, entry, manifest)
    return Recorded(entry_files(entry, content, store), job)


def folder_files(folder: Path, sequence: Sequence) -> SequenceFiles:
    """Return the files of a native sequence, and the digests of what they contain.

    The motion of vehicles out of sight is not on disk, so the current digest of the
    trajectories is the recorded one.
    """
    digests = {
        **sequence.digests,
        **truth_digests(sequence),
        "frames": frames_digest(frame_digest(one.image) for one in sequence.frames),
    }
    return SequenceFiles(
        paths=_paths_in(folder),
        read=_reader(FolderStore(folder)),
        digests=sequence.digests,
        made_with=sequence.made_with,
        current_digests={part: digests[part] for part in sequence.digests},
    )


def entry_files(
    entry: Mapping[str, Any], content: bytes, store: Store
) -> SequenceFiles:
    """Return the files that an entry of a data set lists, and the entry itself."""
    digests = dict.fromkeys(PARTS, "") | entry["digests"]
    read = _reader(store)
    return SequenceFiles(
        paths={_ENTRY, *entry["files"]},
        read=lambda path: content if path == _ENTRY else read(path),
        digests=digests,
        made_with=entry["summary"]["made_with"],
        current_digests={"frames": digests["frames"]},
        sha256=entry.get("sha256", {}),
    )


def regenerated_files(root: Path, subfolder: str = "") -> SequenceFiles:
    """Return the files that `make_sequence` left in a folder, or in one below it."""
    entry = json.loads((root / _ENTRY).read_text(encoding="utf-8"))
    folder = root / subfolder
    return SequenceFiles(
        paths=_paths_in(folder),
        read=_reader(FolderStore(folder)),
        digests=entry["digests"],
        made_with=entry["summary"]["made_with"],
    )


def _job(
    name: str, key: str, origin: Mapping[str, Any], how: Mapping[str, Any]
) -> SequenceJob:
    if origin["scenario"] is None or origin["seed"] is None:
        raise DatasetError(
            "no scenario and seed are recorded: simbench did not generate it"
        )
    try:
        scenario = Scenario.model_validate(origin["scenario"])
    except ValidationError as error:
        first, *_ = mistakes_in(error, Scenario)
        raise DatasetError(
            f"its scenario is not one of this version: {first}"
        ) from None
    return SequenceJob(
        name=name,
        key=key,
        scenario=scenario,
        seed=origin["seed"],
        layout=how["format"],
        split=how["split"],
        channels=tuple(how["channels"]),
        place="",
        camera=scenario.filmed_by,
        cameras=1 + len(scenario.cameras),
    )


def _reader(store: Store) -> Callable[[str], bytes]:
    return lambda path: read_files(store, [path])[0]


def _paths_in(folder: Path) -> set[str]:
    """Return the paths of all files but those below a name that begins with a dot."""
    paths = (p.relative_to(folder) for p in folder.rglob("*") if p.is_file())
    return {p.as_posix() for p in paths if not any(n[0] == "." for n in p.parts)}
