"""Sample pictures of a sweep, so that a reader sees what a dial does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.evaluation.score_tables import frame_times
from simbench.evaluation.sweep_axes import Sweep
from simbench.report.pictures import data_uri, seen

__all__ = ["Sample", "samples"]

Box: TypeAlias = tuple[float, float, float, float]

_WIDTH: Final = 320
_QUALITY: Final = 78
_LEAST_SHARE: Final = 0.2  # of the picture's width and height that is shown
_PLAIN: Final = 0.95  # a target seen to this share is not hidden to speak of
_ROOM: Final = 3.0  # shown around the target, in its own sizes


@dataclass(frozen=True, slots=True)
class Sample:
    """A part of one picture, with the true box.

    Attributes
    ----------
    variant : str
    source : str
        Data URI of a JPEG; empty where there is no sequence.
    width, height : float, px
        Size of the part, in which the boxes are given.
    boxes : tuple of (left, top, width, height)
        The true box, preceded by that of the frame before where the dial is the
        target's move.
    caption : str
    """

    variant: str
    source: str
    width: float
    height: float
    boxes: tuple[Box, ...]
    caption: str


def samples(sweep: Sweep, filmed: Mapping[str, Sequence]) -> list[list[Sample]]:
    """Return a row of samples, or one for each value of the second dial.

    Parameters
    ----------
    sweep : Sweep
    filmed : mapping from variant to Sequence
        Of one seed; what is missing is a sample without a picture.

    Returns
    -------
    list of list of Sample
        All show the same share of the picture around the target: where an occlusion
        is swept, each at its most hidden, else all at the same time, as are those in
        which nothing is hidden. Empty where nothing was filmed.
    """
    points = sweep.points()
    shown = {variant: filmed[variant] for variant in points if variant in filmed}
    if not shown:
        return []
    moments = _moments(sweep, shown)
    boxes = {
        variant: _boxes(sweep, sequence, moments[variant])
        for variant, sequence in shown.items()
    }
    share = max(_share(shown[variant], boxes[variant]) for variant in shown)
    rows: dict[tuple[float, ...], list[Sample]] = {}
    for variant, values in points.items():
        sample = Sample(variant, "", 4.0, 3.0, (), "not reached")
        if variant in shown:
            sample = _sample(
                variant, shown[variant], moments[variant], boxes[variant], share
            )
        rows.setdefault(values[1:], []).append(sample)
    return list(rows.values())


def _moments(sweep: Sweep, shown: Mapping[str, Sequence]) -> dict[str, int]:
    """Return the frame to show of each sequence, one with the target in it."""
    if any(dial.startswith("occlusion.") for dial in sweep.dials):
        deepest = min(shown.values(), key=lambda one: float(_visible(one).min()))
        time_s = float(frame_times(deepest)[_visible(deepest).argmin()])
        return {
            variant: int(_visible(one).argmin())
            if _visible(one).min() < _PLAIN
            else _frame_at(one, time_s)
            for variant, one in shown.items()
        }
    first = next(iter(shown.values()))
    present = np.flatnonzero(~first.truth.absent)
    time_s = float(frame_times(first)[present[len(present) // 2]])
    return {variant: _frame_at(one, time_s) for variant, one in shown.items()}


def _visible(sequence: Sequence) -> NDArray[np.float64]:
    """Return the visible share by frame, infinite where the target is absent."""
    visible = np.nan_to_num(sequence.truth.visible_fraction, nan=1.0)
    return np.where(sequence.truth.absent, np.inf, visible)


def _frame_at(sequence: Sequence, time_s: float) -> int:
    away = np.abs(frame_times(sequence) - time_s)
    return int(np.where(sequence.truth.absent, np.inf, away).argmin())


def _boxes(sweep: Sweep, sequence: Sequence, index: int) -> NDArray[np.float64]:
    """Return the boxes to draw, (1 or 2, 4), px."""
    known = sequence.truth.boxes
    if "displacement_px" in sweep.dials and index > 0:
        both = known[index - 1 : index + 1]
        if np.isfinite(both).all():
            return both
    return known[index : index + 1]


def _share(sequence: Sequence, boxes: NDArray[np.float64]) -> float:
    """Return the share of the picture to show, so that the boxes have room in it."""
    extent = (boxes[:, :2] + boxes[:, 2:]).max(axis=0) - boxes[:, :2].min(axis=0)
    target = boxes[-1, 2:] / (sequence.width, sequence.height)
    needed = float(np.max(extent / (sequence.width, sequence.height) + target))
    return float(np.clip(max(needed, _ROOM * float(target.max())), _LEAST_SHARE, 1.0))


def _sample(
    variant: str,
    sequence: Sequence,
    index: int,
    boxes: NDArray[np.float64],
    share: float,
) -> Sample:
    width, height = round(share * sequence.width), round(share * sequence.height)
    middle = (boxes[:, :2] + 0.5 * boxes[:, 2:]).mean(axis=0)
    left = int(np.clip(middle[0] - width / 2, 0, sequence.width - width))
    top = int(np.clip(middle[1] - height / 2, 0, sequence.height - height))
    frame = sequence.frames[index]
    part = frame.image[top : top + height, left : left + width]
    drawn = (boxes - (left, top, 0.0, 0.0)).round(1)
    return Sample(
        variant,
        data_uri(part, _WIDTH, _QUALITY),
        width,
        height,
        tuple((box[0], box[1], box[2], box[3]) for box in drawn.tolist()),
        f"frame {index}, {seen(sequence.truth, index)}",
    )
