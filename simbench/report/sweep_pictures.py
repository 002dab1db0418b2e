"""Pictures of a sweep: the surroundings of the target at each value of the dials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.evaluation.score_tables import frame_times
from simbench.evaluation.statistics.sweep_axes import Sweep
from simbench.report.pictures import Snapshot, describe_visibility, snapshot

__all__ = ["sweep_pictures"]

_WIDTH_PX: Final = 320
_QUALITY: Final = 78
_MIN_SHARE: Final = 0.2  # of the frame's width and height that is shown
_OCCLUDED_BELOW: Final = 0.95  # visible share
_CONTEXT: Final = 3.0  # extent shown around the target, in multiples of its size


def sweep_pictures(
    sweep: Sweep, sequences: Mapping[str, Sequence]
) -> list[list[Snapshot]]:
    """Return a row of pictures, or one for each value of the second dial.

    Parameters
    ----------
    sweep : Sweep
    sequences : mapping from variant to Sequence
        Of one seed; a variant that is missing has a snapshot without a picture.

    Returns
    -------
    list of list of Snapshot
        All show the same share of the frame around the target. Where an occlusion is
        swept, each is the most occluded frame; those without occlusion, and all
        pictures of other dials, are at the same time. Where the displacement is swept,
        the box of the previous frame is drawn too. Empty where there is no sequence.
    """
    points = sweep.points()
    shown = {variant: sequences[variant] for variant in points if variant in sequences}
    if not shown:
        return []
    frames = _chosen_frames(sweep, shown)
    boxes = {
        variant: _boxes(sweep, sequence, frames[variant])
        for variant, sequence in shown.items()
    }
    share = max(_needed_share(shown[variant], boxes[variant]) for variant in shown)
    rows: dict[tuple[float, ...], list[Snapshot]] = {}
    for variant, values in points.items():
        picture = Snapshot(variant, "not reached", "", 4, 3, [])
        if variant in shown:
            sequence, frame = shown[variant], frames[variant]
            picture = _cropped(variant, sequence, frame, boxes[variant], share)
        rows.setdefault(values[1:], []).append(picture)
    return list(rows.values())


def _chosen_frames(sweep: Sweep, shown: Mapping[str, Sequence]) -> dict[str, int]:
    """Return the frame to show of each sequence, one in which the target is present."""
    has_occlusion = any(dial.startswith("occlusion.") for dial in sweep.dials)
    if has_occlusion:
        reference = min(shown.values(), key=lambda one: float(_visible(one).min()))
        index = int(_visible(reference).argmin())
    else:
        reference = next(iter(shown.values()))
        present = np.flatnonzero(~reference.truth.absent)
        index = int(present[len(present) // 2])
    time_s = float(frame_times(reference)[index])
    return {
        variant: int(_visible(one).argmin())
        if has_occlusion and _visible(one).min() < _OCCLUDED_BELOW
        else _frame_at(one, time_s)
        for variant, one in shown.items()
    }


def _visible(sequence: Sequence) -> NDArray[np.float64]:
    """Return the visible share by frame, infinite where the target is absent."""
    visible = np.nan_to_num(sequence.truth.visible_fraction, nan=1.0)
    return np.where(sequence.truth.absent, np.inf, visible)


def _frame_at(sequence: Sequence, time_s: float) -> int:
    """Return the frame nearest to a time in which the target is present."""
    offsets = np.abs(frame_times(sequence) - time_s)
    return int(np.where(sequence.truth.absent, np.inf, offsets).argmin())


def _boxes(sweep: Sweep, sequence: Sequence, index: int) -> NDArray[np.float64]:
    """Return the boxes to draw, (1 or 2, 4), px."""
    boxes = sequence.truth.boxes
    if "displacement_px" in sweep.dials and index > 0:
        both = boxes[index - 1 : index + 1]
        if np.isfinite(both).all():
            return both
    return boxes[index : index + 1]


def _needed_share(sequence: Sequence, boxes: NDArray[np.float64]) -> float:
    """Return the share of the frame to show, so that the boxes fit with a margin."""
    size = (sequence.width, sequence.height)
    extent = (boxes[:, :2] + boxes[:, 2:]).max(axis=0) - boxes[:, :2].min(axis=0)
    target = boxes[-1, 2:] / size
    needed = float(np.max(extent / size + target))
    return float(np.clip(max(needed, _CONTEXT * float(target.max())), _MIN_SHARE, 1.0))


def _cropped(
    variant: str,
    sequence: Sequence,
    index: int,
    boxes: NDArray[np.float64],
    share: float,
) -> Snapshot:
    width, height = round(share * sequence.width), round(share * sequence.height)
    center = (boxes[:, :2] + 0.5 * boxes[:, 2:]).mean(axis=0)
    left = int(np.clip(center[0] - width / 2, 0, sequence.width - width))
    top = int(np.clip(center[1] - height / 2, 0, sequence.height - height))
    return snapshot(
        variant,
        f"frame {index}, {describe_visibility(sequence.truth, index)}",
        sequence.frames[index].image[top : top + height, left : left + width],
        boxes - (left, top, 0.0, 0.0),
        max_width=_WIDTH_PX,
        quality=_QUALITY,
    )
