"""The layout of the object tracking benchmark (OTB), under that benchmark's own names.

::

    NAME/img/0001.jpg              1-based, to 9999; PNG bytes, nothing is lost
    NAME/groundtruth_rect.txt      left,top,width,height
    names.csv                      scenario and seed of each name

Its readers accept only the names of its 100 sequences, so ours borrow them, those that
show vehicles first. Left out are the names that got10k or the VOT toolkit trim to fixed
frames or spell differently. Boxes are amodal, not clipped to the image, and count from
0, since the readers pass them to trackers unchanged. The layout cannot mark an absent
target: its box is ``0,0,0,0``, which no tracker can overlap, so those frames count as
misses in success curves.
"""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import Any, Final

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.formats.files import (
    Entries,
    IndexFiles,
    csv_lines,
    name_lines,
    refuse_iterator,
    write_pictures,
    write_text,
    writing_below,
)
from simbench.datasets.formats.labels import box_lines

__all__ = ["NAMES", "Otb", "alias"]

NAMES: Final = tuple(
    """
    Car1 Car2 Car4 Car24 CarDark CarScale Suv BlurCar2 BlurBody
    Basketball Biker Bird1 Bird2 BlurFace BlurOwl Bolt Bolt2 Box Boy ClifBar Coke Couple
    Coupon Crossing Crowds Dancer Dancer2 David2 David3 Deer Dog Dog1 Doll DragonBaby
    Dudek FaceOcc1 FaceOcc2 Fish FleetFace Football Freeman1 Girl Girl2 Gym Human2
    Human3 Human4 Human5 Human6 Human7 Human8 Human9 Ironman Jump Jumping KiteSurf
    Lemming Liquor Man Matrix Mhyang MotorRolling MountainBike Panda RedTeam Rubik
    Shaking Singer1 Singer2 Skater Skater2 Skating1 Skiing Soccer Subway Surfer
    Sylvester Tiger1 Tiger2 Toy Trans Trellis Twinnings Vase Walking Walking2 Woman
    """.split()
)
"""The names, in the order in which sequences get them."""

_MOST_FRAMES: Final = 9_999  # whose names have four digits, as readers sort them


def alias(position: int) -> str:
    """Return the name of the sequence at a 0-based position.

    Raises
    ------
    DatasetError
        If there are no names left.

    Examples
    --------
    >>> alias(0)
    'Car1'
    """
    if position >= len(NAMES):
        raise DatasetError(
            f"format otb: its readers skip all but {len(NAMES)} names, so a data set "
            f"holds at most {len(NAMES)} sequences: use format got10k for more"
        )
    return NAMES[position]


class Otb:
    """Sequences as OTB stores them; see the module."""

    name = "otb"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`.

        Raises
        ------
        DatasetError
            If ``name`` is none of `NAMES`, or there are more than 9,999 frames, too.
        """
        if name not in NAMES:
            raise DatasetError(
                f"format otb: its readers would silently skip {name!r}: the name must "
                f"be one of {len(NAMES)} names of that benchmark, such as {NAMES[0]!r}"
            )
        if len(sequence) > _MOST_FRAMES:
            raise DatasetError(
                f"format otb: expected at most {_MOST_FRAMES} frames, since the names "
                f"of its pictures have four digits, got {len(sequence)} in "
                f"{sequence.name}"
            )
        folder = root / name
        with writing_below(root):
            write_pictures(
                sequence.frames, lambda i: folder / "img" / f"{i + 1:04d}.jpg"
            )
            rows = box_lines(sequence.truth.boxes)
            write_text(folder / "groundtruth_rect.txt", rows)
        return {"name": name, "scenario": sequence.name, "seed": sequence.seed}

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the map of names, and the list that the VOT toolkit reads."""
        refuse_iterator(entries)
        columns = ("name", "scenario", "seed")
        rows = ([entry[column] for column in columns] for entry in entries)
        yield "names.csv", csv_lines(chain([columns], rows))
        yield "list.txt", name_lines(entries)
