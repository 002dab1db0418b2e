"""A hostile input by name, and the command line to try on it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

__all__ = ["BAD_FILES", "HostileInput", "Maker", "file_of_1_tb"]

Maker = Callable[[Path], list[str]]
"""Writes an input below an empty folder and returns arguments of ``simbench``.

What the command may write goes to ``folder / "out"``. A folder ``folder / "outside"``
stands for the rest of the disk: nothing in it may change.
"""


class HostileInput(NamedTuple):
    """One hostile input: its name, and what makes it."""

    name: str
    make: Maker


def file_of_1_tb(path: Path) -> None:
    """Make a file that tells 1 TB and takes no room on the disk."""
    with path.open("wb") as file:
        file.truncate(2**40)


BAD_FILES: dict[str, Callable[[Path], object]] = {
    "missing file": lambda path: None,
    "folder": Path.mkdir,
    "named pipe": os.mkfifo,
    "link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
    "loop of links": lambda path: path.symlink_to(path),
    "file of 1 TB": file_of_1_tb,
}
"""What may be in the place of a file that is to be read, and what makes it."""
