"""One sequence of a data set: filmed, written in a layout, brought to its place.

What a data set holds beside its layout::

    CARD.md, card.json          what is in it, see `simbench.datasets.card`
    dataset.json                what was asked, see `simbench.producing.dataset_record`
    entries/NAME.KEY.json       one a finished sequence: scenario, seed, digests, files
    entries/NAME.KEY.part       the files of one that is on its way
    truth/NAME/                 the full truth, see `simbench.datasets.truth_tables`
    channels/NAME/              depth and flow if asked for, see
                                `simbench.datasets.channels`

KEY is a digest of all that makes the sequence, code included. An entry is written after
the files it speaks of: a sequence with an entry is whole.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cv2

from simbench.datasets.card import summary_of
from simbench.datasets.channels import write_channels
from simbench.datasets.formats import find_format
from simbench.datasets.truth_tables import write_truth_tables
from simbench.errors import DatasetError, SimbenchError
from simbench.producing.store import Store, open_store
from simbench.running.workers import Report
from simbench.scenarios.schema import Scenario

__all__ = ["CHANNELS", "ENTRIES", "TRUTH", "Order", "Result", "bring", "produce"]

ENTRIES = "entries"
TRUTH = "truth"
CHANNELS = "channels"
Result = Literal["made", "lost", "stop"]

_FULL = 2**24  # bytes that a disk has left when the next picture will not fit
_STEPS = 1000  # that progress is told in, however many frames there are


@dataclass(frozen=True, slots=True)
class Order:
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

    @property
    def entry(self) -> str:
        """Path of its entry in the data set, without what tells how far it is."""
        return f"{ENTRIES}/{self.name}.{self.key}"


def produce(order: Order, report: Report) -> tuple[Result, str]:
    """Make one sequence and bring it to its place.

    Parameters
    ----------
    order : Order
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
    with tempfile.TemporaryDirectory(prefix="simbench-made-") as scratch:
        root = Path(scratch) / "root"
        try:
            _make(order, Path(scratch) / "film", root, report)
        except SimbenchError as error:
            is_full = shutil.disk_usage(scratch).free < _FULL
            return "stop" if is_full else "lost", str(error)
        try:
            if order.left_at is None:
                bring(root, open_store(order.place), order)
            else:
                root.rename(order.left_at)
        except DatasetError as error:
            return "stop", str(error)
    return "made", ""


def bring(root: Path, store: Store, order: Order) -> None:
    """Move a finished sequence into a store, its entry last."""
    entry = root / "entry.json"
    paths = [path for path in root.rglob("*") if path.is_file() and path != entry]
    files = {path.relative_to(root).as_posix(): path for path in sorted(paths)}
    content = json.loads(entry.read_text(encoding="utf-8"))
    content["bytes"] = sum(path.stat().st_size for path in files.values())
    content["files"] = list(files)
    begun, done = f"{order.entry}.part", f"{order.entry}.json"
    _write(store, root, begun, list(files))
    store.take(files)
    if not store.has(begun):
        # a lost worker of a cluster may wake up late, and its work be done or tidied
        return
    _write(store, root, done, content)
    store.remove([begun])


def _write(store: Store, root: Path, path: str, content: Any) -> None:
    local = root / "note.json"
    local.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    store.take({path: local})


def _make(order: Order, film: Path, root: Path, report: Report) -> None:
    """Film a sequence and write it below ``root`` in its layout, with its entry."""
    # here, so that the command that waits loads neither simulator nor renderer
    from simbench.generation import generate

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
