"""The pictures of a report: three stills and a short animation, as JPEG in text."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.core.sequence import Sequence, Truth
from simbench.report.text import share

__all__ = ["Snapshot", "animation", "data_uri", "seen", "stills"]

_MOST_FRAMES: Final = 80
_STILL_WIDTH: Final = 640
_STILL_QUALITY: Final = 82
# Tried in turn, width [px] and JPEG quality, until the animation fits its budget.
_SIZES: Final = ((640, 72), (560, 68), (480, 64), (400, 60), (320, 55))


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One picture with the true box.

    Attributes
    ----------
    source : str
        Data URI of a JPEG.
    width, height : int, px
        Size of the sequence's frames, in which ``box`` is given.
    box : (left, top, width, height) or None
        True box, px; None where the target is absent.
    caption : str
    """

    source: str
    width: int
    height: int
    box: tuple[float, float, float, float] | None
    caption: str


def stills(sequence: Sequence) -> list[Snapshot]:
    """Return the first, the most occluded and the last frame with the target.

    The most occluded one is left out where the target is always in full view.
    """
    present = np.flatnonzero(~sequence.truth.absent)
    visible = np.nan_to_num(sequence.truth.visible_fraction[present], nan=1.0)
    chosen = {"First frame": int(present[0])}
    if visible.min() < 1.0:
        chosen["Most occluded"] = int(present[visible.argmin()])
    chosen["Last frame"] = int(present[-1])
    return [_still(sequence, index, title) for title, index in chosen.items()]


def animation(
    sequence: Sequence, tracks: Mapping[str, pd.DataFrame], budget_bytes: int
) -> dict[str, Any]:
    """Return what the player needs, as plain data.

    Parameters
    ----------
    sequence : Sequence
        At most 80 evenly spaced frames of it are read.
    tracks : mapping from tracker to DataFrame
        Frames of `simbench.evaluation.scores.Scores` on this sequence.
    budget_bytes : int
        What the pictures may take as text; width and quality come down to meet it.

    Returns
    -------
    dict
        ``width, height`` of the sequence [px]; ``images``, data URIs; ``frames``,
        their numbers; ``times`` [s]; ``truth`` and ``tracks[tracker]``, a box [px] or
        None by picture; ``visible``, a caption by picture.
    """
    step = max(1, -(-len(sequence) // _MOST_FRAMES))
    indices = list(range(0, len(sequence), step))
    width, quality = _affordable(sequence, indices, budget_bytes)
    images, times = [], []
    for index in indices:
        frame = sequence.frames[index]
        images.append(data_uri(frame.image, width, quality))
        times.append(round(frame.time_s, 3))
    return {
        "width": sequence.width,
        "height": sequence.height,
        "images": images,
        "frames": indices,
        "times": times,
        "truth": _boxes(sequence.truth.boxes[indices]),
        "visible": [seen(sequence.truth, index) for index in indices],
        "tracks": {
            tracker: _boxes(
                frames[["left", "top", "width", "height"]].to_numpy()[indices]
            )
            for tracker, frames in tracks.items()
            if len(frames) == len(sequence)
        },
    }


def _still(sequence: Sequence, index: int, title: str) -> Snapshot:
    frame = sequence.frames[index]
    box = sequence.truth.boxes[index]
    left, top, width, height = (round(float(value), 1) for value in box)
    return Snapshot(
        source=data_uri(frame.image, _STILL_WIDTH, _STILL_QUALITY),
        width=sequence.width,
        height=sequence.height,
        box=(left, top, width, height) if np.isfinite(box).all() else None,
        caption=f"{title}: frame {index}, {frame.time_s:.2f} s, "
        f"{seen(sequence.truth, index)}",
    )


def seen(truth: Truth, index: int) -> str:
    """Say how much of the target is seen, and what is in front of it."""
    if truth.absent[index]:
        return "target absent"
    fraction = float(truth.visible_fraction[index])
    if np.isnan(fraction):
        return "visible share unknown"
    occluder = truth.occluders[index]
    # Rounding must not call a target fully visible that is not.
    shown = share(min(fraction, 0.99) if fraction < 1.0 else fraction)
    return f"{shown} visible" + (f", behind {occluder}" if occluder else "")


def _affordable(
    sequence: Sequence, indices: list[int], budget_bytes: int
) -> tuple[int, int]:
    """Return the first of the sizes whose pictures fit, judged by five of them."""
    sample = [indices[i] for i in np.linspace(0, len(indices) - 1, 5).astype(int)]
    images = [sequence.frames[index].image for index in sample]
    for width, quality in _SIZES:
        mean = np.mean([len(data_uri(image, width, quality)) for image in images])
        if mean * len(indices) <= budget_bytes:
            return width, quality
    return _SIZES[-1]


def data_uri(image: NDArray[np.uint8], most_width: int, quality: int) -> str:
    """Return a picture (H, W, 3) uint8 as a JPEG in a data URI, made smaller to fit."""
    height, width = image.shape[:2]
    picture = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    if width > most_width:
        size = (most_width, max(1, round(height * most_width / width)))
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return "data:image/jpeg;base64," + base64.b64encode(jpeg.tobytes()).decode()


def _boxes(boxes: NDArray[np.float64]) -> list[list[float] | None]:
    return [
        [round(value, 1) for value in box] if np.isfinite(box).all() else None
        for box in boxes.tolist()
    ]
