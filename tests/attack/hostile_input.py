"""A hostile input by name, and the command line to try on it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

__all__ = ["HostileInput", "Maker"]

Maker = Callable[[Path], list[str]]
"""Writes an input below an empty folder and returns arguments of ``simbench``.

What the command may write goes to ``folder / "out"``. A folder ``folder / "outside"``
stands for the rest of the disk: nothing in it may change.
"""


class HostileInput(NamedTuple):
    """One hostile input: its name, and what makes it."""

    name: str
    make: Maker
