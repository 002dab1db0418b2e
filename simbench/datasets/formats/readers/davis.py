"""Reader of DAVIS 2016 and 2017: one picture of object numbers a frame.

::

    JPEGImages/480p/NAME/00000.jpg
    Annotations/480p/NAME/00000.png     0 nothing, 1, 2, ... objects, 255 void

The box of an object is that around its pixels, so around what is visible. It is absent
where it has none, and a clip begins where it is first seen. Each object is a clip of
its own, NAME.1, NAME.2, ...; in data sets that simbench wrote, ``objects.csv`` tells
which is the target, and only that counts. In DAVIS 2016 the only object is 255.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import read_below
from simbench.core.errors import DatasetError
from simbench.datasets.formats.masks import TARGET_NAME
from simbench.datasets.formats.readers.annotation import (
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.boxes import box_around
from simbench.datasets.formats.readers.indexed_png import object_numbers
from simbench.datasets.formats.readers.picture_list import (
    has_pictures,
    numbered_pictures,
)
from simbench.datasets.formats.readers.text import text_lines
from simbench.datasets.frames import LARGEST_PICTURE

__all__ = ["DavisReader"]

_PICTURES, _MASKS = "JPEGImages", "Annotations"
_VOID: Final = 255
_RATE_HZ: Final = 24.0


class DavisReader:
    """DAVIS; see the module."""

    name = "davis"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the objects of all sequences of a root, or of one folder."""
        root, only = _root(folder.absolute())
        if root is None:
            return []
        size = _size_folder(root)
        names = [only] if only else _names(root / _MASKS / size)
        ours = _our_targets(root)
        places = []
        for name in names:
            path = f"{size}/{name}" if size else name
            if options.target:
                targets = [options.target]
            elif name in ours:
                targets = [ours[name]]
            else:
                targets = _objects(root, path)
            several = len(targets) > 1 or bool(options.target)
            places += [
                Place(self.name, root, path, f"{name}.{t}" if several else name, t)
                for t in targets
            ]
        return places

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one object, see `Reader.read`."""
        masks = numbered_pictures(place.root, f"{_MASKS}/{place.folder}")
        pictures = numbered_pictures(place.root, f"{_PICTURES}/{place.folder}")
        if len(masks) != len(pictures):
            raise DatasetError(
                f"{place.root / _MASKS / place.folder}: expected {len(pictures)} "
                f"masks, one a picture, got {len(masks)}"
            )
        size = pictures.size()
        if not place.target.isdecimal():
            raise DatasetError(
                f"{place.root}: expected the number of an object, got {place.target!r}"
            )
        boxes = np.full((len(masks), 4), np.nan)
        for index, file in enumerate(masks.files):
            numbers = _numbers(place.root, file)
            if numbers.shape != (size[1], size[0]):
                raise DatasetError(
                    f"{place.root / file}: expected {size[0]} x {size[1]} px as the "
                    f"pictures, got {numbers.shape[1]} x {numbers.shape[0]}"
                )
            box = box_around(numbers == int(place.target))
            boxes[index] = np.nan if box is None else box
        seen = np.flatnonzero(~np.isnan(boxes[:, 0]))
        if not len(seen):
            raise DatasetError(
                f"{place.root / _MASKS / place.folder}: expected pixels of object "
                f"{place.target}, got none"
            )
        first = int(seen[0])
        boxes = boxes[first:]
        return Annotation(
            pictures.part(first, len(pictures)),
            boxes,
            np.isnan(boxes[:, 0]),
            masks.files[first:],
            rate_hz=_RATE_HZ,
            visible_boxes=boxes,
        )


def _root(folder: Path) -> tuple[Path | None, str]:
    """Return the data set's root, and the sequence that is meant, if any."""
    if (folder / _PICTURES).is_dir() and (folder / _MASKS).is_dir():
        return folder, ""
    for root in (folder.parent.parent.parent, folder.parent.parent):
        relative = folder.relative_to(root).parts if folder != root else ()
        if relative[:1] in ((_PICTURES,), (_MASKS,)) and len(relative) > 1:
            if (root / _MASKS).is_dir() and has_pictures(folder):
                return root, folder.name
    return None, ""


def _size_folder(root: Path) -> str:
    """Return the folder of the size of pictures, empty where sequences have none."""
    names = _names(root / _MASKS)
    if "480p" in names or not names:
        return "480p"
    return "" if has_pictures(root / _MASKS / names[0]) else names[0]


def _names(folder: Path) -> list[str]:
    if not folder.is_dir():
        return []
    return sorted(p.name for p in folder.iterdir() if p.is_dir() and p.name[0] != ".")


def _objects(root: Path, path: str) -> list[str]:
    """Return the objects of the first picture of numbers."""
    first = numbered_pictures(root, f"{_MASKS}/{path}").files[0]
    found = [n for n in np.unique(_numbers(root, first)).tolist() if n]
    kept = found if found == [_VOID] else [n for n in found if n != _VOID]
    if not kept:
        raise DatasetError(f"{root / first}: expected pixels of an object, got none")
    return [str(number) for number in kept]


def _numbers(root: Path, file: str) -> NDArray[np.uint8]:
    """Return the object numbers of a picture, (H, W)."""
    return object_numbers(read_below(root, file, LARGEST_PICTURE), root / file)


def _our_targets(root: Path) -> dict[str, str]:
    """Return the number of the target of each sequence that simbench wrote."""
    if not (root / "objects.csv").is_file():
        return {}
    rows: Any = csv.DictReader(text_lines(root, "objects.csv"))
    return {
        row["sequence"]: row["object"]
        for row in rows
        if row.get("vehicle") == TARGET_NAME and row.get("sequence") and row["object"]
    }
