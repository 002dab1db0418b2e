"""The pictures of a sequence where they are: files of any name, or a video."""

from __future__ import annotations

import collections.abc
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, overload

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import open_below, read_below
from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.datasets.frames import (
    LARGEST_PICTURE,
    LazySequence,
    decoded_picture,
)
from simbench.datasets.picture_header import picture_size

__all__ = [
    "VIDEO_SUFFIXES",
    "PictureFrames",
    "Pictures",
    "VideoFrames",
    "count_frames",
    "frames_of",
    "video_facts",
]

VIDEO_SUFFIXES: Final = {
    ".mp4", ".avi", ".mov", ".mkv", ".webm", ".mpg", ".mpeg", ".m4v", ".wmv"
}  # fmt: skip
_MOST_FRAMES: Final = 1_000_000
_LARGEST_VIDEO: Final = 2**37  # bytes


@dataclass(frozen=True, slots=True)
class Pictures:
    """Where the pictures of a sequence are.

    Attributes
    ----------
    root : Path
        Folder below which they are.
    files : tuple of str
        Paths below ``root``: one a frame, or one video.
    video_frames : int
        Number of frames of a video; 0 for files.
    """

    root: Path
    files: tuple[str, ...]
    video_frames: int = 0

    def __len__(self) -> int:
        """Return the number of frames."""
        return self.video_frames or len(self.files)

    def part(self, first: int, end: int) -> Pictures:
        """Return those of frames ``first`` to ``end - 1``, for files only."""
        return Pictures(self.root, self.files[first:end])

    def name(self, index: int) -> Path:
        """Return the file of a frame, for messages."""
        return self.root / self.files[0 if self.video_frames else index]

    def size(self) -> tuple[int, int]:
        """Return width and height of the first in px.

        Raises
        ------
        DatasetError
            If it is not readable.
        """
        if self.video_frames:
            return video_facts(self.root, self.files[0])[:2]
        content = read_below(self.root, self.files[0], LARGEST_PICTURE)
        width, height = picture_size(content)
        if width < 1 or height < 1:
            reason = "not a readable picture" if content else "an empty file"
            raise DatasetError(f"{self.name(0)}: expected a picture, got {reason}")
        return width, height


class PictureFrames(LazySequence[Frame]):
    """Frames in files of any name, as (H, W, 3) uint8 RGB, read when they are used.

    Parameters
    ----------
    pictures : Pictures
        T files.
    times_s : (T,) float, s
    width, height : int, px
        Size that each must have.
    """

    def __init__(
        self,
        pictures: Pictures,
        times_s: NDArray[np.float64],
        width: int,
        height: int,
    ) -> None:
        super().__init__(pictures.root, len(pictures))
        self.pictures = pictures
        self._times = np.asarray(times_s, dtype=np.float64)
        self._size = width, height

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Time of each of these frames, (T,) float, s."""
        return self._times[list(self._numbers)]

    def _path(self, number: int) -> Path:
        return self.pictures.name(number)

    def _read(self, number: int) -> Frame:
        name = self.pictures.files[number]
        content = read_below(self.folder, name, LARGEST_PICTURE)
        image = decoded_picture(content, self._path(number))
        _require_size(image, self._size, self._path(number))
        image.flags.writeable = False
        return Frame(image, float(self._times[number]), number)


class VideoFrames(collections.abc.Sequence[Frame]):
    """Frames of a video, decoded one after another.

    To go back, decoding begins again at the start: seeking in a video is not exact.

    Parameters
    ----------
    pictures : Pictures
        One video.
    times_s : (T,) float, s
    width, height : int, px
    """

    def __init__(
        self,
        pictures: Pictures,
        times_s: NDArray[np.float64],
        width: int,
        height: int,
    ) -> None:
        self.pictures = pictures
        self.times_s = np.asarray(times_s, dtype=np.float64)
        self._size = width, height
        self._capture: Any = None  # of OpenCV
        self._next = 0

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.times_s)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        """Decode one frame, or several."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        number = range(len(self))[index]
        if self._capture is None or number < self._next:
            self._capture, self._next = _opened(self.pictures), 0
        while self._next < number:
            self._capture.grab()
            self._next += 1
        found, image = self._capture.read()
        self._next += 1
        where = f"{self.pictures.name(0)}: frame {number}"
        if not found:
            raise DatasetError(f"{where}: cannot be decoded")
        _require_size(image, self._size, where)
        picture = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
        picture.flags.writeable = False
        return Frame(np.asarray(picture, np.uint8), float(self.times_s[number]), number)

    def __getstate__(self) -> dict[str, Any]:
        """Return all but the decoder, which each process opens for itself."""
        return self.__dict__ | {"_capture": None, "_next": 0}


def frames_of(
    pictures: Pictures, times_s: NDArray[np.float64], width: int, height: int
) -> PictureFrames | VideoFrames:
    """Return the frames of pictures, lazily."""
    kind: Callable[..., PictureFrames | VideoFrames]
    kind = VideoFrames if pictures.video_frames else PictureFrames
    return kind(pictures, times_s, width, height)


def video_facts(root: Path, relative: str) -> tuple[int, int, float]:
    """Return width and height [px] and rate [1/s] of a video.

    Raises
    ------
    DatasetError
        If it cannot be opened.
    """
    capture = _opened(Pictures(root, (relative,), 1))
    keys = cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FPS
    width, height, rate = map(capture.get, keys)
    return int(width), int(height), rate if 0.01 <= rate <= 1e5 else 0.0


def count_frames(root: Path, relative: str) -> int:
    """Return the number of frames of a video, by going through it.

    What its header says is often wrong.
    """
    capture = _opened(Pictures(root, (relative,), 1))
    count = 0
    while count <= _MOST_FRAMES and capture.grab():
        count += 1
    if not 0 < count <= _MOST_FRAMES:
        raise DatasetError(
            f"{root / relative}: expected a video of 1 to {_MOST_FRAMES} frames, "
            f"got {'more' if count else 'none'}"
        )
    return count


def _opened(pictures: Pictures) -> Any:
    open_below(pictures.root, pictures.files[0], _LARGEST_VIDEO).close()
    path = pictures.name(0)
    capture = cv2.VideoCapture(
        os.fspath(path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1]
    )
    if not capture.isOpened():
        raise DatasetError(f"{path}: expected a video, got another or a damaged file")
    return capture


def _require_size(
    image: NDArray[Any], size: tuple[int, int], where: Path | str
) -> None:
    height, width = image.shape[:2]
    if (width, height) != size:
        raise DatasetError(
            f"{where}: expected {size[0]} x {size[1]} px as the first frame, "
            f"got {width} x {height}"
        )
