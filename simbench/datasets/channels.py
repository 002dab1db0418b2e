"""Channels of a sequence on disk: depth and optical flow, beside the pictures.

::

    depth/000000.tiff        (H, W) float32: distance along the optical axis, m; sky inf
    flow/000000.flo          (H, W, 2) float32: displacement to the next frame, px
    occlusions/000000.png    255 where the point is hidden in the next frame
    invalid/000000.png       255 where it is outside the next frame, or undefined

Float TIFF keeps depth exactly, infinity included, and is read by OpenCV, Pillow, MATLAB
and GDAL; 16-bit PNG would round it. Flow has the layout of MPI Sintel: ``.flo`` keeps
floats of any size, where KITTI's 16-bit PNG rounds to 1/64 px and ends at 512 px, which
a car that passes near the camera exceeds. Unknown flow is 1e10 in a ``.flo`` file and
NaN here. The last frame has no flow.
"""

from __future__ import annotations

import collections.abc
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.datasets.frames import (
    LazySequence,
    decoded_as_stored,
    read_file_below,
    write_file,
)

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
"""Names of the channels."""

_PARTS = {"depth": ("depth",), "flow": ("flow", "occlusions", "invalid")}
_SUFFIX = {"depth": "tiff", "flow": "flo", "occlusions": "png", "invalid": "png"}
_MAGIC = np.float32(202021.25)  # "PIEH", what a .flo file begins with
_UNKNOWN = np.float32(1e10)
_KNOWN_BELOW = 1e9
# A third of the bytes of bare floats, at 8 ms a frame of 480 x 320; deflate takes
# three times as long for a seventh less, measured on a road.
_LZW = [cv2.IMWRITE_TIFF_COMPRESSION, 5]


class ChannelFolder(LazySequence[NDArray[Any]]):
    """One channel of a sequence, as arrays, read-only.

    Parameters
    ----------
    folder : Path
        Sequence folder.
    name : str
        ``depth``, ``flow``, ``occlusions`` or ``invalid``.
    count : int
        How many frames have it.
    owner : object, optional
        See `simbench.datasets.frames.LazySequence`.
    """

    def __init__(
        self, folder: Path, name: str, count: int, *, owner: object = None
    ) -> None:
        super().__init__(folder, count, owner=owner)
        self.name = name

    def _path(self, number: int) -> Path:
        return _path(self.folder, self.name, number)

    def _read(self, number: int) -> NDArray[Any]:
        path = self._path(number)
        decoded = _decoded_flow if self.name == "flow" else decoded_as_stored
        array = decoded(read_file_below(self.folder, path))
        if array is None:
            raise DatasetError(f"{path}: not a readable {self.name} file")
        if self.name in ("occlusions", "invalid"):
            array = array > 0
        array.flags.writeable = False
        return array


def require_known(channels: collections.abc.Iterable[str]) -> tuple[str, ...]:
    """Return the requested channels in the order of `CHANNELS`, each once.

    Raises
    ------
    DatasetError
        If one is not known.
    """
    requested = dict.fromkeys(channels)
    for name in requested:
        if name not in CHANNELS:
            known = ", ".join(CHANNELS)
            raise DatasetError(f"channels must be among {known}, got {name!r}")
    return tuple(name for name in CHANNELS if name in requested)


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
    write_file(_path(folder, name, index), _encoded(name, array))


def write_channels(
    folder: Path, channels: Mapping[str, collections.abc.Sequence[NDArray[Any]]]
) -> None:
    """Write all channels of a sequence, one frame at a time.

    Those of ``folder`` itself are left as they are, those of other folders are copied
    byte by byte.
    """
    for name, frames in channels.items():
        if not isinstance(frames, ChannelFolder):
            for index, array in enumerate(frames):
                write_channel(folder, name, index, array)
        elif frames.folder.resolve() != folder.resolve():
            for index in range(len(frames)):
                copy = _path(folder, name, index)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(frames.path(index), copy)


def channels_in(
    folder: Path,
    channels: collections.abc.Iterable[str],
    frames: int,
    *,
    owner: object = None,
) -> dict[str, ChannelFolder]:
    """Return the channels of a sequence in a folder, flow with its masks.

    Parameters
    ----------
    folder : Path
    channels : iterable of str
        Of `CHANNELS`.
    frames : int
        Number of frames of the sequence.
    owner : object, optional
        See `ChannelFolder`.
    """
    return {
        name: ChannelFolder(folder, name, frames - (name != "depth"), owner=owner)
        for channel in channels
        for name in _PARTS[channel]
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


def _decoded_flow(content: bytes) -> NDArray[Any] | None:
    if len(content) < 12 or np.frombuffer(content, "<f4", 1)[0] != _MAGIC:
        return None
    width, height = np.frombuffer(content, "<i4", 2, offset=4).tolist()
    if width < 1 or height < 1 or len(content) != 12 + 8 * width * height:
        return None
    values = np.frombuffer(content, "<f4", offset=12).reshape(height, width, 2)
    return np.where(np.abs(values) > _KNOWN_BELOW, np.float32(np.nan), values)
