"""The layout of COCO: masks and boxes of every vehicle, picture by picture.

::

    annotations/instances_val.json
    val/NAME/000000.png

Every frame of every sequence is a picture. Masks hold the visible pixels and boxes are
those around them; hidden vehicles have none. ``track_id`` tells which masks of one
sequence are the same vehicle: it is its id in our truth. Classes are the vehicle
classes, with the same numbers in every data set.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any, ClassVar

from simbench.core.sequence import Sequence, VehicleTruth
from simbench.datasets.formats.files import require_anew, write_pictures, writing_below
from simbench.datasets.formats.json_lists import json_object
from simbench.datasets.formats.masks import (
    INFO,
    categories,
    number_of_class,
    segmentation,
    tight_box,
    vehicles_with_masks,
)

__all__ = ["Coco"]


@dataclass(frozen=True, slots=True)
class Coco:
    """Pictures as COCO stores them; see the module.

    Attributes
    ----------
    split : str
        ``train``, ``val`` or ``test``.
    """

    split: str = "val"
    name: ClassVar[str] = "coco"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        vehicles = vehicles_with_masks(sequence, self.name)
        folder = root / self.split / name
        with writing_below(root):
            write_pictures(sequence.frames, lambda i: folder / f"{i:06d}.png")
        return {
            "name": name,
            "width": sequence.width,
            "height": sequence.height,
            "pictures": _pictures(vehicles),
        }

    def index(
        self, entries: Iterable[Mapping[str, Any]]
    ) -> Iterator[tuple[str, Iterable[str]]]:
        """Yield the file of all masks."""
        require_anew(entries)
        seen: set[int] = set()
        parts = {
            "info": INFO,
            "images": _images(entries),
            "annotations": _annotations(entries, seen),
            "categories": categories(seen),
        }
        yield f"annotations/instances_{self.split}.json", json_object(parts)


def _pictures(vehicles: VehicleTruth) -> list[list[dict[str, Any]]]:
    """Return what shows in each frame."""
    classes = {
        identity: number_of_class(vehicle)
        for identity, vehicle in zip(
            vehicles.ids.tolist(), vehicles.vehicles, strict=True
        )
    }
    return [
        [
            {
                "category_id": classes[identity],
                "track_id": identity,
                "bbox": tight_box(mask),
                "area": mask.pixel_count,
                "segmentation": segmentation(mask),
            }
            for identity, mask in frame.items()
        ]
        for frame in vehicles.masks
    ]


def _images(entries: Iterable[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    numbers = count(1)
    for entry in entries:
        size = {"width": entry["width"], "height": entry["height"]}
        for frame in range(len(entry["pictures"])):
            name = f"{entry['name']}/{frame:06d}.png"
            yield {"id": next(numbers), "file_name": name} | size


def _annotations(
    entries: Iterable[Mapping[str, Any]], seen: set[int]
) -> Iterator[dict[str, Any]]:
    """Yield the masks with numbers of their own; note their classes in ``seen``."""
    numbers, images = count(1), count(1)
    for entry in entries:
        for picture in entry["pictures"]:
            image = next(images)
            for one in picture:
                seen.add(one["category_id"])
                yield {"id": next(numbers), "image_id": image, "iscrowd": 0} | one
