"""Lists of the numbered pictures of a folder."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final

from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.pictures import Pictures

__all__ = ["PICTURE_SUFFIXES", "has_pictures", "numbered_pictures"]

PICTURE_SUFFIXES: Final = {".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp"}
_MOST_FRAMES: Final = 1_000_000


def has_pictures(folder: Path) -> bool:
    """Whether a folder holds a picture."""
    try:
        with os.scandir(folder) as entries:
            return any(Path(e.name).suffix.lower() in PICTURE_SUFFIXES for e in entries)
    except OSError:
        return False


def numbered_pictures(root: Path, folder: str) -> Pictures:
    """Return the pictures of a folder in the order of the numbers in their names.

    Parameters
    ----------
    root : Path
    folder : str
        Below ``root``; empty for the root itself.

    Raises
    ------
    DatasetError
        If there are none, one of them is missing between two numbers, or two have
        the same number.
    """
    place = root / folder
    try:
        with os.scandir(place) as entries:
            names = [entry.name for entry in entries if entry.name[0] != "."]
    except OSError as error:
        raise DatasetError(f"{place}: cannot be read: {error.strerror}") from None
    names = [n for n in names if Path(n).suffix.lower() in PICTURE_SUFFIXES]
    if not 0 < len(names) <= _MOST_FRAMES:
        raise DatasetError(
            f"{place}: expected 1 to {_MOST_FRAMES} pictures, got {len(names)}"
        )
    names.sort(key=_natural)
    _require_no_gap(place, names)
    return Pictures(root, tuple(f"{folder}/{n}" if folder else n for n in names))


def _natural(name: str) -> tuple[list[tuple[int, str]], str]:
    """Return a key that sorts ``2.jpg`` before ``10.jpg``."""
    parts = re.findall(r"\d+|\D+", Path(name).stem, flags=re.ASCII)
    keys = [(int(p), "") if p.isdigit() and p.isascii() else (-1, p) for p in parts]
    return keys, name


def _require_no_gap(folder: Path, names: list[str]) -> None:
    stems = [re.fullmatch(r"(.*?)(\d{1,9})", Path(n).stem, re.ASCII) for n in names]
    found = [stem for stem in stems if stem is not None]
    if len(found) < len(names) or len({stem[1] for stem in found}) > 1:
        return  # names of another kind have an order, but no numbers to miss
    for before, after, name in zip(found, found[1:], names[1:], strict=False):
        number, got = int(before[2]) + 1, int(after[2])
        if got < number:
            raise DatasetError(
                f"{folder / name}: expected one picture of number {got}, got two"
            )
        if got > number:
            missing = f"{after[1]}{number:0{len(before[2])}d}{Path(name).suffix}"
            raise DatasetError(
                f"{folder / missing}: missing, the next picture is {name}"
            )
