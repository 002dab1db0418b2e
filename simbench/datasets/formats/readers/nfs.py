"""Reader of Need for Speed (NfS), at 30 and 240 frames a second.

::

    NAME/30/NAME/00001.jpg, NAME/30/NAME.txt
    NAME/240/NAME/00001.jpg, NAME/240/NAME.txt

A line is VATIC's: ``track left top right bottom frame lost occluded generated label``.
The files at 30 frames a second have the boxes of all 240, and some have one box more or
fewer than pictures: then every eighth counts, and the one too much does not, as in
got10k.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import (
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.boxes import require_count
from simbench.datasets.formats.readers.picture_list import numbered_pictures
from simbench.datasets.formats.readers.text import (
    NumberRows,
    split_numbers,
    text_lines,
)

__all__ = ["NfsReader"]

_RATES: Final = ("30", "240")
_LINE: Final = "track left top right bottom frame lost occluded"


class NfsReader:
    """NfS; see the module."""

    name = "nfs"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return a place for each rate."""
        folder = folder.absolute()
        if folder.name in _RATES:
            parents = [folder]
        else:
            parents = [folder / rate for rate in _RATES]
        found = [
            (rate, file)
            for rate in parents
            for file in sorted(rate.glob("*.txt"))
            if (rate / file.stem).is_dir()
        ]
        return [
            Place(
                self.name,
                rate,
                "",
                f"{file.stem}-{rate.name}" if len(found) > 1 else file.stem,
                file.stem,
            )
            for rate, file in found
        ]

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one sequence, see `Reader.read`."""
        file = f"{place.target}.txt"
        rows = _rows(place.root, file)
        pictures = numbered_pictures(place.root, place.target)
        count = len(pictures)
        if len(rows.values) != count and abs(len(rows.values) - 8 * count) < 8:
            rows = NumberRows(rows.values[::8], rows.lines[::8])
        if abs(len(rows.values) - count) == 1:
            count = min(count, len(rows.values))
            rows = NumberRows(rows.values[:count], rows.lines[:count])
            pictures = pictures.part(0, count)
        require_count(rows, count, place.root / file)
        corners, lost = rows.values[:, 1:5], rows.values[:, 6] == 1.0
        size = corners[:, 2:] - corners[:, :2]
        wrong = ~lost & (size <= 0.0).any(axis=1)
        if wrong.any():
            raise DatasetError(
                f"{place.root / file}:{rows.lines[wrong][0]}: expected right and "
                "bottom beyond left and top"
            )
        boxes = np.concatenate([corners[:, :2], size], axis=1)
        return Annotation(
            pictures,
            np.where(lost[:, None], np.nan, boxes),
            lost,
            (file,),
            rows.lines,
            float(place.root.name),
            labels={"occlusion": (rows.values[:, 7] == 1.0).astype(np.float64)},
        )


def _rows(root: Path, file: str) -> NumberRows:
    """Return the first eight columns in the order of their frames."""
    rows = []
    for number, line in enumerate(text_lines(root, file), start=1):
        where = f"{root / file}:{number}"
        words = re.sub(r'"[^"]*"', "", line).split()[:8]
        numbers = split_numbers(" ".join(words), where, _LINE)
        if len(numbers) < 8 or not np.isfinite(numbers).all():
            raise DatasetError(f"{where}: expected {_LINE}, got {len(numbers)} numbers")
        rows.append(numbers)
    values = np.array(rows)
    order = np.argsort(values[:, 5], kind="stable")
    return NumberRows(values[order], order + 1)
