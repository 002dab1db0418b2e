"""Reading of one sequence in any layout: its lazy frames, and the truth about a target.

What data on disk do not tell is unknown, never zero: the visible fraction is NaN, the
occluder ``unknown``, and there is no truth about other vehicles.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core import box as box_math
from simbench.core.bounded_read import open_below, read_below
from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence, Truth
from simbench.datasets.attributes import box_attributes
from simbench.datasets.clip_search import find_places, reader_of
from simbench.datasets.formats.readers.annotation import (
    Annotation,
    Place,
    ReadOptions,
)
from simbench.datasets.formats.readers.pictures import Pictures, frames_of
from simbench.datasets.frames import (
    LARGEST_PICTURE,
)
from simbench.datasets.picture_header import is_complete_picture, picture_size

__all__ = ["clip_digest", "read_place", "read_sequence", "with_attributes"]

_MOST_PIXELS: Final = 2**24
_PIECE: Final = 2**20  # bytes
_UNKNOWN: Final = "unknown"
_MOST_OUTSIDE: Final = 0.25
"""Share of boxes whose centre may be outside of the picture."""


def read_sequence(
    path: Path | str,
    *,
    layout: str = "",
    origin: int | None = None,
    box: tuple[float, float, float, float] | None = None,
    target: str = "",
) -> Sequence:
    """Read a sequence of any layout; its frames stay where they are until used.

    Parameters
    ----------
    path : Path or str
        A sequence that simbench generated, or one in the layout of OTB, TLP, GOT-10k,
        LaSOT, VOT, UAV123, NfS, MOT17, DAVIS, COCO or YouTube-VIS; or a video, or a
        folder of pictures, with ``box``.
    layout : str
        Name of the layout, where the files do not tell it.
    origin : int, optional
        0 or 1: number of the first pixel in the boxes; by default as usual in the
        layout (1 in OTB, TLP, LaSOT, UAV123 and MOT17). Boxes count from 0 here.
    box : (4,) float, px, optional
        Left, top, width and height of the target in the first frame, where there is no
        annotation.
    target : str
        Which of several annotated objects.

    Returns
    -------
    Sequence
        What is not known of recorded data is NaN or ``unknown``.

    Raises
    ------
    DatasetError
        If there is not one sequence, or it is damaged: in one line, with file and line
        number.

    Examples
    --------
    >>> import simbench, tempfile
    >>> scenario = simbench.load_scenario("smoke").shortened(2)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = simbench.generate(scenario, 0, folder)
    ...     sequence = simbench.read_sequence(folder)
    ...     sequence.name, sequence.seed, sequence.frames[0].time_s
    ('smoke', 0, 0.0)
    """
    options = ReadOptions(layout, origin, box, target)
    places = find_places(Path(path), options)
    if len(places) > 1:
        names = ", ".join(place.name for place in places[:5])
        raise DatasetError(
            f"{path}: expected one sequence, found {len(places)}: {names}"
            + (", ..." if len(places) > 5 else "")
        )
    return read_place(places[0], options)[0]


def read_place(place: Place, options: ReadOptions) -> tuple[Sequence, Annotation]:
    """Read a sequence that `simbench.datasets.clip_search.find_places` found.

    Raises
    ------
    DatasetError
        If it is damaged.
    """
    found = reader_of(place.layout).read(place, options)
    if found.whole is not None:
        return found.whole, found
    width, height = found.pictures.size()
    if not 0 < width * height <= _MOST_PIXELS:
        raise DatasetError(
            f"{found.pictures.name(0)}: expected at most {_MOST_PIXELS} pixels, "
            f"got {width} x {height}"
        )
    _require_inside(place, found, width, height)
    origin = _origin(found, options)
    shift = np.array([origin, origin, 0, 0], dtype=np.float64)
    boxes = found.boxes - shift
    if found.visible_boxes is not None:
        found = replace(found, visible_boxes=found.visible_boxes - shift)
    times = np.arange(len(found.pictures)) / found.rate_hz
    sequence = Sequence(
        name=place.name,
        frames=frames_of(found.pictures, times, width, height),
        truth=_truth(found, boxes, width, height),
        width=width,
        height=height,
        attributes={**box_attributes(boxes), **found.labels},
    )
    return sequence, found


def clip_digest(
    place: Place,
    options: ReadOptions,
    read: Annotation,
    on_frame: Callable[[int, int], None] | None = None,
) -> str:
    """Return the SHA-256, as hex, of what is in a sequence's files and how it is read.

    Every picture is looked at without decoding it.

    Parameters
    ----------
    place, options, read
        See `read_place`.
    on_frame : callable of (done, total), optional

    Raises
    ------
    DatasetError
        If a picture is empty, cut short, or of another size than the first.
    """
    how = place.layout, place.target, _origin(read, options), options.box
    digest = hashlib.sha256(repr(how).encode())
    for name in read.files:
        if (place.root / name).is_file():
            with open_below(place.root, name, LARGEST_PICTURE) as file:
                digest.update(_content_digest(file))
    pictures = read.pictures
    if pictures.video_frames:
        with open_below(pictures.root, pictures.files[0], 2**63 - 1) as file:
            digest.update(_content_digest(file))
        return digest.hexdigest()
    size = pictures.size()
    for index, name in enumerate(pictures.files):
        content = read_below(pictures.root, name, LARGEST_PICTURE)
        _require_picture(content, pictures, index, size)
        digest.update(hashlib.sha256(content).digest())
        if on_frame is not None:
            on_frame(index + 1, len(pictures))
    return digest.hexdigest()


def _content_digest(file: BinaryIO) -> bytes:
    digest = hashlib.sha256()
    while piece := file.read(_PIECE):
        digest.update(piece)
    return digest.digest()


def _origin(read: Annotation, options: ReadOptions) -> int:
    return read.origin if options.origin is None else options.origin


def with_attributes(sequence: Sequence, digest: str) -> Sequence:
    """Return a sequence under its digest, with the attributes of its boxes."""
    boxes = box_attributes(sequence.truth.boxes)
    return replace(sequence, digest=digest, attributes={**boxes, **sequence.attributes})


def _require_picture(
    content: bytes, pictures: Pictures, index: int, size: tuple[int, int]
) -> None:
    where = pictures.name(index)
    if not content:
        raise DatasetError(f"{where}: expected a picture, got an empty file")
    found = picture_size(content)
    if found == (0, 0):
        raise DatasetError(f"{where}: not a readable picture")
    if not is_complete_picture(content):
        raise DatasetError(f"{where}: not a readable picture: the file is cut short")
    if found != size:
        raise DatasetError(
            f"{where}: expected {size[0]} x {size[1]} px as the first frame, got "
            f"{found[0]} x {found[1]}"
        )


def _truth(
    found: Annotation, boxes: NDArray[np.float64], width: int, height: int
) -> Truth:
    count = len(boxes)
    centers = box_math.centers(boxes)
    steps = np.hypot(*np.diff(centers, axis=0).T)
    beyond = (boxes[:, :2] < 0.0) | (boxes[:, :2] + boxes[:, 2:] > [width, height])
    cut, visible = found.cut_by_image, found.visible_fraction
    shares = np.full(count, np.nan) if visible is None else visible
    shares = np.where(found.absent, 0.0, shares)
    around = found.visible_boxes
    return Truth(
        boxes=boxes,
        visible_boxes=np.full((count, 4), np.nan) if around is None else around,
        visible_fraction=shares,
        absent=found.absent,
        cut_by_image=np.asarray(beyond.any(axis=1)) if cut is None else cut,
        displacement_px=np.concatenate([[np.nan], steps]),
        occluders=tuple("" if share == 1.0 else _UNKNOWN for share in shares.tolist()),
    )


def _require_inside(place: Place, found: Annotation, width: int, height: int) -> None:
    """Refuse boxes that are elsewhere: of swapped columns, or two corners, or others.

    Raises
    ------
    DatasetError
        Also if the target has no box in the first frame.
    """
    where = place.root / (found.files[0] if found.files else place.folder)
    lines = np.arange(1, len(found.boxes) + 1) if found.lines is None else found.lines
    if not np.isfinite(found.boxes[0]).all():
        raise DatasetError(
            f"{where}:{max(int(lines[0]), 1)}: expected a box of the target in the "
            "first frame, got none"
        )
    centers = box_math.centers(found.boxes)
    beyond = (centers < 0.0) | (centers > [width + 1, height + 1])
    outside = np.asarray(beyond.any(axis=1))
    known = np.isfinite(centers[:, 0])
    if outside[0] or outside[known].mean() > _MOST_OUTSIDE:
        first = int(outside.argmax())
        shown = ",".join(f"{value:g}" for value in found.boxes[first].tolist())
        raise DatasetError(
            f"{where}:{lines[first]}: expected left,top,width,height of a box in a "
            f"picture of {width} x {height} px, got {shown}: its centre is outside, as "
            f"that of {int(outside.sum())} of {int(known.sum())}; are columns swapped, "
            "or is it two corners?"
        )
