"""One sequence of a data set: filmed, written in a layout, brought to its place.

What a data set holds beside its layout::

    CARD.md, card.json          what is in it, see `simbench.datasets.card`
    dataset.json                what was requested, see
                                `simbench.generation.dataset.manifest`
    entries/NAME.KEY.json       one a finished sequence: scenario, seed, digests, files
    entries/NAME.KEY.part       the folders of one that is on its way
    truth/NAME/                 the full truth, see `simbench.datasets.truth_tables`
    channels/NAME/              depth and flow if asked for, see
                                `simbench.datasets.channels`

KEY is a digest of all that makes the sequence, code included. An entry is written after
the files it speaks of: a sequence with an entry is whole. One that was made otherwise
stays until the one that takes its place is on its way.
"""

from __future__ import annotations

import errno
import hashlib
import json
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import cv2

from simbench.core.errors import SimbenchError
from simbench.core.one_line import one_line
from simbench.datasets.card import summary_of
from simbench.datasets.channels import write_channels
from simbench.datasets.formats import find_format
from simbench.datasets.store import Store, open_store
from simbench.datasets.truth_tables import write_truth_tables
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.schema import Scenario

__all__ = [
    "CHANNELS",
    "ENTRIES",
    "TRUTH",
    "Result",
    "SequenceJob",
    "deliver",
    "own_folders",
    "produce",
]

ENTRIES = "entries"
TRUTH = "truth"
CHANNELS = "channels"
Result = Literal["made", "lost", "stop"]

_OF_THE_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO}
_STEPS = 1000  # that progress is told in, however many frames there are


@dataclass(frozen=True, slots=True)
class SequenceJob:
    """One sequence to make.

    Attributes
    ----------
    name : str
        What the layout calls it.
    key : str
        Digest of all that makes it.
    scenario : Scenario
    seed : int
    layout, split : str
        See `simbench.datasets.formats.find_format`; an empty split is the layout's own.
    channels : tuple of str
        What is recorded beside pictures and truth.
    place : str
        Path or URL of the data set.
    left_at : Path or None
        Where to leave the files, for a place that only another process can reach.
    replaces : tuple of str
        What stands in ``entries/`` for the name now, by path: made otherwise, or
        damaged. Then its folders are cleared too.
    """

    name: str
    key: str
    scenario: Scenario
    seed: int
    layout: str
    split: str
    channels: tuple[str, ...]
    place: str
    left_at: Path | None = None
    replaces: tuple[str, ...] = ()

    @property
    def entry(self) -> str:
        """Path of its entry in the data set, without what tells how far it is."""
        return f"{ENTRIES}/{self.name}.{self.key}"


def produce(order: SequenceJob, report: ReportProgress) -> tuple[Result, str]:
    """Make one sequence and deliver it to its place.

    Parameters
    ----------
    order : SequenceJob
    report : callable of (done, total)
        Called with thousandths.

    Returns
    -------
    result : {"made", "lost", "stop"}
        Lost is a sequence that cannot be told, filmed or put in that layout. A full
        disk or a place that cannot be written to would cost every other one too.
    reason : str
        One line that says why it was not made.
    """
    cv2.setNumThreads(1)
    is_made = False
    try:
        with tempfile.TemporaryDirectory(prefix="simbench-made-") as scratch:
            root = Path(scratch) / "root"
            _make(order, Path(scratch) / "film", root, report)
            is_made = True
            if order.left_at is None:
                deliver(root, open_store(order.place), order)
            else:
                root.rename(order.left_at)
    except (SimbenchError, OSError) as error:
        reason = str(error) if isinstance(error, SimbenchError) else one_line(error)
        return "stop" if is_made or _is_of_the_disk(error) else "lost", reason
    return "made", ""


def deliver(root: Path, store: Store, order: SequenceJob) -> None:
    """Move a finished sequence into a store, its entry last."""
    begun, done = f"{order.entry}.part", f"{order.entry}.json"
    if done not in order.replaces and store.has(done):
        return  # a lost worker of a cluster woke up late: another one did its work
    entry = root / "entry.json"
    paths = [path for path in root.rglob("*") if path.is_file() and path != entry]
    files = {path.relative_to(root).as_posix(): path for path in sorted(paths)}
    content = json.loads(entry.read_text(encoding="utf-8"))
    content["bytes"] = sum(path.stat().st_size for path in files.values())
    content["files"] = list(files)
    content["sha256"] = {name: _sha256(path) for name, path in files.items()}
    folders = own_folders(order.name, files)
    _write(store, root, begun, folders)
    if order.replaces:  # entries first: without one the old files do not count
        store.remove([path for path in order.replaces if path != begun])
        store.remove(folders)
    store.take(files)
    if not store.has(begun):  # it woke up later still: all is done, or tidied
        return
    _write(store, root, done, content)
    store.remove([begun])


def own_folders(name: str, paths: Iterable[str]) -> list[str]:
    """Return the folders, of those on the way to some files, that bear a name.

    What lies elsewhere, or outside of the data set, is left out.

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


def _is_of_the_disk(error: BaseException | None) -> bool:
    """Whether a full or failing disk is to blame, which every other would meet too."""
    seen: list[BaseException] = []
    while error is not None and error not in seen:  # one may be its own cause
        if isinstance(error, OSError) and error.errno in _OF_THE_DISK:
            return True
        seen.append(error)
        error = error.__cause__ or error.__context__
    return False


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write(store: Store, root: Path, path: str, content: Any) -> None:
    local = root / "note.json"
    local.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    store.take({path: local})


def _make(order: SequenceJob, film: Path, root: Path, report: ReportProgress) -> None:
    """Film a sequence and write it below ``root`` in its layout, with its entry."""
    # here, so that the command that waits loads neither simulator nor renderer
    from simbench.generation.generate import generate

    def in_thousandths(done: int, total: int) -> None:
        report(_STEPS * done // total, _STEPS)

    root.mkdir()
    sequence = generate(
        order.scenario,
        order.seed,
        film,
        channels=order.channels,
        progress=in_thousandths,
    )
    layout = find_format(order.layout, order.split or None)
    in_layout = layout.write(sequence, order.name, root)
    write_truth_tables(sequence, root / TRUTH / order.name)
    if order.layout != "native":  # which has them beside its pictures
        write_channels(root / CHANNELS / order.name, sequence.channels)
    entry = {
        "name": order.name,
        "key": order.key,
        "scenario": order.scenario.model_dump(mode="json"),
        "seed": order.seed,
        "digests": dict(sequence.digests),
        "summary": summary_of(sequence),
        "layout": in_layout,
    }
    (root / "entry.json").write_text(json.dumps(entry, allow_nan=False))
