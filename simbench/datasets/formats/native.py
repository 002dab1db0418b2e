"""The native layout of data sets, which keeps every part of a sequence.

::

    list.txt
    NAME/     see `simbench.datasets.native`
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from simbench.core.sequence import Sequence
from simbench.datasets.formats.files import (
    Entries,
    IndexFiles,
    name_lines,
    write_pictures,
    writing_below,
)
from simbench.datasets.frames import FrameFolder, frame_path
from simbench.datasets.native import write_sequence

__all__ = ["Native"]


class Native:
    """Sequences as `simbench.datasets.native` stores them."""

    name = "native"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        folder = root / name
        with writing_below(root):
            times = write_pictures(sequence.frames, lambda i: frame_path(folder, i))
        write_sequence(folder, replace(sequence, frames=FrameFolder(folder, times)))
        return {"name": name}

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the list of sequences."""
        yield "list.txt", name_lines(entries)
