"""The layout of DAVIS 2017: one picture of object numbers a frame.

::

    ImageSets/2017/val.txt
    JPEGImages/480p/NAME/00000.jpg      0-based; PNG bytes, nothing is lost
    Annotations/480p/NAME/00000.png     palette; 0 nothing, 1 the target, 2.. others
    objects.csv                         which vehicle each number is

``480p`` is the folder that readers look in; pictures keep their size. Every vehicle
that shows in any frame is an object, hidden parts are not part of it, and a hidden or
absent object has no pixel. Nothing is void (255): our masks have no doubtful rims.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence, VehicleTruth
from simbench.datasets.formats.files import (
    csv_row,
    require_anew,
    write_pictures,
    writing_below,
)
from simbench.datasets.formats.indexed_png import indexed_png
from simbench.datasets.formats.masks import (
    TARGET_NAME,
    label_image,
    vehicles_with_masks,
)

__all__ = ["Davis"]

_MOST: Final = 254
"""Objects that a picture has numbers for: 0 is nothing and 255 is void."""


@dataclass(frozen=True, slots=True)
class Davis:
    """Sequences as DAVIS 2017 stores them; see the module.

    Attributes
    ----------
    split : str
        ``train``, ``val`` or ``test``.
    """

    split: str = "val"
    name: ClassVar[str] = "davis"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        vehicles = vehicles_with_masks(sequence, self.name)
        order = _order(vehicles)
        if len(order) > _MOST:
            raise DatasetError(
                f"format davis: {sequence.name}: at most {_MOST} vehicles have numbers "
                f"in a picture, this sequence shows {len(order)}"
            )
        ids = vehicles.ids.tolist()
        labels = {ids[row]: number for number, row in enumerate(order, start=1)}
        pictures = root / "JPEGImages" / "480p" / name
        annotations = root / "Annotations" / "480p" / name
        size = sequence.height, sequence.width
        with writing_below(root):
            write_pictures(sequence.frames, lambda i: pictures / f"{i:05d}.jpg")
            annotations.mkdir(parents=True, exist_ok=True)
            for index, masks in enumerate(vehicles.masks):
                numbers = label_image(masks, labels, *size)
                path = annotations / f"{index:05d}.png"
                path.write_bytes(indexed_png(numbers))
        told = [vehicles.vehicles[row] for row in order]
        return {"name": name, "objects": [[v.name, v.vehicle_class] for v in told]}

    def index(
        self, entries: Iterable[Mapping[str, Any]]
    ) -> Iterator[tuple[str, Iterable[str]]]:
        """Yield the list of sequences and the meaning of their object numbers."""
        require_anew(entries)
        names = (f"{entry['name']}\n" for entry in entries)
        yield f"ImageSets/2017/{self.split}.txt", names
        yield "objects.csv", _object_rows(entries)


def _order(vehicles: VehicleTruth) -> list[int]:
    """Return which vehicles show, as rows of the truth: the target, then the others."""
    shown = {identity for masks in vehicles.masks for identity in masks}
    rows = [
        row
        for row, (identity, vehicle) in enumerate(
            zip(vehicles.ids.tolist(), vehicles.vehicles, strict=True)
        )
        if identity in shown or vehicle.name == TARGET_NAME
    ]
    return sorted(rows, key=lambda row: vehicles.vehicles[row].name != TARGET_NAME)


def _object_rows(entries: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    yield csv_row("sequence", "object", "vehicle", "class")
    for entry in entries:
        for number, (vehicle, kind) in enumerate(entry["objects"], start=1):
            yield csv_row(entry["name"], number, vehicle, kind)
