"""The native layout of the VOT toolkit: one folder a sequence, one region a line.

::

    sequences/list.txt
    sequences/NAME/sequence              key=value lines
    sequences/NAME/color/00000001.png    1-based
    sequences/NAME/groundtruth.txt       left,top,width,height
    sequences/NAME/*.tag                 0 or 1 a line: absence, cut_by_image, occlusion
    sequences/NAME/*.value               a number a line: anchor, displacement (px),
                                         visibility (0..1); nan where unknown

Boxes are amodal and not clipped to the image, in continuous pixels from the outer
corner of the image, as in our truth. The toolkit rasterises boxes, so its overlaps
differ from ours by the rounding to pixels. An absent target is a box without area,
which the toolkit takes as known to be absent: an analysis with ``ignore_invisible``
leaves those frames out, as our own measures do.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from simbench.core.sequence import Sequence
from simbench.datasets.formats.files import (
    Entries,
    IndexFiles,
    frame_rate_hz,
    name_lines,
    write_pictures,
    write_text,
    writing_below,
)
from simbench.datasets.formats.labels import anchors, box_lines, column, occluded

__all__ = ["Vot", "write_descriptions"]


class Vot:
    """Sequences as the VOT toolkit stores them; see the module."""

    name = "vot"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        folder = root / "sequences" / name
        truth = sequence.truth
        with writing_below(root):
            times = write_pictures(
                sequence.frames, lambda i: folder / "color" / f"{i + 1:08d}.png"
            )
            rate = frame_rate_hz(times)
            write_descriptions(folder, sequence, name, "color/%08d.png", rate)
            write_text(folder / "absence.tag", column(truth.absent.astype(int)))
            cut = truth.cut_by_image.astype(int)
            write_text(folder / "cut_by_image.tag", column(cut))
        return {"name": name}

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the list of sequences."""
        yield "sequences/list.txt", name_lines(entries)


def write_descriptions(
    folder: Path, sequence: Sequence, name: str, pattern: str, rate_hz: float
) -> None:
    """Write the files beside the pictures that the toolkit reads, of GOT-10k too.

    Parameters
    ----------
    folder : Path
        Folder of the sequence.
    sequence : Sequence
    name : str
        Name of the sequence in the data set.
    pattern : str
        Path of the pictures, for example ``color/%08d.png``.
    rate_hz : float, 1/s
        Rounded for the toolkit, which reads whole numbers only.
    """
    truth = sequence.truth
    facts = {
        "name": name,
        "fps": max(1, round(rate_hz)),
        "format": "default",
        "channel.default": "color",
        "channels.color": pattern,
        "width": sequence.width,
        "height": sequence.height,
        "length": len(sequence),
        "simbench.scenario": sequence.name,
        "simbench.seed": "" if sequence.seed is None else sequence.seed,
        "simbench.digest": sequence.digest,
        "simbench.frame_rate_hz": f"{rate_hz:g}",
    }
    write_text(folder / "sequence", "".join(f"{k}={v}\n" for k, v in facts.items()))
    write_text(folder / "groundtruth.txt", box_lines(truth.boxes))
    write_text(folder / "occlusion.tag", column(occluded(truth).astype(int)))
    values: dict[str, Iterable[object]] = {
        "anchor": anchors(truth),
        "displacement": (f"{step:.4f}" for step in truth.displacement_px),
        "visibility": (f"{share:.6f}" for share in truth.visible_fraction),
    }
    for label, numbers in values.items():
        write_text(folder / f"{label}.value", column(numbers))
