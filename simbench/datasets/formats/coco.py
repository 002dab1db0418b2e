"""The layouts of COCO and YouTube-VIS: masks and boxes of every vehicle.

COCO describes single pictures::

    annotations/instances_val.json
    val/NAME/000000.png

Every frame of every sequence is a picture. ``track_id`` is the vehicle's id in our
truth, the same in all frames of a sequence; ``is_target`` is 1 for the target.

YouTube-VIS describes tracks::

    youtube_vis_val/instances.json
    youtube_vis_val/JPEGImages/NAME/00000.png    0-based

A track has one entry a frame, null where no pixel of the vehicle is visible; that of
the target has an ``is_target`` of 1.

Masks hold the visible pixels and boxes are those around them; hidden vehicles have
none. Classes are the vehicle classes, with the same numbers in every data set.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any, Final, get_args

from simbench.core.sequence import Sequence, VehicleTruth
from simbench.core.trajectories import Vehicle, VehicleClass
from simbench.datasets.formats.files import (
    Entries,
    IndexFiles,
    SplitLayout,
    json_object,
    refuse_iterator,
    write_pictures,
    writing_below,
)
from simbench.datasets.formats.masks import (
    TARGET_NAME,
    segmentation,
    tight_box,
    vehicles_with_masks,
)

__all__ = ["Coco", "YoutubeVis"]

_INFO: Final = {"description": "vehicles rendered by simbench"}
"""First part of the files: older pycocotools fail without it."""
_CLASSES: Final[tuple[str, ...]] = get_args(VehicleClass)
Items = Iterator[dict[str, Any]]


class Coco(SplitLayout):
    """Pictures as COCO stores them; see the module."""

    name = "coco"

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

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the file of all masks."""
        chunks = _index("images", _images, _masks, entries)
        yield f"annotations/instances_{self.split}.json", chunks


class YoutubeVis(SplitLayout):
    """Sequences as YouTube-VIS stores them; see the module."""

    name = "youtube-vis"

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
            "tracks": list(_vehicle_tracks(vehicles)),
        }

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the file of all tracks."""
        chunks = _index("videos", _videos, _tracks, entries)
        yield f"youtube_vis_{self.split}/instances.json", chunks


def _pictures(vehicles: VehicleTruth) -> list[list[dict[str, Any]]]:
    """Return the visible vehicles of each frame."""
    numbers = map(_class_number, vehicles.vehicles)
    classes = dict(zip(vehicles.ids.tolist(), numbers, strict=True))
    names = [vehicle.name for vehicle in vehicles.vehicles]
    target = dict(zip(names, vehicles.ids.tolist(), strict=True)).get(TARGET_NAME)
    return [
        [
            {
                "category_id": classes[identity],
                "track_id": identity,
                "is_target": int(identity == target),
                "bbox": tight_box(mask),
                "area": mask.pixel_count,
                "segmentation": segmentation(mask),
            }
            for identity, mask in frame.items()
        ]
        for frame in vehicles.masks
    ]


def _vehicle_tracks(vehicles: VehicleTruth) -> Items:
    """Yield the track of each vehicle that is ever visible."""
    for identity, vehicle in zip(vehicles.ids.tolist(), vehicles.vehicles, strict=True):
        masks = [frame.get(identity) for frame in vehicles.masks]
        if not any(masks):
            continue
        yield {
            "category_id": _class_number(vehicle),
            "is_target": int(vehicle.name == TARGET_NAME),
            "segmentations": [None if m is None else segmentation(m) for m in masks],
            "areas": [None if m is None else m.pixel_count for m in masks],
            "bboxes": [None if m is None else tight_box(m) for m in masks],
        }


def _class_number(vehicle: Vehicle) -> int:
    """Return the number of a vehicle's class, from 1."""
    return _CLASSES.index(vehicle.vehicle_class) + 1


def _index(
    title: str,
    items: Callable[[Entries], Items],
    annotations: Callable[[Entries, set[int]], Items],
    entries: Entries,
) -> Iterator[str]:
    """Return the text of the index; ``annotations`` notes the classes that it meets."""
    refuse_iterator(entries)
    seen: set[int] = set()
    parts: dict[str, Mapping[str, Any] | Iterable[Any]] = {
        "info": _INFO,
        title: items(entries),
        "annotations": annotations(entries, seen),
        "categories": _categories(seen),
    }
    return json_object(parts)


def _images(entries: Entries) -> Items:
    numbers = count(1)
    for entry in entries:
        size = {"width": entry["width"], "height": entry["height"]}
        for frame in range(len(entry["pictures"])):
            name = f"{entry['name']}/{frame:06d}.png"
            yield {"id": next(numbers), "file_name": name} | size


def _masks(entries: Entries, seen: set[int]) -> Items:
    numbers, images = count(1), count(1)
    for entry in entries:
        for picture in entry["pictures"]:
            image = next(images)
            for one in picture:
                seen.add(one["category_id"])
                yield {"id": next(numbers), "image_id": image, "iscrowd": 0} | one


def _videos(entries: Entries) -> Items:
    for number, entry in enumerate(entries, start=1):
        names = [f"{entry['name']}/{i:05d}.png" for i in range(entry["length"])]
        size = {key: entry[key] for key in ("width", "height", "length")}
        yield {"id": number, **size, "file_names": names}


def _tracks(entries: Entries, seen: set[int]) -> Items:
    numbers = count(1)
    for video, entry in enumerate(entries, start=1):
        size = {key: entry[key] for key in ("width", "height", "length")}
        for track in entry["tracks"]:
            seen.add(track["category_id"])
            yield {"id": next(numbers), "video_id": video, "iscrowd": 0} | size | track


def _categories(seen: Collection[int]) -> Items:
    """Yield the classes with those numbers.

    ``seen`` is read when the first is requested, not before. A class without members
    must be left out: toolkits average their scores over all listed classes.
    """
    for number in sorted(seen):
        name = _CLASSES[number - 1]
        group = "object" if name == "ball" else "vehicle"
        yield {"id": number, "name": name, "supercategory": group}
