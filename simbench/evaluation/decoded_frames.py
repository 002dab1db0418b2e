"""Frames decoded once for all runs that a process makes on them one after another.

To decode a picture takes longer than a fast tracker works on it, and many trackers, and
repetitions of one, run on the same film.
"""

from __future__ import annotations

import collections.abc
from typing import Final

from simbench.core.errors import DatasetError
from simbench.core.frame import Frame

__all__ = ["decoded_frames"]

_MOST_BYTES: Final = 256 * 2**20  # 240 frames of 720 x 480 px


def decoded_frames(
    frames: collections.abc.Sequence[Frame], name: str, most_bytes: int = _MOST_BYTES
) -> collections.abc.Sequence[Frame]:
    """Return frames with their images in memory, where there is room for all of them.

    Those of the last call are kept.

    Parameters
    ----------
    frames : sequence of T Frame
        Read from disk when they are used.
    name : str
        Equal for equal frames, other for others; empty to keep none.
    most_bytes : int
        Size of all images up to which they are decoded.

    Returns
    -------
    sequence of T Frame
        ``frames`` as they are without a name, where the images are larger, or where one
        cannot be read: the error is raised when it is read.
    """
    if not name:
        return frames
    if name not in _KEPT:
        _KEPT.clear()
        try:
            if len(frames) * frames[0].image.nbytes > most_bytes:
                return frames
            _KEPT[name] = list(frames)
        except DatasetError:
            return frames
    return _KEPT[name]


_KEPT: dict[str, list[Frame]] = {}
