"""Data sets as others write them, made of small numbered pictures."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence

WIDTH, HEIGHT = 64, 48
Row = tuple[float, ...]

BOXES: tuple[Row, ...] = (
    (10, 12, 8, 6),
    (12, 12, 8, 6),
    (14, 13, 8, 6),
    (16, 13, 8, 6),
)
"""Boxes that stay in the picture, as left, top, width, height."""


def picture(index: int, width: int = WIDTH, height: int = HEIGHT) -> NDArray[np.uint8]:
    """Return an RGB picture of noise whose level tells its index, see `indices`."""
    rng = np.random.default_rng(index)
    noise = rng.integers(0, 40, (height, width, 3), dtype=np.uint8)
    return noise + np.uint8(index % 7 * 30)


def indices(sequence: Sequence) -> list[int]:
    """Return the index of each picture of a sequence, modulo 7."""
    return [round((float(f.image.mean()) - 19.5) / 30.0) for f in sequence.frames]


def write_picture(
    path: Path, index: int, width: int = WIDTH, height: int = HEIGHT
) -> None:
    """Write a picture in the format of its suffix."""
    path.parent.mkdir(parents=True, exist_ok=True)
    image = picture(index, width, height)[..., ::-1]
    assert cv2.imwrite(str(path), image)


def write_pictures(folder: Path, pattern: str, numbers: Iterable[int]) -> None:
    """Write pictures named by a pattern such as ``{:04d}.jpg``."""
    for index, number in enumerate(numbers):
        write_picture(folder / pattern.format(number), index)


def write_rows(
    path: Path, rows: Iterable[Iterable[object]], between: str = ","
) -> None:
    """Write lines of values."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = (between.join(map(str, row)) + "\n" for row in rows)
    path.write_text("".join(lines))


def write_otb(
    folder: Path,
    rows: Iterable[Iterable[object]] = BOXES,
    *,
    between: str = ",",
    pattern: str = "{:04d}.jpg",
    frames: int = 4,
) -> Path:
    """Write a sequence as in OTB and return its folder."""
    write_pictures(folder / "img", pattern, range(1, frames + 1))
    write_rows(folder / "groundtruth_rect.txt", rows, between)
    return folder
