"""Reader of GOT-10k.

::

    NAME/00000001.jpg, NAME/groundtruth.txt (left,top,width,height), NAME/meta_info.ini
    NAME/absence.label, NAME/cut_by_image.label, NAME/cover.label (0..8)

The cover label is the visible share in eighths, rounded up: it is read as level / 8, as
pytracking does. Where simbench wrote the exact share (``visibility.value``) that
counts. In the test split only the first box is public: then the others are unknown.
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
from simbench.datasets.formats.readers.boxes import read_boxes, require_count
from simbench.datasets.formats.readers.picture_list import numbered_pictures
from simbench.datasets.formats.readers.text import (
    NumberRows,
    key_values,
    value_column,
)
from simbench.datasets.formats.readers.vot import (
    frame_labels,
    rate_from,
    read_visibility,
)

__all__ = ["Got10kReader"]

_LEVELS: Final = 8
_MARKS: Final = ("meta_info.ini", "absence.label", "cover.label")


class Got10kReader:
    """GOT-10k; see the module."""

    name = "got10k"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the place of the sequence."""
        place = Place(self.name, folder.absolute(), "", folder.absolute().name)
        is_ours = place.has("groundtruth.txt") and any(map(place.has, _MARKS))
        return [place] if is_ours else []

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read the sequence, see `Reader.read`."""
        file = place.path("groundtruth.txt")
        rows = read_boxes(place.root, file)
        pictures = numbered_pictures(place.root, place.folder)
        count = len(pictures)
        if len(rows.values) == 1 < count:
            rows = _first_only(rows, count)
        require_count(rows, count, place.root / file)
        labels, files = frame_labels(place, count)
        gone, cut = (labels.pop(name, None) for name in ("absence", "cut_by_image"))
        first_only = np.isnan(rows.values[:, 0]) & (rows.lines == 0)
        absent = np.isnan(rows.values[:, 0]) & ~first_only
        absent |= np.zeros(count, np.bool_) if gone is None else gone == 1.0
        visible, more = _visible_fraction(place, count, absent)
        if visible is not None and "occlusion" not in labels:
            hidden = (visible < 1.0) & ~absent
            labels["occlusion"] = np.where(np.isnan(visible), np.nan, hidden)
        return Annotation(
            pictures,
            np.where(absent[:, None], np.nan, rows.values),
            absent,
            (file, *files, *more, *_described(place)),
            rows.lines,
            _rate_hz(place),
            visible_fraction=visible,
            cut_by_image=None if cut is None else cut == 1.0,
            labels=labels,
        )


def _first_only(rows: NumberRows, count: int) -> NumberRows:
    boxes = np.full((count, 4), np.nan)
    boxes[0] = rows.values[0]
    return NumberRows(boxes, np.array([1, *[0] * (count - 1)]))


def _described(place: Place) -> list[str]:
    return [place.path(n) for n in ("meta_info.ini", "sequence") if place.has(n)]


def _visible_fraction(
    place: Place, count: int, absent: NDArray[np.bool_]
) -> tuple[NDArray[np.float64] | None, list[str]]:
    exact, files = read_visibility(place, count)
    if exact is not None or not place.has("cover.label"):
        return exact, files
    file = place.path("cover.label")
    levels = value_column(place.root, file, count)
    wrong = ~np.isnan(levels) & ~np.isin(levels, np.arange(_LEVELS + 1))
    if wrong.any():
        line = int(wrong.argmax()) + 1
        raise DatasetError(
            f"{place.root / file}:{line}: expected a level from 0 to {_LEVELS}, "
            f"got {levels[line - 1]:g}"
        )
    return np.where(absent, 0.0, levels / _LEVELS), [file]


def _rate_hz(place: Place) -> float:
    if place.has("sequence"):
        facts = key_values(place.root, place.path("sequence"), "=")
        return rate_from(place, facts)
    if not place.has("meta_info.ini"):
        return DEFAULT_RATE_HZ
    facts = key_values(place.root, place.path("meta_info.ini"), ":")
    found = re.fullmatch(r"(\d{1,5}(?:\.\d{1,9})?) ?Hz", facts.get("anno_fps", ""))
    return float(found[1]) if found and float(found[1]) >= 0.01 else DEFAULT_RATE_HZ
