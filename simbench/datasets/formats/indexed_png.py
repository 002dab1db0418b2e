"""PNG pictures whose pixels are numbers of objects, shown in the colours of DAVIS."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

__all__ = ["indexed_png"]


def indexed_png(image: NDArray[np.uint8]) -> bytes:
    """Return an image of object numbers as a PNG file with a palette.

    Parameters
    ----------
    image : (H, W) uint8

    Returns
    -------
    bytes
        Readers that ask for the indices get the values back; viewers show the colours
        that DAVIS and PASCAL VOC give to their objects. OpenCV writes no palettes.

    References
    ----------
    PNG specification, third edition (W3C 2025), sections 5 and 11.
    """
    height, width = image.shape
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    rows = np.zeros((height, width + 1), np.uint8)  # column 0: no filter
    rows[:, 1:] = image
    chunks = [
        (b"IHDR", header),
        (b"PLTE", _palette().tobytes()),
        (b"IDAT", zlib.compress(rows.tobytes(), 6)),
        (b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*chunk) for chunk in chunks)


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = struct.pack(">I", zlib.crc32(kind + content))
    return struct.pack(">I", len(content)) + kind + content + check


def _palette() -> NDArray[np.uint8]:
    """Return PASCAL VOC's colours, (256, 3): the number's bits dealt out to r, g, b."""
    number = np.arange(256)
    colours = np.zeros((256, 3), np.uint8)
    for place in range(8):
        for channel in range(3):
            bit = number >> (3 * place + channel) & 1
            colours[:, channel] |= (bit << (7 - place)).astype(np.uint8)
    return colours
