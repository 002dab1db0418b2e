"""Size and end of a picture file, seen without decoding it."""

from __future__ import annotations

import struct
from typing import Final

__all__ = ["is_complete_picture", "picture_size"]

_TIFF_WIDTH: Final = 256
_TIFF_HEIGHT: Final = 257
_TIFF_SHORT: Final = 3


def picture_size(content: bytes) -> tuple[int, int]:
    """Return width and height of a picture in px from its first bytes, else zeros.

    Parameters
    ----------
    content : bytes
        Of a PNG, JPEG, TIFF, BMP or WebP file.
    """
    try:
        if content.startswith(b"\x89PNG\r\n\x1a\n"):
            width, height = struct.unpack_from(">II", content, 16)
            return width, height
        if content.startswith(b"\xff\xd8"):
            return _jpeg_header(content)[:2]
        if content.startswith(b"BM"):
            width, height = struct.unpack_from("<ii", content, 18)
            return width, abs(height)  # negative: rows from the top
        if content.startswith(b"RIFF") and content[8:12] == b"WEBP":
            return _webp_size(content)
        return _tiff_size(content)
    except (KeyError, IndexError, struct.error):
        return 0, 0


def is_complete_picture(content: bytes) -> bool:
    """Whether a JPEG or PNG file has its end; true for other kinds of files.

    Decoders fill what is missing of a cut file with grey, and say nothing.
    """
    try:
        if content.startswith(b"\xff\xd8"):
            # beyond the header, which may hold a whole picture of its own
            return content.rfind(b"\xff\xd9") > _jpeg_header(content)[2]
    except (IndexError, struct.error):
        return False
    return not content.startswith(b"\x89PNG") or b"IEND" in content[-256:]


def _jpeg_header(content: bytes) -> tuple[int, int, int]:
    """Return width, height and the place of the first scan of a JPEG file."""
    place, size = 2, (0, 0)
    while content[place] == 0xFF:
        marker = content[place + 1]
        if marker == 0xFF:  # filling
            place += 1
            continue
        (length,) = struct.unpack_from(">H", content, place + 2)
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">HH", content, place + 5)
            size = width, height
        if marker == 0xDA:
            return *size, place
        place += 2 + length
    return 0, 0, len(content)


def _webp_size(content: bytes) -> tuple[int, int]:
    kind = content[12:16]
    if kind == b"VP8X":
        width = int.from_bytes(content[24:27], "little") + 1
        return width, int.from_bytes(content[27:30], "little") + 1
    if kind == b"VP8L":
        bits = int.from_bytes(content[21:25], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    width, height = struct.unpack_from("<HH", content, 26)
    return width & 0x3FFF, height & 0x3FFF


def _tiff_size(content: bytes) -> tuple[int, int]:
    order = {b"II*\0": "<", b"MM\0*": ">"}[content[:4]]
    (start,) = struct.unpack_from(order + "I", content, 4)
    (count,) = struct.unpack_from(order + "H", content, start)
    tags: dict[int, int] = {}
    for entry in range(count):
        place = start + 2 + 12 * entry
        tag, kind = struct.unpack_from(order + "HH", content, place)
        of_type = "H" if kind == _TIFF_SHORT else "I"
        (tags[tag],) = struct.unpack_from(order + of_type, content, place + 8)
    return tags[_TIFF_WIDTH], tags[_TIFF_HEIGHT]
