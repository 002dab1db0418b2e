"""Instance masks in the forms that layouts require: run lengths, boxes, label images.

Our masks are encoded row by row; those of COCO and its successors column by column.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence, VehicleTruth

__all__ = [
    "TARGET_NAME",
    "indexed_png",
    "label_image",
    "segmentation",
    "tight_box",
    "vehicles_with_masks",
]

TARGET_NAME: Final = "target"
"""Name of the target among the vehicles."""


def vehicles_with_masks(sequence: Sequence, layout: str) -> VehicleTruth:
    """Return the truth about all vehicles.

    Raises
    ------
    DatasetError
        If the sequence has no instance masks.
    """
    vehicles = sequence.truth.vehicles
    if vehicles is None or len(vehicles.masks) != len(sequence):
        raise DatasetError(
            f"format {layout}: {sequence.name}: expected an instance mask of every "
            "vehicle, this sequence has none"
        )
    return vehicles


def segmentation(mask: Mask) -> dict[str, Any]:
    """Return a mask as COCO's uncompressed run lengths.

    Returns
    -------
    dict
        ``size``: height and width; ``counts``: lengths of alternating runs in
        column-major order, the first of zeros. Every reader accepts the uncompressed
        form, TrackEval's included.

    Examples
    --------
    >>> segmentation(Mask.from_array(np.array([[False, True], [True, True]])))
    {'size': [2, 2], 'counts': [1, 3]}
    """
    turned = Mask.from_array(mask.to_array().T)
    return {"size": [mask.height, mask.width], "counts": turned.counts.tolist()}


def tight_box(mask: Mask) -> list[int]:
    """Return the box around the pixels that are set: left, top, width, height, px.

    Examples
    --------
    >>> tight_box(Mask.from_array(np.array([[False, False], [False, True]])))
    [1, 1, 1, 1]
    """
    pixels = mask.to_array()
    columns, rows = (np.flatnonzero(pixels.any(axis=axis)) for axis in (0, 1))
    left, top = int(columns[0]), int(rows[0])
    return [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1]


def label_image(
    masks: Mapping[int, Mask], labels: Mapping[int, int], height: int, width: int
) -> NDArray[np.uint8]:
    """Return an image whose values are the labels of the masks.

    Parameters
    ----------
    masks : mapping from id to Mask
        They do not overlap.
    labels : mapping from id to int, in [1, 254]
        Value of the pixels of each.
    height, width : int, px

    Returns
    -------
    (H, W) uint8
        0 outside all masks.
    """
    image = np.zeros((height, width), np.uint8)
    for identity, mask in masks.items():
        image[mask.to_array()] = labels[identity]
    return image


def indexed_png(image: NDArray[np.uint8]) -> bytes:
    """Return an image of object numbers as a PNG file with the palette of DAVIS.

    Parameters
    ----------
    image : (H, W) uint8

    Returns
    -------
    bytes
        Decoding the indices gives the values back; viewers show the colours that DAVIS
        and PASCAL VOC give to their objects. OpenCV writes no palettes.

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
    """Return PASCAL VOC's colours, (256, 3): r, g and b take every third bit."""
    number = np.arange(256)
    colours = np.zeros((256, 3), np.uint8)
    for place in range(8):
        for channel in range(3):
            bit = number >> (3 * place + channel) & 1
            colours[:, channel] |= (bit << (7 - place)).astype(np.uint8)
    return colours
