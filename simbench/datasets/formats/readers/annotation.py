"""What all readers share: where a sequence is, how to read it, and what is found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from simbench.core import sequence as core
from simbench.datasets.formats.readers.pictures import Pictures

__all__ = ["DEFAULT_RATE_HZ", "Annotation", "Place", "ReadOptions", "Reader"]

DEFAULT_RATE_HZ: Final = 30.0
"""Frame rate where a layout does not tell it, as in the VOT toolkit."""


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What a user says about data that do not say it themselves.

    Attributes
    ----------
    layout : str
        Name of the layout; empty to tell it from the files.
    origin : int or None
        Number of the first pixel column and row in boxes, 0 or 1; None: as usual in
        the layout.
    box : (4,) float or None, px
        The target in the first frame of a video or a folder of pictures: left, top,
        width, height, from the outer corner of the picture.
    target : str
        Which of several annotated objects; empty: all of them, or the only one.
    """

    layout: str = ""
    origin: int | None = None
    box: tuple[float, float, float, float] | None = None
    target: str = ""


@dataclass(frozen=True, slots=True)
class Place:
    """One sequence on disk.

    Attributes
    ----------
    layout : str
        Name of its reader.
    root : Path
        Folder below which all of its files are; nothing outside is read.
    folder : str
        The sequence below ``root``, parts separated by ``/``; empty: the root itself.
    name : str
        Name in tables.
    target : str
        Which of several annotated objects; empty for the only one.
    """

    layout: str
    root: Path
    folder: str
    name: str
    target: str = ""

    def path(self, name: str) -> str:
        """Return a file of the sequence as a path below ``root``."""
        return f"{self.folder}/{name}" if self.folder else name

    def has(self, name: str) -> bool:
        """Whether the sequence has a file of that name."""
        return (self.root / self.path(name)).is_file()


@dataclass(frozen=True, slots=True)
class Annotation:
    """The pictures of a sequence, and what its files tell about its target.

    Attributes
    ----------
    pictures : Pictures
        T of them.
    boxes : (T, 4) float, px
        ``left, top, width, height`` as in the files, the origin included. NaN where
        the target is absent or its box is not known.
    absent : (T,) bool
    files : tuple of str
        The files beside the pictures, below the root, the one with the boxes first.
    lines : (T,) int or None
        Line of each box in the first of ``files``, from 1.
    rate_hz : float, 1/s
    origin : int
        Number of the first pixel column and row in these boxes, as is usual in the
        layout.
    visible_fraction : (T,) float or None
        NaN, or None, where unknown, as the following.
    visible_boxes : (T, 4) float or None, px
    cut_by_image : (T,) bool or None
    labels : mapping from str to (T,) float
        Labelled attributes, see `simbench.core.sequence.Sequence.attributes`.
    whole : Sequence or None
        All of it, where the layout is our own.
    """

    pictures: Pictures
    boxes: NDArray[np.float64]
    absent: NDArray[np.bool_]
    files: tuple[str, ...]
    lines: NDArray[np.int64] | None = None
    rate_hz: float = DEFAULT_RATE_HZ
    origin: int = 0
    visible_fraction: NDArray[np.float64] | None = None
    visible_boxes: NDArray[np.float64] | None = None
    cut_by_image: NDArray[np.bool_] | None = None
    labels: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    whole: core.Sequence | None = None


class Reader(Protocol):
    """Reader of one layout.

    Attributes
    ----------
    name : str
    """

    @property
    def name(self) -> str: ...

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the sequences that a folder is, or holds as a data set's root.

        Empty if it is none of this layout. Folders below are looked at separately.

        Raises
        ------
        DatasetError
            If it is one of this layout that cannot be understood.
        """
        ...

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read the annotation of a sequence that `find` returned.

        Raises
        ------
        DatasetError
            In one line that names file and line number, if it is damaged.
        """
        ...
