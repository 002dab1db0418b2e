"""The pictures of a sequence on disk: written one by one, read when they are used."""

from __future__ import annotations

import collections.abc
import copy
from pathlib import Path
from typing import Any, Self, TypeVar, overload

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import read_below
from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.datasets.fast_png import fast_png
from simbench.datasets.picture_header import picture_size

__all__ = [
    "LARGEST_PICTURE",
    "FrameFolder",
    "LazySequence",
    "decoded_as_stored",
    "decoded_picture",
    "encoded_png",
    "frame_path",
    "frame_times",
    "read_file_below",
    "write_file",
    "write_frame",
]

LARGEST_PICTURE = 256 * 2**20  # bytes of a file
_MOST_PIXELS = 2**24
# Boxes are given in stored pixels: a picture is not turned by what its EXIF says.
_AS_RGB = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_IGNORE_ORIENTATION
Item = TypeVar("Item")


class LazySequence(collections.abc.Sequence[Item]):
    """Items of a folder, one a frame, each read from disk whenever it is used.

    A slice is lazy too, and its items keep their number in the whole sequence.

    Parameters
    ----------
    folder : Path
        Sequence folder.
    count : int
        Number of items.
    owner : object, optional
        Kept alive as long as these items, for example the
        `tempfile.TemporaryDirectory` of ``folder``.
    """

    def __init__(self, folder: Path, count: int, *, owner: object = None) -> None:
        self.folder = folder
        self._numbers = range(count)
        self._owner = owner

    def __len__(self) -> int:
        """Return the number of items."""
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> Item: ...
    @overload
    def __getitem__(self, index: slice) -> Self: ...
    def __getitem__(self, index: int | slice) -> Item | Self:
        """Read one item, or return a lazy part."""
        numbers = self._numbers[index]
        if isinstance(numbers, int):
            return self._read(numbers)
        part = copy.copy(self)
        part._numbers = numbers
        return part

    def path(self, index: int) -> Path:
        """Return the file of one of these items."""
        return self._path(self._numbers[index])

    def _path(self, number: int) -> Path:
        raise NotImplementedError

    def _read(self, number: int) -> Item:
        raise NotImplementedError


class FrameFolder(LazySequence[Frame]):
    """The frames of a folder, as (H, W, 3) uint8 RGB, read-only.

    Parameters
    ----------
    folder : Path
        Sequence folder; pictures are in ``frames/`` below it.
    times_s : (T,) float, s
        Time of each frame since the first.
    owner : object, optional
        See `LazySequence`.
    """

    def __init__(
        self, folder: Path, times_s: NDArray[np.float64], *, owner: object = None
    ) -> None:
        super().__init__(folder, len(times_s), owner=owner)
        self._times = np.asarray(times_s, dtype=np.float64)

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Time of each of these frames, (T,) float, s."""
        return self._times[list(self._numbers)]

    def is_all_of(self, folder: Path) -> bool:
        """Whether these are the frames 0 to T - 1 of ``folder``."""
        is_whole = self._numbers == range(len(self))
        return is_whole and self.folder.resolve() == folder.resolve()

    def _path(self, number: int) -> Path:
        return frame_path(self.folder, number)

    def _read(self, number: int) -> Frame:
        path = self._path(number)
        image = decoded_picture(read_file_below(self.folder, path), path)
        image.flags.writeable = False
        return Frame(image, float(self._times[number]), number)


def frame_times(frames: collections.abc.Sequence[Frame]) -> NDArray[np.float64]:
    """Return the time of each frame, (T,) float, s; reads no picture from disk."""
    known = getattr(frames, "times_s", None)
    if known is not None:
        return np.asarray(known, dtype=np.float64)
    return np.array([frame.time_s for frame in frames])


def frame_path(folder: Path, index: int) -> Path:
    """Return the file of the picture of frame ``index``."""
    return folder / "frames" / f"{index:06d}.png"


def write_frame(folder: Path, index: int, image: NDArray[np.uint8]) -> None:
    """Write the picture of one frame.

    Parameters
    ----------
    folder : Path
        Sequence folder; made where missing.
    index : int
        0-based frame number.
    image : (H, W, 3) uint8, RGB

    Raises
    ------
    ValueError
        If the image is not (H, W, 3) uint8.
    DatasetError
        If the file cannot be written.
    """
    write_file(frame_path(folder, index), encoded_png(image))


def read_file_below(folder: Path, path: Path) -> bytes:
    """Return the content of a file of a sequence.

    Raises
    ------
    DatasetError
        Naming it, if it cannot be read, is no regular file, too large, or a link that
        leads out of the sequence's folder.
    """
    return read_below(folder, path.relative_to(folder).as_posix(), LARGEST_PICTURE)


def write_file(path: Path, content: bytes) -> None:
    """Write a file, and its folder, or raise a `DatasetError` that names it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise DatasetError(f"{path}: cannot write: {error.strerror}") from None


def encoded_png(image: NDArray[np.uint8]) -> bytes:
    """Return an (H, W, 3) uint8 RGB picture as the bytes of a PNG file.

    Raises
    ------
    ValueError
        If the image is not (H, W, 3) uint8.
    """
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
        raise ValueError(
            f"image must be (H, W, 3) uint8, got {image.shape} {image.dtype}"
        )
    return fast_png(image)


def decoded_as_stored(content: bytes) -> NDArray[Any] | None:
    """Return a picture decoded in its own type and channels (in OpenCV's order).

    None where the bytes are no picture.
    """
    return _decoded(content, cv2.IMREAD_UNCHANGED)


def decoded_picture(content: bytes, path: Path | str) -> NDArray[np.uint8]:
    """Return the bytes of a picture as (H, W, 3) uint8 RGB.

    Raises
    ------
    DatasetError
        Naming ``path``, if they are no picture.
    """
    found = _decoded(content, _AS_RGB)
    if found is None:
        raise DatasetError(f"{path}: not a readable picture")
    return np.asarray(found, dtype=np.uint8)


def _decoded(content: bytes, mode: int) -> NDArray[Any] | None:
    width, height = picture_size(content)
    if not 0 < width * height <= _MOST_PIXELS:
        return None
    try:
        return cv2.imdecode(np.frombuffer(content, dtype=np.uint8), mode)
    except cv2.error:  # of some damaged files; of others None
        return None
