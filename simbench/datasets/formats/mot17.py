"""The layout of MOT17, with every vehicle in it.

::

    seqmaps/MOT17-train.txt             header ``name``, then one sequence a line
    MOT17-train/NAME/seqinfo.ini
    MOT17-train/NAME/img1/000001.jpg    1-based; PNG bytes, nothing is lost
    MOT17-train/NAME/gt/gt.txt          frame,id,left,top,width,height,1,1,visibility
    MOT17-train/NAME/gt/vehicles.csv    class, size and colour of the vehicle of each id

MOT17 is about pedestrians: its readers score class 1 only and refuse unknown classes,
so every vehicle is written as class 1. Boxes are amodal and not clipped to the image,
as in MOT17; left and top count from 1, as the benchmark's description requires, so they
are one higher than in our truth. A vehicle has a row in every frame from the first to
the last in which any of it is visible, hidden ones between included, as long as its box
meets the image; its id is that of our truth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence, VehicleTruth
from simbench.datasets.formats.files import (
    Entries,
    IndexFiles,
    SplitLayout,
    csv_lines,
    frame_rate_hz,
    name_lines,
    write_pictures,
    write_text,
    writing_below,
)

__all__ = ["Mot17"]


@dataclass(frozen=True)
class Mot17(SplitLayout):
    """Sequences as MOT17 stores them; see the module.

    TrackEval scores the split ``train`` by default.
    """

    split: str = "train"
    name: ClassVar[str] = "mot17"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        vehicles = sequence.truth.vehicles
        if vehicles is None:
            raise DatasetError(
                f"format mot17: {sequence.name}: expected the truth about every "
                "vehicle, this sequence has that of its target only"
            )
        folder = root / f"MOT17-{self.split}" / name
        with writing_below(root):
            times = write_pictures(
                sequence.frames, lambda i: folder / "img1" / f"{i + 1:06d}.jpg"
            )
            rate = frame_rate_hz(times)
            write_text(folder / "seqinfo.ini", _sequence_text(sequence, name, rate))
            rows = "".join(_truth_rows(vehicles))
            write_text(folder / "gt" / "gt.txt", rows)
            table = "".join(csv_lines(_vehicle_rows(vehicles)))
            write_text(folder / "gt" / "vehicles.csv", table)
        return {"name": name}

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the list of sequences."""
        lines = chain(["name\n"], name_lines(entries))
        yield f"seqmaps/MOT17-{self.split}.txt", lines


def _sequence_text(sequence: Sequence, name: str, rate_hz: float) -> str:
    facts = {
        "name": name,
        "imDir": "img1",
        "frameRate": max(1, round(rate_hz)),  # read as a whole number
        "seqLength": len(sequence),
        "imWidth": sequence.width,
        "imHeight": sequence.height,
        "imExt": ".jpg",
    }
    return "[Sequence]\n" + "".join(f"{k}={v}\n" for k, v in facts.items())


def _truth_rows(vehicles: VehicleTruth) -> Iterator[str]:
    """Yield the rows of all vehicles, one vehicle after another as in MOT17."""
    shares = _visibility(vehicles)
    for row, identity in enumerate(vehicles.ids.tolist()):
        seen = np.flatnonzero(vehicles.visible_px[:, row] > 0.0)
        if not len(seen):
            continue
        for frame in range(int(seen[0]), int(seen[-1]) + 1):
            left, top, width, height = vehicles.boxes[frame, row].tolist()
            if np.isnan(left):
                continue
            yield (
                f"{frame + 1},{identity},{left + 1:.4f},{top + 1:.4f},{width:.4f},"
                f"{height:.4f},1,1,{shares[frame, row]:.6f}\n"
            )


def _visibility(vehicles: VehicleTruth) -> NDArray[np.float64]:
    """Return the visible share of each vehicle, (T, V); 0 or 1 where it is unknown."""
    seen = (vehicles.visible_px > 0.0).astype(np.float64)
    shares = vehicles.visible_fraction
    return seen if shares is None else np.where(np.isnan(shares), seen, shares)


def _vehicle_rows(vehicles: VehicleTruth) -> Iterator[tuple[Any, ...]]:
    yield "id", "name", "class", "length_m", "width_m", "height_m", "colour"
    for identity, v in zip(vehicles.ids.tolist(), vehicles.vehicles, strict=True):
        colour = "#{:02x}{:02x}{:02x}".format(*v.colour)
        size = (f"{extent:.3f}" for extent in (v.length, v.width, v.height))
        yield identity, v.name, v.vehicle_class, *size, colour
