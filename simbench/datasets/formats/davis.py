"""The layout of DAVIS 2017: one picture of object numbers a frame.

::

    ImageSets/2017/val.txt
    JPEGImages/480p/NAME/00000.jpg      0-based; PNG bytes, nothing is lost
    Annotations/480p/NAME/00000.png     palette; 0 nothing, 1 the target, 2.. others
    objects.csv                         the vehicle of each number

``480p`` is the folder that readers look in; pictures keep their size. Every vehicle
that is visible in any frame is an object; it has no pixel where it is hidden or absent.
Nothing is void (255): our masks have no uncertain edges.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence, VehicleTruth
from simbench.datasets.formats.files import (
    Entries,
    IndexFiles,
    SplitLayout,
    csv_lines,
    name_lines,
    refuse_iterator,
    write_pictures,
    writing_below,
)
from simbench.datasets.formats.masks import (
    TARGET_NAME,
    indexed_png,
    label_image,
    vehicles_with_masks,
)

__all__ = ["Davis"]

_MOST_OBJECTS: Final = 254
"""Numbers that a picture has for objects: 0 is nothing and 255 is void."""


class Davis(SplitLayout):
    """Sequences as DAVIS 2017 stores them; see the module."""

    name = "davis"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        vehicles = vehicles_with_masks(sequence, self.name)
        order = _order(vehicles)
        if len(order) > _MOST_OBJECTS:
            raise DatasetError(
                f"format davis: {sequence.name}: at most {_MOST_OBJECTS} vehicles have "
                f"numbers in a picture, this sequence shows {len(order)}"
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
        objects = [vehicles.vehicles[row] for row in order]
        return {"name": name, "objects": [[v.name, v.vehicle_class] for v in objects]}

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the list of sequences and the meaning of their object numbers."""
        refuse_iterator(entries)
        yield f"ImageSets/2017/{self.split}.txt", name_lines(entries)
        yield "objects.csv", csv_lines(_object_rows(entries))


def _order(vehicles: VehicleTruth) -> list[int]:
    """Return the indices of the visible vehicles, that of the target first."""
    visible = {identity for masks in vehicles.masks for identity in masks}
    rows = [
        row
        for row, (identity, vehicle) in enumerate(
            zip(vehicles.ids.tolist(), vehicles.vehicles, strict=True)
        )
        if identity in visible or vehicle.name == TARGET_NAME
    ]
    return sorted(rows, key=lambda row: vehicles.vehicles[row].name != TARGET_NAME)


def _object_rows(entries: Entries) -> Iterator[tuple[Any, ...]]:
    yield "sequence", "object", "vehicle", "class"
    for entry in entries:
        for number, (vehicle, kind) in enumerate(entry["objects"], start=1):
            yield entry["name"], number, vehicle, kind
