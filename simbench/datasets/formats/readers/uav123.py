"""Reader of UAV123, UAV20L and UAV123@10fps, whose boxes are apart from the pictures.

::

    anno/UAV123/NAME.txt                left,top,width,height; NaN where absent
    data_seq/UAV123/FOLDER/000001.jpg   FOLDER is NAME, or as configSeqs.m says
    configSeqs.m                        folder, first and last picture of each NAME

Several sequences share a folder of pictures (``bird1_1``, ``bird1_2``): they need
``configSeqs.m``, which the data set comes with.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import (
    DEFAULT_RATE_HZ,
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.boxes import read_boxes, require_count
from simbench.datasets.formats.readers.picture_list import numbered_pictures
from simbench.datasets.formats.readers.text import text_lines

__all__ = ["Uav123Reader"]

_ENTRY: Final = re.compile(
    r"'name'\s*,\s*'([^']+)'.{0,20}?'path'\s*,\s*'([^']+)'"
    r".{0,40}?'startFrame'\s*,\s*(\d{1,7})\s*,\s*'endFrame'\s*,\s*(\d{1,7})"
)


class Uav123Reader:
    """UAV123; see the module."""

    name = "uav123"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return all sequences of a root, or those of one folder of pictures."""
        root, only = _root(folder.absolute())
        if root is None:
            return []
        places = []
        for file in sorted(root.glob("anno/*/*.txt")):
            kind, name = file.parent.name, file.stem
            pictures = _pictures(root, kind, name)[0]
            if only in ("", pictures):
                places.append(Place(self.name, root, f"{kind}/{name}", name))
        return places

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one sequence, see `Reader.read`."""
        kind, _, name = place.folder.partition("/")
        file = f"anno/{kind}/{name}.txt"
        rows = read_boxes(place.root, file, nan="absent")
        folder, first, last = _pictures(place.root, kind, name, len(rows.values))
        pictures = numbered_pictures(place.root, folder)
        if last:
            pictures = pictures.part(first - 1, last)
        require_count(rows, len(pictures), place.root / file)
        rate = 10.0 if "10fps" in kind else DEFAULT_RATE_HZ
        gone = np.isnan(rows.values[:, 0])
        files = [file, *(["configSeqs.m"] if last else [])]
        return Annotation(
            pictures, rows.values, gone, tuple(files), rows.lines, rate, origin=1
        )


def _root(folder: Path) -> tuple[Path | None, str]:
    """Return the data set's root, and the folder of pictures that is meant, if any."""
    if (folder / "anno").is_dir() and (folder / "data_seq").is_dir():
        return folder, ""
    above = folder.parent.parent.parent
    if folder.parent.parent.name == "data_seq" and (above / "anno").is_dir():
        return above, folder.relative_to(above).as_posix()
    return None, ""


def _pictures(root: Path, kind: str, name: str, boxes: int = 0) -> tuple[str, int, int]:
    """Return the folder of the pictures, and the first and last number, 0 for all.

    A name may be in several data sets that share a file: then ``boxes`` decides.
    """
    known = _ranges(root).get(name, [(name, 0, 0)])
    fitting = [one for one in known if one[2] - one[1] + 1 == boxes]
    folder, first, last = (fitting or known)[0]
    for place in (f"data_seq/{kind}/{folder}", f"data_seq/UAV123/{folder}"):
        if (root / place).is_dir():
            return place, first, last
    return f"data_seq/{kind}/{folder}", first, last


@lru_cache(maxsize=4)
def _ranges(root: Path) -> dict[str, list[tuple[str, int, int]]]:
    """Return folder, first and last picture by name, from configSeqs.m."""
    try:
        text = "\n".join(text_lines(root, "configSeqs.m"))
    except DatasetError:
        return {}
    found: dict[str, list[tuple[str, int, int]]] = {}
    for name, path, first, last in _ENTRY.findall(text):
        folder = path.replace("\\", "/").strip("/").rpartition("/")[2]
        found.setdefault(name, []).append((folder, int(first), int(last)))
    return found
