"""Pictures of a report: stills and a short animation, as embedded JPEG."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.core.sequence import Sequence, Truth
from simbench.report.text import percent

__all__ = ["Snapshot", "animation", "describe_visibility", "snapshot", "stills"]

Box: TypeAlias = list[float]

_MAX_FRAMES: Final = 80
_LEAST_FRAMES: Final = 8
_STILL_WIDTH_PX: Final = 640
_STILL_QUALITY: Final = 82
# Width [px] and JPEG quality, tried in order until the animation fits its budget.
_SIZES: Final = ((640, 72), (560, 68), (480, 64), (400, 60), (320, 55))


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One picture with the true box.

    Attributes
    ----------
    title, caption : str
    source : str
        Data URI of a JPEG; empty where there is no picture.
    width, height : int, px
        Size before scaling, in which the boxes are given.
    boxes : list of [left, top, width, height]
        Boxes to draw, px: the true box last, none where the target is absent.
    """

    title: str
    caption: str
    source: str
    width: int
    height: int
    boxes: list[Box]


def snapshot(
    title: str,
    caption: str,
    image: NDArray[np.uint8],
    boxes: NDArray[np.float64],
    *,
    max_width: int,
    quality: int,
) -> Snapshot:
    """Return a picture (H, W, 3) uint8 with its boxes (B, 4) px, without NaN boxes.

    The JPEG is scaled down to ``max_width`` px.
    """
    height, width = image.shape[:2]
    drawn = [box for box in _rounded_boxes(boxes) if box is not None]
    source = _data_uri(image, max_width, quality)
    return Snapshot(title, caption, source, width, height, drawn)


def stills(sequence: Sequence) -> list[Snapshot]:
    """Return the first, the most occluded and the last frame with the target.

    The most occluded frame is left out if the target is always fully visible.
    """
    truth = sequence.truth
    present = np.flatnonzero(~truth.absent)
    visible = np.nan_to_num(truth.visible_fraction[present], nan=1.0)
    chosen = {"First frame": int(present[0])}
    if visible.min() < 1.0:
        chosen["Most occluded"] = int(present[visible.argmin()])
    chosen["Last frame"] = int(present[-1])
    return [
        snapshot(
            title,
            f"frame {index}, {(frame := sequence.frames[index]).time_s:.2f} s, "
            f"{describe_visibility(truth, index)}",
            frame.image,
            truth.boxes[[index]],
            max_width=_STILL_WIDTH_PX,
            quality=_STILL_QUALITY,
        )
        for title, index in chosen.items()
    ]


def animation(
    sequence: Sequence, tracks: Mapping[str, pd.DataFrame], budget_bytes: int
) -> dict[str, Any]:
    """Return the data of the page's player.

    Parameters
    ----------
    sequence : Sequence
        At most 80 evenly spaced frames of it are read.
    tracks : mapping from tracker to DataFrame
        Frames of `simbench.evaluation.scores.Scores` on this sequence.
    budget_bytes : int
        Size of the encoded pictures; width and quality are lowered to meet it.

    Returns
    -------
    dict
        ``width, height`` of the sequence [px]; ``images``, data URIs; ``frames``,
        their numbers; ``times`` [s]; ``truth`` and ``tracks[tracker]``, a box [px] or
        None by picture; ``visible``, a caption by picture.
    """
    indices = _spaced(len(sequence), _MAX_FRAMES)
    width, quality, mean = _affordable_size(sequence, indices, budget_bytes)
    if mean * len(indices) > budget_bytes:  # of many scenarios each has little
        indices = _spaced(len(sequence), max(_LEAST_FRAMES, int(budget_bytes / mean)))
    images, times = [], []
    for index in indices:
        frame = sequence.frames[index]
        images.append(_data_uri(frame.image, width, quality))
        times.append(round(frame.time_s, 3))
    return {
        "width": sequence.width,
        "height": sequence.height,
        "images": images,
        "frames": indices,
        "times": times,
        "truth": _rounded_boxes(sequence.truth.boxes[indices]),
        "visible": [describe_visibility(sequence.truth, index) for index in indices],
        "tracks": {
            tracker: _rounded_boxes(
                frames[["left", "top", "width", "height"]].to_numpy()[indices]
            )
            for tracker, frames in tracks.items()
            if len(frames) == len(sequence)
        },
    }


def describe_visibility(truth: Truth, index: int) -> str:
    """Return the visible share of the target in a frame, and its occluder, as text."""
    if truth.absent[index]:
        return "target absent"
    fraction = float(truth.visible_fraction[index])
    if np.isnan(fraction):
        return "visible share unknown"
    occluder = truth.occluders[index]
    # A target that is partly hidden must not be rounded to fully visible.
    shown = percent(min(fraction, 0.99) if fraction < 1.0 else fraction)
    return f"{shown} visible" + (f", behind {occluder}" if occluder else "")


def _affordable_size(
    sequence: Sequence, indices: list[int], budget_bytes: int
) -> tuple[int, int, float]:
    """Return the first of the sizes whose pictures fit, and the bytes of a picture.

    Estimated from five of them; if none fits, the smallest.
    """
    subset = [indices[i] for i in np.linspace(0, len(indices) - 1, 5).astype(int)]
    images = [sequence.frames[index].image for index in subset]
    for width, quality in _SIZES:
        sizes = [len(_data_uri(image, width, quality)) for image in images]
        mean = float(np.mean(sizes))
        if mean * len(indices) <= budget_bytes:
            break
    return width, quality, mean


def _spaced(count: int, most: int) -> list[int]:
    """Return at most ``most`` evenly spaced numbers below ``count``, from 0."""
    return list(range(0, count, max(1, -(-count // most))))


def _data_uri(image: NDArray[np.uint8], max_width: int, quality: int) -> str:
    """Return a picture (H, W, 3) uint8 as a JPEG in a data URI, scaled down to fit."""
    height, width = image.shape[:2]
    picture = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    if width > max_width:
        size = (max_width, max(1, round(height * max_width / width)))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return "data:image/jpeg;base64," + base64.b64encode(jpeg.tobytes()).decode()


def _rounded_boxes(boxes: NDArray[np.float64]) -> list[Box | None]:
    """Return boxes rounded to 0.1 px, for JSON; None for a box with NaN."""
    return [
        [round(value, 1) for value in box] if np.isfinite(box).all() else None
        for box in boxes.tolist()
    ]
