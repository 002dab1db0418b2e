"""The layout of YouTube-VIS: one track of masks for every vehicle.

::

    youtube_vis_val/instances.json
    youtube_vis_val/JPEGImages/NAME/00000.png    0-based

A track has one entry a frame, null where no pixel of the vehicle shows. Masks hold the
visible pixels and boxes are those around them. Classes are the vehicle classes, with
the same numbers in every data set.
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

__all__ = ["YoutubeVis"]


@dataclass(frozen=True, slots=True)
class YoutubeVis:
    """Sequences as YouTube-VIS stores them; see the module.

    Attributes
    ----------
    split : str
        ``train``, ``val`` or ``test``.
    """

    split: str = "val"
    name: ClassVar[str] = "youtube-vis"

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write one sequence, see `simbench.datasets.formats.Format`."""
        vehicles = vehicles_with_masks(sequence, self.name)
        folder = root / f"youtube_vis_{self.split}" / "JPEGImages" / name
        with writing_below(root):
            write_pictures(sequence.frames, lambda i: folder / f"{i:05d}.png")
        return {
            "name": name,
            "width": sequence.width,
            "height": sequence.height,
            "length": len(sequence),
            "tracks": list(_tracks(vehicles)),
        }

    def index(
        self, entries: Iterable[Mapping[str, Any]]
    ) -> Iterator[tuple[str, Iterable[str]]]:
        """Yield the file of all tracks."""
        require_anew(entries)
        seen: set[int] = set()
        parts = {
            "info": INFO,
            "videos": _videos(entries),
            "annotations": _annotations(entries, seen),
            "categories": categories(seen),
        }
        yield f"youtube_vis_{self.split}/instances.json", json_object(parts)


def _tracks(vehicles: VehicleTruth) -> Iterator[dict[str, Any]]:
    """Yield what is known of each vehicle that shows."""
    for identity, vehicle in zip(vehicles.ids.tolist(), vehicles.vehicles, strict=True):
        masks = [frame.get(identity) for frame in vehicles.masks]
        if not any(masks):
            continue
        yield {
            "category_id": number_of_class(vehicle),
            "segmentations": [None if m is None else segmentation(m) for m in masks],
            "areas": [None if m is None else m.pixel_count for m in masks],
            "bboxes": [None if m is None else tight_box(m) for m in masks],
        }


def _videos(entries: Iterable[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    for number, entry in enumerate(entries, start=1):
        names = [f"{entry['name']}/{i:05d}.png" for i in range(entry["length"])]
        size = {key: entry[key] for key in ("width", "height", "length")}
        yield {"id": number, **size, "file_names": names}


def _annotations(
    entries: Iterable[Mapping[str, Any]], seen: set[int]
) -> Iterator[dict[str, Any]]:
    """Yield the tracks with numbers of their own; note their classes in ``seen``."""
    numbers = count(1)
    for video, entry in enumerate(entries, start=1):
        size = {key: entry[key] for key in ("width", "height", "length")}
        for track in entry["tracks"]:
            seen.add(track["category_id"])
            yield {"id": next(numbers), "video_id": video, "iscrowd": 0} | size | track
