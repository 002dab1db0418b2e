"""Reader of MOT17 and its relatives: one target by its id.

::

    NAME/seqinfo.ini              [Sequence] imDir, frameRate
    NAME/img1/000001.jpg
    NAME/gt/gt.txt                frame,id,left,top,width,height,conf,class,visibility

Boxes count from 1. A clip begins in the first and ends in the last frame in which its
target has a row; it is absent where it has none between. ``--target`` chooses the id;
in data sets that simbench wrote, ``gt/vehicles.csv`` tells which is the target.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from simbench.core.errors import DatasetError
from simbench.datasets.formats.masks import TARGET_NAME
from simbench.datasets.formats.readers.annotation import (
    DEFAULT_RATE_HZ,
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.boxes import valid_boxes
from simbench.datasets.formats.readers.picture_list import numbered_pictures
from simbench.datasets.formats.readers.text import (
    NumberRows,
    ini_section,
    number_rows,
    text_lines,
)

__all__ = ["Mot17Reader", "several_targets"]

_TRUTH: Final = "gt/gt.txt"
_LINE: Final = "frame,id,left,top,width,height,conf,class,visibility"


class Mot17Reader:
    """MOT17; see the module."""

    name = "mot17"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the place of the chosen target."""
        place = Place(self.name, folder.absolute(), "", folder.absolute().name)
        if not place.has(_TRUTH):
            return []
        target = options.target or _our_target(place)
        if not target:
            ids = np.unique(_rows(place).values[:, 1].astype(np.int64)).tolist()
            if len(ids) > 1:
                raise several_targets(folder, ids)
            target = str(ids[0])
        name = place.name if not options.target else f"{place.name}.{target}"
        return [Place(self.name, place.root, "", name, target)]

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one target, see `Reader.read`."""
        where = place.root / _TRUTH
        rows = _rows(place)
        mine = rows.values[:, 1] == float(place.target)
        if not mine.any():
            raise DatasetError(f"{where}: expected rows of id {place.target}, got none")
        mine_rows = NumberRows(rows.values[mine], rows.lines[mine])
        boxes = valid_boxes(
            NumberRows(mine_rows.values[:, 2:6], mine_rows.lines), where
        ).values
        facts = _facts(place)
        pictures = numbered_pictures(place.root, facts.get("imdir", "img1"))
        frames = _frames(mine_rows, len(pictures), where)
        first, count = int(frames.min()), int(np.ptp(frames)) + 1
        found = np.full((count, 4), np.nan)
        visible = np.full(count, 0.0)
        lines = np.zeros(count, np.int64)
        found[frames - first] = boxes
        lines[frames - first] = mine_rows.lines
        shares = mine_rows.values[:, 8] if rows.values.shape[1] > 8 else np.nan
        visible[frames - first] = shares
        gone = np.isnan(found[:, 0])
        return Annotation(
            pictures.part(first, first + count),
            found,
            gone,
            (_TRUTH, *(["seqinfo.ini"] if facts else [])),
            lines,
            _rate_hz(place, facts),
            origin=1,
            visible_fraction=np.where(
                (visible < 0.0) | (visible > 1.0), np.nan, visible
            ),
        )


def several_targets(folder: Path, ids: Sequence[object]) -> DatasetError:
    """Return the error of data with several objects of which none was chosen."""
    shown = ", ".join(map(str, ids[:8])) + (", ..." if len(ids) > 8 else "")
    return DatasetError(
        f"{folder}: expected --target with one of its {len(ids)} objects: {shown}"
    )


def _rows(place: Place) -> NumberRows:
    rows = number_rows(place.root, _TRUTH, {6, 7, 8, 9, 10}, _LINE)
    whole = rows.values[:, :2]
    wrong = ~(np.isfinite(whole) & (whole == whole.round())).all(axis=1)
    wrong |= whole[:, 0] < 1.0
    if wrong.any():
        raise DatasetError(
            f"{place.root / _TRUTH}:{rows.lines[wrong][0]}: expected {_LINE} with "
            "whole numbers for frame, from 1, and id"
        )
    return rows


def _frames(
    rows: NumberRows, count: int, where: Path
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the 0-based frame of each row."""
    frames = rows.values[:, 0].astype(np.int64) - 1
    beyond = frames >= count
    if beyond.any():
        raise DatasetError(
            f"{where}:{rows.lines[beyond][0]}: expected a frame from 1 to {count}, the "
            f"number of pictures, got {int(frames[beyond][0]) + 1}"
        )
    _, firsts = np.unique(frames, return_index=True)
    if len(firsts) < len(frames):
        twice = np.setdiff1d(np.arange(len(frames)), firsts)[0]
        raise DatasetError(
            f"{where}:{rows.lines[twice]}: expected one row a frame and id, got two"
        )
    return frames


def _facts(place: Place) -> dict[str, str]:
    if not place.has("seqinfo.ini"):
        return {}
    return dict(ini_section(place.root, "seqinfo.ini", "Sequence"))


def _rate_hz(place: Place, facts: dict[str, str]) -> float:
    text = facts.get("framerate", "")
    try:
        rate = float(text or DEFAULT_RATE_HZ)
    except ValueError:
        rate = 0.0
    if not 0.01 <= rate <= 1e5:
        raise DatasetError(
            f"{place.root / 'seqinfo.ini'}: frameRate: expected a rate, "
            f"got {text[:40]!r}"
        )
    return rate


def _our_target(place: Place) -> str:
    """Return the id of the target in a data set of simbench, else an empty text."""
    if not place.has("gt/vehicles.csv"):
        return ""
    rows = csv.DictReader(text_lines(place.root, "gt/vehicles.csv"))
    return next((r.get("id") or "" for r in rows if r.get("name") == TARGET_NAME), "")
