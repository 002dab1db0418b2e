"""Reader of the layouts of the VOT challenges, from 2013 on.

::

    NAME/groundtruth.txt        a rectangle, polygon or mask a line; or a code
    NAME/groundtruth_ID.txt     where several targets are annotated: NAME.ID
    NAME/sequence               key=value; optional, as everything below
    NAME/color/00000001.jpg     or img/, or beside the boxes, or where sequence says
    NAME/*.tag, NAME/*.label    0 or 1 a line: attributes by frame

A polygon becomes the upright box of equal area around its centre, a mask the box around
its pixels. A code or NaN means that the region is not known in a frame, a region
without area that the target is absent.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import (
    DEFAULT_RATE_HZ,
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.boxes import region_box, require_count
from simbench.datasets.formats.readers.picture_list import (
    has_pictures,
    numbered_pictures,
)
from simbench.datasets.formats.readers.text import (
    NumberRows,
    key_values,
    text_lines,
    value_column,
)

__all__ = ["VotReader", "frame_labels", "rate_from", "read_visibility"]

_NAMES: Final = {
    "illum_change": "illumination_change",
    "size": "size_change",
    "motion": "motion_change",
}
"""Attributes of VOT that have another name here."""


class VotReader:
    """VOT; see the module."""

    name = "vot"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return a place for each annotated target."""
        root = folder.absolute()
        targets = [
            path.stem.removeprefix("groundtruth").removeprefix("_")
            for path in sorted(root.glob("groundtruth*.txt"))
            if re.fullmatch(r"groundtruth(_.+)?", path.stem)
        ]
        targets = [t for t in targets if not re.match(r"rect(\W|$)|ignore$", t)]
        if options.target:
            targets = [one for one in targets if one == options.target]
        name = root.name
        several = len(targets) > 1
        return [
            Place(self.name, root, "", f"{name}.{t or 0}" if several else name, t)
            for t in targets
        ]

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one target, see `Reader.read`."""
        stem = f"groundtruth_{place.target}" if place.target else "groundtruth"
        file = place.path(f"{stem}.txt")
        facts = _facts(place)
        pictures = numbered_pictures(place.root, _picture_folder(place, facts))
        rows, absent = _regions(place.root, file)
        require_count(rows, len(pictures), place.root / file)
        count = len(pictures)
        labels, files = frame_labels(place, count)
        gone, cut = (labels.pop(name, None) for name in ("absence", "cut_by_image"))
        if gone is not None:
            absent = absent | (gone == 1.0)
        visible, more = read_visibility(place, count)
        return Annotation(
            pictures,
            np.where(absent[:, None], np.nan, rows.values),
            absent,
            (file, *files, *more, *_described(place)),
            rows.lines,
            rate_from(place, facts),
            visible_fraction=visible,
            cut_by_image=None if cut is None else cut == 1.0,
            labels=labels,
        )


def frame_labels(
    place: Place, count: int
) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    """Return the attributes by frame in ``.tag`` and ``.label`` files, and the files.

    Returns
    -------
    labels : dict from str to (count,) float
        1 or 0; NaN beyond the end of a file. Absence and cuts have their own names.
    files : list of str

    Raises
    ------
    DatasetError
        If a file holds anything else than whole numbers.
    """
    folder = place.root / place.folder
    files = sorted(
        p.name for suffix in ("tag", "label") for p in folder.glob(f"*.{suffix}")
    )
    labels, read = {}, []
    for name in files:
        stem = name.rpartition(".")[0]
        if stem == "cover":
            continue
        values = value_column(place.root, place.path(name), count)
        labels[_NAMES.get(stem, stem)] = np.where(
            np.isnan(values), np.nan, (values == 1.0).astype(np.float64)
        )
        read.append(place.path(name))
    return labels, read


def read_visibility(
    place: Place, count: int
) -> tuple[NDArray[np.float64] | None, list[str]]:
    """Return the exact visible fraction that simbench writes, and its file.

    Raises
    ------
    DatasetError
        If it is not in [0, 1].
    """
    if not place.has("visibility.value"):
        return None, []
    file = place.path("visibility.value")
    values = value_column(place.root, file, count)
    wrong = (values < 0.0) | (values > 1.0)
    if wrong.any():
        line = int(wrong.argmax()) + 1
        raise DatasetError(
            f"{place.root / file}:{line}: expected a share from 0 to 1, "
            f"got {values[line - 1]:g}"
        )
    return values, [file]


def rate_from(place: Place, facts: dict[str, str]) -> float:
    """Return the frame rate that the file ``sequence`` tells, in 1/s.

    Raises
    ------
    DatasetError
        If it is no rate.
    """
    text = facts.get("simbench.frame_rate_hz") or facts.get("fps")
    if not text:
        return DEFAULT_RATE_HZ
    try:
        rate = float(text)
    except ValueError:
        rate = 0.0
    if not 0.01 <= rate <= 1e5:
        raise DatasetError(
            f"{place.root / place.path('sequence')}: fps: expected a frame rate, "
            f"got {text[:40]!r}"
        )
    return rate


def _described(place: Place) -> list[str]:
    return [place.path("sequence")] if place.has("sequence") else []


def _facts(place: Place) -> dict[str, str]:
    return (
        key_values(place.root, place.path("sequence"), "=") if _described(place) else {}
    )


def _picture_folder(place: Place, facts: dict[str, str]) -> str:
    """Return the folder of the pictures: as the file ``sequence`` says, or as usual."""
    channel = facts.get("channel.default", "color")
    pattern = facts.get(f"channels.{channel}") or facts.get("channels.color")
    if pattern:
        folder = pattern.rpartition("/")[0] if "%" in pattern else pattern
        if (place.root / place.path(folder)).is_dir() and folder:
            return place.path(folder)
        if not folder:
            return place.folder
    for name in ("color", "img"):
        if (place.root / place.path(name)).is_dir():
            return place.path(name)
    if not has_pictures(place.root / place.folder):
        raise DatasetError(
            f"{place.root / place.folder}: expected pictures in color/, img/ or here, "
            "got none"
        )
    return place.folder


def _regions(root: Path, file: str) -> tuple[NumberRows, NDArray[np.bool_]]:
    boxes, absent = [], []
    for number, line in enumerate(text_lines(root, file), start=1):
        box, is_absent = region_box(line.strip(), f"{root / file}:{number}")
        boxes.append(box)
        absent.append(is_absent)
    lines = np.arange(1, len(boxes) + 1)
    return NumberRows(np.array(boxes), lines), np.array(absent)
