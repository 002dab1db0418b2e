"""Readers of what has no annotation: a video, or a folder of pictures, with a box.

The box of the first frame starts the trackers; nothing else is known of the target, so
no measure that needs it is computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import (
    DEFAULT_RATE_HZ,
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.picture_list import (
    has_pictures,
    numbered_pictures,
)
from simbench.datasets.formats.readers.pictures import (
    VIDEO_SUFFIXES,
    Pictures,
    count_frames,
    video_facts,
)

__all__ = ["PicturesReader", "VideoReader"]


class VideoReader:
    """A video file."""

    name = "video"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the place of the file."""
        path = folder.absolute()
        if path.suffix.lower() not in VIDEO_SUFFIXES or not path.is_file():
            return []
        return [Place(self.name, path.parent, path.name, path.stem)]

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read the video, see `Reader.read`."""
        boxes = _first_box(place, options)
        rate = video_facts(place.root, place.folder)[2] or DEFAULT_RATE_HZ
        count = count_frames(place.root, place.folder)
        pictures = Pictures(place.root, (place.folder,), count)
        return _unknown(pictures, boxes, rate)


class PicturesReader:
    """A folder of pictures."""

    name = "pictures"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the place of the folder, if a box is given for it."""
        path = folder.absolute()
        is_meant = options.box is not None or options.layout == self.name
        if not is_meant or not path.is_dir() or not has_pictures(path):
            return []
        return [Place(self.name, path, "", path.name)]

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read the folder, see `Reader.read`."""
        boxes = _first_box(place, options)
        pictures = numbered_pictures(place.root, place.folder)
        return _unknown(pictures, boxes, DEFAULT_RATE_HZ)


def _first_box(place: Place, options: ReadOptions) -> NDArray[np.float64]:
    if options.box is None:
        raise DatasetError(
            f"{place.root / place.folder}: expected --box left,top,width,height of the "
            "target in the first frame, since there is no annotation"
        )
    return np.array([options.box])


def _unknown(
    pictures: Pictures, first: NDArray[np.float64], rate_hz: float
) -> Annotation:
    count = len(pictures)
    boxes = np.concatenate([first, np.full((count - 1, 4), np.nan)])
    return Annotation(pictures, boxes, np.zeros(count, np.bool_), (), None, rate_hz)
