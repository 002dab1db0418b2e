"""The file that receives what workers print, kept from growing without bound."""

from __future__ import annotations

import os
from pathlib import Path

from simbench.core.atomic_write import atomic_write

__all__ = ["shorten"]

_LONGEST = 1_000_000  # bytes


def shorten(log: Path) -> None:
    """Cut a log to its last megabyte, from the beginning of a line on.

    To call while nothing is written to it. A missing file stays missing.

    Raises
    ------
    DatasetError
        If it cannot be read or written.
    """
    if not log.is_file() or log.stat().st_size <= _LONGEST:
        return
    with atomic_write(log) as shorter, log.open("rb") as file:
        file.seek(-_LONGEST, os.SEEK_END)
        end = file.read()
        shorter.write_bytes(end[end.find(b"\n") + 1 :])
