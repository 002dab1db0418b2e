"""Reader of OTB, and of TLP, which has the same files with more in a line.

::

    NAME/img/0001.jpg               any number of digits
    NAME/groundtruth_rect.txt       left,top,width,height; comma, tab or blank
    NAME/groundtruth_rect.1.txt     where several targets are annotated: NAME.1
    NAME/attrs.txt, NAME/cfg.json   attributes, as ``IV, SV``

A line of TLP is ``frame,left,top,width,height,lost``. OTB's boxes are MATLAB's: the
first pixel is number 1. In data sets that simbench wrote they count from 0, which their
``names.csv`` tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import parse_json, read_below
from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import (
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.boxes import (
    read_boxes,
    require_count,
    valid_boxes,
)
from simbench.datasets.formats.readers.picture_list import numbered_pictures
from simbench.datasets.formats.readers.text import (
    NumberRows,
    number_rows,
    text_lines,
)

__all__ = ["OTB_ATTRIBUTES", "OtbReader", "TlpReader"]

OTB_ATTRIBUTES: Final = {
    "IV": "illumination_change",
    "SV": "scale_change",
    "OCC": "occlusion",
    "DEF": "deformation",
    "MB": "motion_blur",
    "FM": "fast_motion",
    "IPR": "in_plane_rotation",
    "OPR": "out_of_plane_rotation",
    "OV": "out_of_view",
    "BC": "background_clutter",
    "LR": "low_resolution",
}
"""Attributes of OTB by their abbreviations."""

_TRIMMED: Final = {
    "David": (300, 770),
    "Football1": (1, 74),
    "Freeman3": (1, 460),
    "Freeman4": (1, 283),
    "Diving": (1, 215),
    "BlurCar1": (247, 988),
    "BlurCar3": (3, 359),
    "BlurCar4": (18, 397),
}
"""Numbers of the first and last annotated picture, where there are more pictures."""
_STEM: Final = "groundtruth_rect"
_TLP_LINE: Final = "frame,left,top,width,height,lost"


class OtbReader:
    """OTB; see the module."""

    name = "otb"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return a place for each annotated target."""
        return [] if _columns(folder) == 6 else _places(self.name, folder, options)

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one target, see `Reader.read`."""
        file = _truth_file(place)
        rows = read_boxes(place.root, file)
        pictures = numbered_pictures(place.root, _picture_folder(place))
        first, last = _TRIMMED.get(place.name, (0, 0))
        if len(rows.values) == last - first + 1 and len(pictures) >= last:
            pictures = pictures.part(first - 1, last)
        require_count(rows, len(pictures), place.root / file)
        return Annotation(
            pictures,
            rows.values,
            np.isnan(rows.values[:, 0]),
            (file, *_attribute_files(place)),
            rows.lines,
            origin=0 if _is_ours(place) else 1,
            labels=_attributes(place, len(pictures)),
        )


class TlpReader:
    """TLP; see the module."""

    name = "tlp"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return a place for each annotated target."""
        return _places(self.name, folder, options) if _columns(folder) == 6 else []

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one target, see `Reader.read`."""
        file = _truth_file(place)
        where = place.root / file
        rows = number_rows(place.root, file, {6}, _TLP_LINE)
        boxes = valid_boxes(NumberRows(rows.values[:, 1:5], rows.lines), where).values
        lost = rows.values[:, 5]
        _require_order(rows, where)
        if not np.isin(lost, (0.0, 1.0)).all():
            line = rows.lines[~np.isin(lost, (0.0, 1.0))][0]
            raise DatasetError(f"{where}:{line}: expected lost to be 0 or 1")
        boxes = np.where(lost[:, None] == 1.0, np.nan, boxes)
        pictures = numbered_pictures(place.root, _picture_folder(place))
        require_count(rows, len(pictures), where)
        gone = np.isnan(boxes[:, 0])
        return Annotation(pictures, boxes, gone, (file,), rows.lines, origin=1)


def _places(layout: str, folder: Path, options: ReadOptions) -> list[Place]:
    files = sorted(folder.glob(f"{_STEM}*.txt"))
    targets = [file.name[len(_STEM) : -4].lstrip("._-") for file in files]
    if options.target:
        targets = [one for one in targets if one == options.target]
    several = len(files) > 1
    return [
        Place(
            layout,
            folder.absolute(),
            "",
            f"{folder.absolute().name}.{one or 0}"
            if several
            else folder.absolute().name,
            one,
        )
        for one in targets
    ]


def _columns(folder: Path) -> int:
    """Return the number of columns of the first line with boxes, 0 without any."""
    for file in sorted(folder.glob(f"{_STEM}*.txt")):
        try:
            first = text_lines(folder.absolute(), file.name)[0]
        except DatasetError:  # the reader will tell
            return 4
        return len(first.replace(",", " ").split())
    return 0


def _truth_file(place: Place) -> str:
    for separator in (".", "_", "-") if place.target else ("",):
        name = place.path(f"{_STEM}{separator}{place.target}.txt")
        if (place.root / name).exists():
            return name
    return place.path(f"{_STEM}.txt")


def _picture_folder(place: Place) -> str:
    has_folder = (place.root / place.path("img")).is_dir()
    return place.path("img") if has_folder else place.folder


def _attribute_files(place: Place) -> list[str]:
    return [place.path(n) for n in ("attrs.txt", "cfg.json") if place.has(n)]


def _attributes(place: Place, count: int) -> dict[str, NDArray[np.float64]]:
    """Return the labelled attributes: of the whole sequence, so of each frame."""
    words: list[Any] = []
    for file in _attribute_files(place)[:1]:
        if file.endswith(".json"):
            facts = parse_json(read_below(place.root, file, 2**20), place.root / file)
            found = facts.get("attributes", []) if isinstance(facts, dict) else []
            words = found if isinstance(found, list) else []
        else:
            lines = text_lines(place.root, file)
            words = ",".join(lines).replace(";", ",").split(",")
    present = {str(word).strip().upper() for word in words}
    if not present:
        return {}
    return {
        name: np.full(count, float(short in present))
        for short, name in OTB_ATTRIBUTES.items()
    }


def _is_ours(place: Place) -> bool:
    """Whether the sequence is of a data set that simbench wrote."""
    try:
        return text_lines(place.root.parent, "names.csv")[0] == "name,scenario,seed"
    except DatasetError:
        return False


def _require_order(rows: NumberRows, where: Path) -> None:
    """Refuse frames out of order: columns in another order look like that."""
    wrong = np.diff(rows.values[:, 0]) != 1.0
    if wrong.any():
        line = rows.lines[1:][wrong][0]
        raise DatasetError(
            f"{where}:{line}: expected {_TLP_LINE} with frames one after another"
        )
