"""What is recorded beside the pictures of a sequence, on disk: depth and optical flow.

::

    depth/000000.tiff        (H, W) float32: distance along the optical axis, m; sky inf
    flow/000000.flo          (H, W, 2) float32: move to the next frame, px
    occlusions/000000.png    255 where the point is hidden in the next frame
    invalid/000000.png       255 where it is outside the next frame, or nowhere

Float TIFF keeps depth exactly, infinity included, and is read by OpenCV, Pillow, MATLAB
and GDAL; 16-bit PNG would round it. Flow has the layout of MPI Sintel: ``.flo`` keeps
floats of any size, where KITTI's 16-bit PNG rounds to 1/64 px and ends at 512 px, which
a car that passes near the camera exceeds. What a ``.flo`` file does not know is 1e10 in
it and NaN here. The last frame has no flow.
"""

from __future__ import annotations

import collections.abc
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, overload

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.datasets.frames import decoded_as_stored

__all__ = [
    "CHANNELS",
    "ChannelFolder",
    "channels_in",
    "clear_channels",
    "require_known",
    "write_channel",
    "write_channels",
]

CHANNELS = ("depth", "flow")
"""What can be asked for."""

_PARTS = {"depth": ("depth",), "flow": ("flow", "occlusions", "invalid")}
_SUFFIX = {"depth": "tiff", "flow": "flo", "occlusions": "png", "invalid": "png"}
_MAGIC = np.float32(202021.25)  # "PIEH", what a .flo file begins with
_UNKNOWN = np.float32(1e10)
_KNOWN_BELOW = 1e9
# A third of the bytes of bare floats, at 8 ms a frame of 480 x 320; deflate takes
# three times as long for a seventh less, measured on a road.
_LZW = [cv2.IMWRITE_TIFF_COMPRESSION, 5]


class ChannelFolder(collections.abc.Sequence[NDArray[Any]]):
    """One channel of a sequence, read from disk each time a frame is asked for.

    Parameters
    ----------
    folder : Path
        Sequence folder.
    name : str
        ``depth``, ``flow``, ``occlusions`` or ``invalid``.
    count : int
        How many frames have it.
    owner : object, optional
        Kept alive as long as this, see `simbench.datasets.native.FrameFolder`.
    """

    def __init__(
        self, folder: Path, name: str, count: int, *, owner: object = None
    ) -> None:
        self.folder = folder
        self.name = name
        self._numbers = range(count)
        self._owner = owner

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> NDArray[Any]: ...
    @overload
    def __getitem__(self, index: slice) -> ChannelFolder: ...
    def __getitem__(self, index: int | slice) -> NDArray[Any] | ChannelFolder:
        """Read one frame, or return a lazy part."""
        if isinstance(index, slice):
            part = ChannelFolder(self.folder, self.name, 0, owner=self._owner)
            part._numbers = self._numbers[index]
            return part
        return _read(self.name, self.path(index))

    def path(self, index: int) -> Path:
        """Return the file of one of these frames."""
        return _path(self.folder, self.name, self._numbers[index])


def require_known(channels: collections.abc.Iterable[str]) -> tuple[str, ...]:
    """Return the channels asked for in the order of `CHANNELS`, each once.

    Raises
    ------
    DatasetError
        If one is not known.
    """
    wanted = tuple(channels)
    for name in wanted:
        if name not in CHANNELS:
            known = ", ".join(CHANNELS)
            raise DatasetError(f"channels must be among {known}, got {name!r}")
    return tuple(name for name in CHANNELS if name in wanted)


def write_channel(folder: Path, name: str, index: int, array: NDArray[Any]) -> None:
    """Write one frame of one channel.

    Parameters
    ----------
    folder : Path
        Sequence folder; made where missing.
    name : str
    index : int
    array : (H, W) or (H, W, 2)

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    path = _path(folder, name, index)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(_encoded(name, array))
    except OSError as error:
        raise DatasetError(f"{path}: cannot write: {error.strerror}") from None


def write_channels(
    folder: Path, channels: Mapping[str, collections.abc.Sequence[NDArray[Any]]]
) -> None:
    """Write all channels of a sequence, one frame at a time.

    Those that stand in ``folder`` already are left alone, those on disk elsewhere are
    copied byte by byte.
    """
    for name, frames in channels.items():
        if not isinstance(frames, ChannelFolder):
            for index, array in enumerate(frames):
                write_channel(folder, name, index, array)
        elif frames.folder.resolve() != folder.resolve():
            for index in range(len(frames)):
                there = _path(folder, name, index)
                there.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(frames.path(index), there)


def channels_in(
    folder: Path,
    asked: collections.abc.Iterable[str],
    frames: int,
    *,
    owner: object = None,
) -> dict[str, ChannelFolder]:
    """Return the channels of a sequence in a folder, flow with its masks.

    Parameters
    ----------
    folder : Path
    asked : iterable of str
        Of `CHANNELS`.
    frames : int
        Of the sequence.
    owner : object, optional
        See `ChannelFolder`.
    """
    names = [name for channel in asked for name in _PARTS[channel]]
    counts = {name: frames if name == "depth" else frames - 1 for name in names}
    return {
        name: ChannelFolder(folder, name, count, owner=owner)
        for name, count in counts.items()
    }


def clear_channels(folder: Path) -> None:
    """Remove the channels of an earlier sequence."""
    for name, suffix in _SUFFIX.items():
        for path in (folder / name).glob(f"[0-9]*.{suffix}"):
            path.unlink()


def _path(folder: Path, name: str, index: int) -> Path:
    return folder / name / f"{index:06d}.{_SUFFIX[name]}"


def _encoded(name: str, array: NDArray[Any]) -> bytes:
    if name == "flow":
        height, width = array.shape[:2]
        head = np.array([_MAGIC], "<f4").tobytes()
        size = np.array([width, height], "<i4").tobytes()
        known = np.where(np.isnan(array), _UNKNOWN, array)
        return head + size + known.astype("<f4").tobytes()
    if name == "depth":
        _, encoded = cv2.imencode(".tiff", np.asarray(array, np.float32), _LZW)
        return encoded.tobytes()
    _, encoded = cv2.imencode(".png", np.where(array, 255, 0).astype(np.uint8))
    return encoded.tobytes()


def _read(name: str, path: Path) -> NDArray[Any]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DatasetError(f"{path}: cannot read: {error.strerror}") from None
    decoded = _decoded_flow if name == "flow" else decoded_as_stored
    array = decoded(content)
    if array is None:
        raise DatasetError(f"{path}: not a readable {name} file")
    if name in ("occlusions", "invalid"):
        array = array > 0
    array.flags.writeable = False
    return array


def _decoded_flow(content: bytes) -> NDArray[Any] | None:
    if len(content) < 12 or np.frombuffer(content, "<f4", 1)[0] != _MAGIC:
        return None
    width, height = np.frombuffer(content, "<i4", 2, offset=4).tolist()
    if width < 1 or height < 1 or len(content) != 12 + 8 * width * height:
        return None
    values = np.frombuffer(content, "<f4", offset=12).reshape(height, width, 2)
    return np.where(np.abs(values) > _KNOWN_BELOW, np.float32(np.nan), values)
