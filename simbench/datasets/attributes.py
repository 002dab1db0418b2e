"""Attributes of a sequence by frame: what makes it hard, as far as it can be computed.

Each is 1 where it is present, 0 where not, NaN where unknown:

``fast_motion``
    The centre moves by more than half the size of the box (the square root of its
    area) since the frame before. LaSOT asks for a whole size, OTB for 20 px.
``scale_change``, ``aspect_change``
    Area, or width over height, is outside of 1/2 to 2 times that of the first frame,
    as in LaSOT and UAV123.
``low_resolution``
    The box has less than 400 square pixels, as in OTB.
``grey``
    The pictures have no colour.
``camera_motion``
    The background moves by more than half a pixel since the frame before: the median
    over corners outside of the box, followed by optical flow.

Labelled attributes come from the layouts and replace computed ones of the same name.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core import box as box_math
from simbench.core.sequence import Sequence

__all__ = ["box_attributes", "fast_motion", "low_resolution", "picture_attributes"]

_FAST: Final = 0.5
_CHANGE: Final = 2.0
_LOW_RESOLUTION_PX2: Final = 400.0
_MOVES_PX: Final = 0.5
_WIDTH_PX: Final = 320
"""Width to which pictures are reduced to follow corners."""
_CORNERS: Final = 100
_LEAST_CORNERS: Final = 8
_GREY_LEVELS: Final = 2.0
"""Mean difference between colour channels of a grey picture after JPEG."""
_COLOUR_SAMPLES: Final = 16


def box_attributes(boxes: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """Return the attributes that boxes tell.

    Parameters
    ----------
    boxes : (T, 4) float, px
        NaN where unknown or absent.

    Returns
    -------
    dict from str to (T,) float
        1, 0 or NaN, see the module.
    """
    centers, areas = box_math.centers(boxes), box_math.area(boxes)
    steps = np.hypot(*np.diff(centers, axis=0, prepend=np.nan).T)
    with np.errstate(divide="ignore", invalid="ignore"):
        aspects = boxes[:, 2] / boxes[:, 3]
        values = {
            "fast_motion": fast_motion(steps, areas),
            "scale_change": _changed(areas),
            "aspect_change": _changed(aspects),
            "low_resolution": low_resolution(areas),
        }
    return values


def fast_motion(
    steps_px: NDArray[np.float64], areas_px2: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return where a target moves by more than half its size from frame to frame.

    Parameters
    ----------
    steps_px : (T,) float, px
        Distance of its centre from that in the frame before.
    areas_px2 : (T,) float, square px
        Of its box.

    Returns
    -------
    (T,) float
        1, 0, or NaN where either is NaN.
    """
    return _above(steps_px - _FAST * np.sqrt(areas_px2), 0.0)


def low_resolution(areas_px2: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where a box is smaller than 400 square pixels: (T,) 1, 0 or NaN."""
    return _above(-areas_px2, -_LOW_RESOLUTION_PX2)


def picture_attributes(
    sequence: Sequence, on_frame: Callable[[int, int], None] | None = None
) -> dict[str, NDArray[np.float64]]:
    """Return the attributes that pictures tell; each is decoded once.

    Parameters
    ----------
    sequence : Sequence
    on_frame : callable of (done, total), optional

    Returns
    -------
    dict from str to (T,) float
        ``grey``, the same in all frames, and ``camera_motion``.

    Raises
    ------
    DatasetError
        If a picture cannot be read, or has another size than the first.
    """
    count = len(sequence)
    moves = np.full(count, np.nan)
    samples = set(np.linspace(0, count - 1, _COLOUR_SAMPLES).astype(int).tolist())
    colours = []
    before: NDArray[np.uint8] | None = None
    scale = min(1.0, _WIDTH_PX / sequence.width)
    for index, frame in enumerate(sequence.frames):
        if index in samples:
            colours.append(_colour(frame.image))
        small = cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY)
        if scale < 1.0:
            size = _WIDTH_PX, max(1, round(sequence.height * scale))
            small = cv2.resize(small, size, interpolation=cv2.INTER_AREA)
        grey = np.asarray(small, dtype=np.uint8)
        if before is not None:
            target = sequence.truth.boxes[index - 1] * scale
            moves[index] = _background_step(before, grey, target) / scale
        before = grey
        if on_frame is not None:
            on_frame(index + 1, count)
    is_grey = float(max(colours) < _GREY_LEVELS)
    return {
        "grey": np.full(count, is_grey),
        "camera_motion": _above(moves, _MOVES_PX),
    }


def _above(values: NDArray[np.float64], threshold: float) -> NDArray[np.float64]:
    return np.where(np.isnan(values), np.nan, (values > threshold).astype(np.float64))


def _changed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return _above(np.abs(np.log(values / values[0])), float(np.log(_CHANGE)))


def _colour(image: NDArray[np.uint8]) -> float:
    """Return the mean difference between the greatest and the least channel."""
    return float(np.ptp(image[::4, ::4].astype(np.int16), axis=2).mean())


def _background_step(
    before: NDArray[np.uint8],
    after: NDArray[np.uint8],
    target: NDArray[np.float64],
) -> float:
    """Return how far the background moved, px; NaN where too little can be followed.

    Parameters
    ----------
    before, after : (H, W) uint8
    target : (4,) float, px
        Left out, with half its size around it; NaN where unknown.
    """
    mask = np.full(before.shape, 255, np.uint8)
    if np.isfinite(target).all():
        left, top, width, height = target.tolist()
        x, y = max(0, int(left - width / 2)), max(0, int(top - height / 2))
        mask[
            y : max(0, int(top + 1.5 * height)), x : max(0, int(left + 1.5 * width))
        ] = 0
    corners = cv2.goodFeaturesToTrack(before, _CORNERS, 0.01, 6, mask=mask)
    if corners is None or len(corners) < _LEAST_CORNERS:
        return float("nan")
    found, status, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, None)  # type: ignore[call-overload]
    kept = status[:, 0] == 1
    if kept.sum() < _LEAST_CORNERS:
        return float("nan")
    step = np.median((found - corners)[kept].reshape(-1, 2), axis=0)
    return float(np.hypot(*step))
