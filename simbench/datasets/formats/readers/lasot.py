"""Reader of LaSOT.

::

    NAME/img/00000001.jpg, NAME/groundtruth.txt (left,top,width,height)
    NAME/full_occlusion.txt, NAME/out_of_view.txt     one line of 0 and 1, by frame

Out of view is absent. Where the target is fully occluded its visible share is 0;
elsewhere it is not known, since partial occlusion is not labelled.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import (
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.boxes import read_boxes, require_count
from simbench.datasets.formats.readers.picture_list import numbered_pictures
from simbench.datasets.formats.readers.text import split_numbers, text_lines

__all__ = ["LasotReader"]

_FLAGS: Final = ("full_occlusion", "out_of_view")


class LasotReader:
    """LaSOT; see the module."""

    name = "lasot"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the place of the sequence."""
        place = Place(self.name, folder.absolute(), "", folder.absolute().name)
        marks = [*(f"{flag}.txt" for flag in _FLAGS), "nlp.txt"]
        is_ours = place.has("groundtruth.txt") and any(map(place.has, marks))
        return [place] if is_ours else []

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read the sequence, see `Reader.read`."""
        file = place.path("groundtruth.txt")
        rows = read_boxes(place.root, file)
        pictures = numbered_pictures(place.root, place.path("img"))
        count = len(pictures)
        require_count(rows, count, place.root / file)
        files = [place.path(f"{f}.txt") for f in _FLAGS if place.has(f"{f}.txt")]
        flags = {
            file.rpartition("/")[2][:-4]: _flags(place.root, file, count)
            for file in files
        }
        hidden = flags.get("full_occlusion", np.zeros(count, np.bool_))
        # a hidden target without a box is somewhere; one that nothing hides is gone
        no_box = np.isnan(rows.values[:, 0])
        absent = flags.get("out_of_view", np.zeros(count, np.bool_)) | no_box & ~hidden
        visible = np.where(hidden | absent, 0.0, np.nan)
        return Annotation(
            pictures,
            np.where(absent[:, None], np.nan, rows.values),
            absent,
            (file, *files),
            rows.lines,
            origin=1,
            visible_fraction=visible,
            labels={name: value.astype(np.float64) for name, value in flags.items()},
        )


def _flags(root: Path, file: str, count: int) -> NDArray[np.bool_]:
    """Return a file of 0 and 1, all in one line or one a line, (count,) bool."""
    lines = text_lines(root, file)
    where = f"{root / file}:1"
    values = np.array(
        [one for line in lines for one in split_numbers(line, where, "0 or 1")]
    )
    if len(values) != count or not np.isin(values, (0.0, 1.0)).all():
        raise DatasetError(
            f"{where}: expected {count} numbers 0 or 1, one a picture, got "
            f"{len(values)}"
            + ("" if len(values) != count else " with others among them")
        )
    return np.asarray(values == 1.0)
