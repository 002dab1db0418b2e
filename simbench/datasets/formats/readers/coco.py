"""Readers of COCO with tracks, and of YouTube-VIS: masks and boxes in one JSON file.

::

    annotations/instances_val.json, val/NAME/000000.png             COCO
    instances.json, JPEGImages/NAME/00000.png                       YouTube-VIS

A sequence of COCO is a folder of pictures, and a target what has one ``track_id`` in
it; its clip begins in the first and ends in the last frame that shows it. A track of
YouTube-VIS is null where it is not visible; its clip begins where it is first seen.
Boxes are around the visible pixels. Several objects: NAME.ID each; simbench's own files
mark the target (``is_target``), and only that counts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import LARGEST_JSON, parse_json, read_below
from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import (
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.pictures import Pictures

__all__ = ["CocoReader", "YoutubeVisReader"]

_TRACKS: Final = "instances.json"
_ID: Final = (int, str)
Row = Mapping[str, Any]


class CocoReader:
    """COCO with tracks; see the module."""

    name = "coco"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the objects of all sequences of a root."""
        root = folder.absolute()
        places = []
        for path in sorted(root.glob("annotations/instances_*.json")):
            file = path.relative_to(root).as_posix()
            for name, rows in _by_folder(root, file).items():
                tracks = _chosen(
                    {str(row["track_id"]): row for row in rows[1]}, options
                )
                several = len(tracks) > 1 or bool(options.target)
                places += [
                    Place(
                        self.name,
                        root,
                        f"{file}/{name}",
                        f"{name}.{track}" if several else name,
                        track,
                    )
                    for track in tracks
                ]
        return places

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one object, see `Reader.read`."""
        file, _, name = place.folder.partition(".json/")
        file += ".json"
        where = place.root / file
        images, rows = _by_folder(place.root, file).get(name, ([], []))
        number = {image["id"]: index for index, image in enumerate(images)}
        boxes = np.full((len(images), 4), np.nan)
        for row in rows:
            if str(row["track_id"]) == place.target:
                boxes[number[row["image_id"]]] = _box(row.get("bbox"), where)
        seen = _seen(boxes, where, place.target)
        first, end = int(seen[0]), int(seen[-1]) + 1
        split = Path(file).stem.removeprefix("instances_")
        files = tuple(f"{split}/{image['file_name']}" for image in images[first:end])
        boxes = boxes[first:end]
        return Annotation(
            _existing(Pictures(place.root, files)),
            boxes,
            np.isnan(boxes[:, 0]),
            (file,),
            visible_boxes=boxes,
        )


class YoutubeVisReader:
    """YouTube-VIS; see the module."""

    name = "youtube-vis"

    def find(self, folder: Path, options: ReadOptions) -> Sequence[Place]:
        """Return the objects of all sequences of a root."""
        root = folder.absolute()
        if not (root / _TRACKS).is_file() or not (root / "JPEGImages").is_dir():
            return []
        places = []
        for video, rows in _videos(root):
            name = str(video["file_names"][0]).rpartition("/")[0]
            tracks = _chosen({str(row["id"]): row for row in rows}, options)
            several = len(tracks) > 1 or bool(options.target)
            places += [
                Place(
                    self.name,
                    root,
                    name,
                    f"{name}.{track}" if several else name,
                    track,
                )
                for track in tracks
            ]
        return places

    def read(self, place: Place, options: ReadOptions) -> Annotation:
        """Read one object, see `Reader.read`."""
        where = place.root / _TRACKS
        found = [
            (video, row)
            for video, rows in _videos(place.root)
            for row in rows
            if str(row["id"]) == place.target
            and str(video["file_names"][0]).rpartition("/")[0] == place.folder
        ]
        if not found:
            raise DatasetError(f"{where}: expected a track {place.target}, got none")
        video, row = found[0]
        names = video["file_names"]
        listed = row.get("bboxes")
        if not isinstance(listed, list) or len(listed) != len(names):
            raise DatasetError(
                f"{where}: track {place.target}: expected {len(names)} bboxes, one a "
                f"picture, got {len(listed) if isinstance(listed, list) else 'none'}"
            )
        boxes = np.array([_box(one, where) for one in listed])
        first = int(_seen(boxes, where, place.target)[0])
        files = tuple(f"JPEGImages/{name}" for name in names[first:])
        boxes = boxes[first:]
        return Annotation(
            _existing(Pictures(place.root, files)),
            boxes,
            np.isnan(boxes[:, 0]),
            (_TRACKS,),
            visible_boxes=boxes,
        )


def _chosen(tracks: Mapping[str, Row], options: ReadOptions) -> list[str]:
    """Return which tracks to evaluate: the target's, or all."""
    if options.target:
        return [options.target]
    ours = [track for track, row in tracks.items() if row.get("is_target") == 1]
    return ours or list(tracks)


def _by_folder(root: Path, file: str) -> dict[str, tuple[list[Row], list[Row]]]:
    """Return images and annotations with tracks by the folder of the pictures."""
    facts, where = _parsed(root, file), root / file
    images = _rows(facts, "images", {"id": _ID, "file_name": str}, where)
    tracked = _rows(facts, "annotations", {"image_id": _ID}, where)
    folders: dict[str, tuple[list[Row], list[Row]]] = {}
    of_image: dict[Any, str] = {}
    for image in images:
        of_image[image["id"]] = folder = image["file_name"].rpartition("/")[0]
        folders.setdefault(folder, ([], []))[0].append(image)
    for row in tracked:
        if isinstance(row.get("track_id"), _ID) and row["image_id"] in of_image:
            folders[of_image[row["image_id"]]][1].append(row)
    return {name: of for name, of in folders.items() if of[1]}


def _videos(root: Path) -> list[tuple[Row, list[Row]]]:
    """Return the videos, each with its tracks."""
    facts, where = _parsed(root, _TRACKS), root / _TRACKS
    videos = _rows(facts, "videos", {"id": _ID, "file_names": list}, where)
    tracks = _rows(facts, "annotations", {"id": _ID, "video_id": _ID}, where)
    found = []
    for video in videos:
        mine = [row for row in tracks if row["video_id"] == video["id"]]
        if not all(isinstance(name, str) for name in video["file_names"]):
            raise DatasetError(f"{where}: videos: expected file_names of text")
        if mine and video["file_names"]:
            found.append((video, mine))
    return found


def _rows(facts: Any, key: str, types: Mapping[str, Any], where: Path) -> list[Row]:
    """Return a list of a document, each of whose items has keys of some types.

    Raises
    ------
    DatasetError
        If it is something else.
    """
    rows = facts.get(key) if isinstance(facts, dict) else None
    if not isinstance(rows, list):
        raise DatasetError(f"{where}: {key}: expected a list, got another document")
    for number, row in enumerate(rows):
        for name, kind in types.items():
            if not isinstance(row, dict) or not isinstance(row.get(name), kind):
                raise DatasetError(
                    f"{where}: {key}[{number}]: expected {name} of another type, or at "
                    "all"
                )
    return rows


def _parsed(root: Path, file: str) -> Any:
    state = (root / file).stat()
    return _parsed_at(root, file, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=2)
def _parsed_at(root: Path, file: str, changed_ns: int, size: int) -> Any:
    return parse_json(read_below(root, file, LARGEST_JSON), root / file)


def _box(value: Any, where: Path) -> NDArray[np.float64]:
    """Return a box, NaN for null."""
    if value is None:
        return np.full(4, np.nan)
    try:
        box = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        box = np.zeros(0)
    if box.shape != (4,) or not np.isfinite(box).all() or (box[2:] < 0.0).any():
        raise DatasetError(
            f"{where}: expected a bbox left,top,width,height, got others"
        )
    return box if (box[2:] > 0.0).all() else np.full(4, np.nan)


def _seen(boxes: NDArray[np.float64], where: Path, target: str) -> NDArray[np.int64]:
    seen = np.flatnonzero(~np.isnan(boxes[:, 0]))
    if not len(seen):
        raise DatasetError(f"{where}: expected boxes of object {target}, got none")
    return seen


def _existing(pictures: Pictures) -> Pictures:
    missing = [name for name in pictures.files if not (pictures.root / name).exists()]
    if missing:
        raise DatasetError(f"{pictures.root / missing[0]}: missing")
    return pictures
