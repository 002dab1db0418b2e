"""The layout of GOT-10k, with the files of the VOT toolkit in the same folder.

::

    val/list.txt
    val/NAME/00000001.jpg            1-based; PNG bytes, nothing is lost
    val/NAME/groundtruth.txt         left,top,width,height
    val/NAME/cover.label             0..8, visible eighths rounded up
    val/NAME/absence.label           1 where the target is absent
    val/NAME/cut_by_image.label      1 where part of it projects outside the image
    val/NAME/meta_info.ini
    val/NAME/{sequence,*.tag,*.value}    see `simbench.datasets.formats.vot`

Boxes are amodal and not clipped to the image, as in our truth; got10k itself clips both
boxes before it scores. It scores only frames with a cover above 0, so not those where
the target is fully hidden, which our measures count. An absent target is ``0,0,0,0``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from simbench.core.sequence import Sequence
from simbench.datasets.formats.files import (
    Entries,
    IndexFiles,
    SplitLayout,
    frame_rate_hz,
    name_lines,
    write_pictures,
    write_text,
    writing_below,
)
from simbench.datasets.formats.labels import column, cover
from simbench.datasets.formats.vot import write_descriptions

__all__ = ["Got10k"]


class Got10k(SplitLayout):
    """Sequences as GOT-10k stores them; see the module. got10k scores ``val`` only."""

    name = "got10k"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        folder = root / self.split / name
        truth = sequence.truth
        with writing_below(root):
            times = write_pictures(
                sequence.frames, lambda i: folder / f"{i + 1:08d}.jpg"
            )
            rate = frame_rate_hz(times)
            write_descriptions(folder, sequence, name, "%08d.jpg", rate)
            labels = {
                "cover": cover(truth),
                "absence": truth.absent.astype(int),
                "cut_by_image": truth.cut_by_image.astype(int),
            }
            for label, numbers in labels.items():
                write_text(folder / f"{label}.label", column(numbers))
            duration = float(times[-1] - times[0])
            write_text(folder / "meta_info.ini", _meta_text(sequence, rate, duration))
        return {"name": name}

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the list of sequences."""
        yield f"{self.split}/list.txt", name_lines(entries)


def _meta_text(sequence: Sequence, rate_hz: float, duration_s: float) -> str:
    """Return ``meta_info.ini``; pytracking finds its fields by their line number."""
    kind = _target_class(sequence)
    is_ball = kind == "ball"
    seed = "" if sequence.seed is None else f":{sequence.seed}"
    facts = {
        "url": f"simbench:{sequence.name}{seed}",
        "begin": _clock(0.0),
        "end": _clock(duration_s),
        "anno_fps": f"{rate_hz:g}Hz",
        "object_class": kind,
        "motion_class": "rolling" if is_ball else "driving",
        "major_class": kind,
        "root_class": "object" if is_ball else "vehicle",
        "motion_adverb": "unknown",
        "resolution": f"({sequence.width}, {sequence.height})",
    }
    return "[METAINFO]\n" + "".join(f"{k}: {v}\n" for k, v in facts.items())


def _target_class(sequence: Sequence) -> str:
    of_all = sequence.truth.vehicles
    vehicles = () if of_all is None else of_all.vehicles
    return next((v.vehicle_class for v in vehicles if v.name == "target"), "unknown")


def _clock(seconds: float) -> str:
    whole = int(seconds)
    return f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}"
