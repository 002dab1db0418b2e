"""The bench's own layout as one to write data sets in: nothing is lost.

::

    list.txt
    NAME/     see `simbench.datasets.native`
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from simbench.core.sequence import Sequence
from simbench.datasets.formats.files import write_pictures, writing_below
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

    def index(
        self, entries: Iterable[Mapping[str, Any]]
    ) -> Iterator[tuple[str, Iterable[str]]]:
        """Yield the list of sequences."""
        yield "list.txt", (f"{entry['name']}\n" for entry in entries)
