"""The pictures of a sequence on disk: written one by one, read when asked for."""

from __future__ import annotations

import collections.abc
from pathlib import Path
from typing import Any, overload

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.frame import Frame

__all__ = [
    "FrameFolder",
    "decoded_as_stored",
    "decoded_picture",
    "encoded_png",
    "frame_path",
    "write_frame",
]

# Sensor noise leaves PNG's match search little to find: Huffman codes alone are both
# smaller (57 against 64 % of raw) and faster (31 against 43 ms at 720 x 480) than
# level 1 with matches, measured on a noisy road picture.
_PNG = [
    cv2.IMWRITE_PNG_COMPRESSION,
    1,
    cv2.IMWRITE_PNG_STRATEGY,
    cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY,
]


class FrameFolder(collections.abc.Sequence[Frame]):
    """The frames of a folder, read from disk each time one is asked for.

    Parameters
    ----------
    folder : Path
        Sequence folder; pictures are in ``frames/`` below it.
    times_s : (T,) float, s
        Time of each frame since the first.
    owner : object, optional
        Kept alive as long as these frames, for example the
        `tempfile.TemporaryDirectory` that ``folder`` lies in.

    Notes
    -----
    Images are (H, W, 3) uint8 RGB and read-only. A slice is again lazy, and its frames
    keep their ``index`` in the whole sequence.
    """

    def __init__(
        self, folder: Path, times_s: NDArray[np.float64], *, owner: object = None
    ) -> None:
        self.folder = folder
        self._times = np.asarray(times_s, dtype=np.float64)
        self._numbers = range(len(self._times))
        self._owner = owner

    @property
    def times_s(self) -> NDArray[np.float64]:
        """Time of each of these frames, (T,) float, s."""
        return self._times[list(self._numbers)]

    def stands_in(self, folder: Path) -> bool:
        """Whether these are the frames 0 to T - 1 of ``folder``."""
        whole = self._numbers == range(len(self))
        return whole and self.folder.resolve() == folder.resolve()

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> FrameFolder: ...
    def __getitem__(self, index: int | slice) -> Frame | FrameFolder:
        """Read one frame, or return a lazy part."""
        if isinstance(index, slice):
            part = FrameFolder(self.folder, self._times, owner=self._owner)
            part._numbers = self._numbers[index]
            return part
        number = self._numbers[index]
        image = _read_image(self.path(index))
        return Frame(image, float(self._times[number]), number)

    def path(self, index: int) -> Path:
        """Return the PNG file of one of these frames."""
        return frame_path(self.folder, self._numbers[index])


def frame_path(folder: Path, index: int) -> Path:
    """Return where the picture of frame ``index`` stands."""
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
    path = frame_path(folder, index)
    encoded = encoded_png(image)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(encoded)
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
    _, encoded = cv2.imencode(".png", image[..., ::-1], _PNG)
    return encoded.tobytes()


def decoded_as_stored(content: bytes) -> NDArray[Any] | None:
    """Return what the bytes of a picture hold, in its own type and channels (OpenCV's).

    None where they are no picture.
    """
    return _decoded(content, cv2.IMREAD_UNCHANGED)


def decoded_picture(content: bytes, path: Path | str) -> NDArray[np.uint8]:
    """Return the bytes of a picture as (H, W, 3) uint8 RGB.

    Raises
    ------
    DatasetError
        Naming ``path``, if they are no picture.
    """
    found = _decoded(content, cv2.IMREAD_COLOR_RGB)
    if found is None:
        raise DatasetError(f"{path}: not a readable picture")
    return np.asarray(found, dtype=np.uint8)


def _decoded(content: bytes, mode: int) -> NDArray[Any] | None:
    # imdecode refuses an empty buffer with a C++ exception, other rubbish with None
    encoded = np.frombuffer(content, dtype=np.uint8)
    return cv2.imdecode(encoded, mode) if encoded.size else None


def _read_image(path: Path) -> NDArray[np.uint8]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DatasetError(f"{path}: cannot read: {error.strerror}") from None
    image = decoded_picture(content, path)
    image.flags.writeable = False
    return image
