"""A sequence in which all that layouts must tell happens, at places known by head.

A car passes behind a wide pole, leaves the picture on the right and returns; a
truck crosses behind the same pole from right to left, and is absent at the end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.frame import Frame
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence, Truth, VehicleTruth
from simbench.core.trajectories import Vehicle

WIDTH, HEIGHT, FRAMES = 48, 32, 12
RATE_HZ = 10.0
POLE = range(20, 32)
"""Columns of the picture that the pole covers."""
TARGET_ID, OTHER_ID = 5, 3
MARGIN = 0.25
"""Margin between boxes and pixels on each side, so that they are not whole, px."""

_TARGET_LEFT = (2, 8, 14, 21, 27, 33, 40, 46, None, None, 42, 36)
_TARGET_TOP, _TARGET_SIZE = 4, (10, 8)
_OTHER_LEFT = (None, 44, 38, 32, 26, 20, 14, 8, 2, -4, -10, None)
_OTHER_TOP, _OTHER_SIZE = 20, (12, 6)

HIDDEN = 3
"""Frame in which the pole hides all of the target."""
ABSENT = (8, 9)
CUT = (6, 7, 10)
"""Frames in which the target reaches over the right border."""
VISIBLE = (1.0, 1.0, 0.6, 0.0, 0.5, 1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0)
"""Visible share of the target: the pole leaves 6, 0 and 5 of its 10 columns."""


def staged_sequence(name: str = "staged") -> Sequence:
    """Return the twelve frames, 48 x 32 px, 10 a second."""
    target = [_pixels(x, _TARGET_TOP, _TARGET_SIZE) for x in _TARGET_LEFT]
    other = [_pixels(x, _OTHER_TOP, _OTHER_SIZE) for x in _OTHER_LEFT]
    boxes = _boxes(_TARGET_LEFT, _TARGET_TOP, _TARGET_SIZE)
    absent = np.array([x is None for x in _TARGET_LEFT])
    centers = boxes[:, 0] + boxes[:, 2] / 2
    return Sequence(
        name=name,
        frames=[
            Frame(_picture(frame, target[frame], other[frame]), frame / RATE_HZ, frame)
            for frame in range(FRAMES)
        ],
        truth=Truth(
            boxes=boxes,
            visible_boxes=_seen_boxes(target),
            visible_fraction=_shares(target),
            absent=absent,
            cut_by_image=np.isin(np.arange(FRAMES), CUT),
            displacement_px=np.abs(np.diff(centers, prepend=np.nan)),
            occluders=tuple("pole" if s < 1 else "" for s in _shares(target)),
            vehicles=_vehicles(target, other, boxes),
        ),
        width=WIDTH,
        height=HEIGHT,
        seed=7,
    )


def _pixels(
    left: int | None, top: int, size: tuple[int, int]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return what a vehicle covers in the picture, and what of it the pole leaves."""
    covered = np.zeros((HEIGHT, WIDTH), np.bool_)
    if left is not None:
        covered[top : top + size[1], max(left, 0) : max(left + size[0], 0)] = True
    seen = covered.copy()
    seen[:, POLE.start : POLE.stop] = False
    return covered, seen


def _picture(frame: int, *vehicles: tuple[NDArray[np.bool_], ...]) -> NDArray[np.uint8]:
    rng = np.random.default_rng(frame)
    image = rng.integers(100, 130, (HEIGHT, WIDTH, 3), dtype=np.uint8)
    for (_, seen), colour in zip(vehicles, [(200, 20, 10), (0, 0, 250)], strict=True):
        image[seen] = colour
    image[:, POLE.start : POLE.stop] = 40
    return image


def _boxes(
    lefts: tuple[int | None, ...], top: int, size: tuple[int, int]
) -> NDArray[np.float64]:
    width, height = (extent + 2 * MARGIN for extent in size)
    rows = [
        [np.nan] * 4 if x is None else [x - MARGIN, top - MARGIN, width, height]
        for x in lefts
    ]
    return np.array(rows)


def _seen_boxes(
    pixels: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]],
) -> NDArray[np.float64]:
    boxes = np.full((FRAMES, 4), np.nan)
    for frame, (_, seen) in enumerate(pixels):
        rows, columns = np.nonzero(seen)
        if len(rows):
            low, high = (columns.min(), rows.min()), (columns.max(), rows.max())
            boxes[frame] = [*low, *(np.subtract(high, low) + 1)]
    return boxes


def _shares(
    pixels: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]],
) -> NDArray[np.float64]:
    return np.array([s.sum() / c.sum() if c.any() else 0.0 for c, s in pixels])


def _vehicles(
    target: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]],
    other: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]],
    boxes: NDArray[np.float64],
) -> VehicleTruth:
    both = (other, target)
    return VehicleTruth(
        vehicles=(
            Vehicle("other", "truck", 7.1, 2.4, 2.4, (0, 0, 250)),
            Vehicle("target", "car", 4.5, 1.8, 1.5, (200, 20, 10)),
        ),
        ids=np.array([OTHER_ID, TARGET_ID]),
        boxes=np.stack([_boxes(_OTHER_LEFT, _OTHER_TOP, _OTHER_SIZE), boxes], axis=1),
        visible_boxes=np.stack([_seen_boxes(one) for one in both], axis=1),
        visible_px=np.array(
            [[float(one[t][1].sum()) for one in both] for t in range(FRAMES)]
        ),
        depths=np.full((FRAMES, 2), 30.0),
        positions=np.zeros((FRAMES, 2, 3)),
        headings=np.zeros((FRAMES, 2)),
        masks=tuple(
            {
                number: Mask.from_array(one[t][1])
                for number, one in zip((OTHER_ID, TARGET_ID), both, strict=True)
                if one[t][1].any()
            }
            for t in range(FRAMES)
        ),
        visible_fraction=np.stack([_shares(one) for one in both], axis=1),
    )
