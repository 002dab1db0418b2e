"""Reader of simbench's own layout, see `simbench.datasets.native`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from simbench.datasets.formats.readers.annotation import (
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.pictures import Pictures
from simbench.datasets.frames import frame_path
from simbench.datasets.native import is_finished, read_sequence

__all__ = ["NativeReader"]


class NativeReader:
    """Sequences that simbench wrote with all of their truth."""

    name = "native"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the place of the sequence."""
        root = folder.absolute()
        return [Place(self.name, root, "", root.name)] if is_finished(root) else []

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read the sequence, see `Reader.read`."""
        sequence = read_sequence(place.root)
        names = [
            frame_path(place.root, i).relative_to(place.root).as_posix()
            for i in range(len(sequence))
        ]
        tables = [f"truth/{n}.parquet" for n in ("target", "vehicles", "cameras")]
        return Annotation(
            Pictures(place.root, tuple(names)),
            sequence.truth.boxes,
            sequence.truth.absent,
            ("sequence.json", *tables),
            whole=sequence,
        )
