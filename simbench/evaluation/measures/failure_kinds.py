"""Why an estimate is wrong, by frame, from what the simulator knows."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core import box
from simbench.core.camera import Camera
from simbench.core.sequence import Sequence
from simbench.core.tracker import FailureKind, Track
from simbench.evaluation.measures.losses import LOST_OVERLAP, occlusions

__all__ = ["FAILURE_KINDS", "failure_kinds", "main_failure"]

_ON_VEHICLE: Final = 0.3  # overlap with the box of another vehicle
_SCALE: Final = (
    4.0  # ratio of areas beyond which a size has nothing to do with the other
)
_FROZEN_FRAMES: Final = 5
_FROZEN_MOTION: Final = 0.25  # of the target's size, that it moves meanwhile

FAILURE_KINDS: Final = {
    "raised": "the tracker raised an error here or before",
    "hung": "it took too long, here or before",
    "not-a-number": "it returned an invalid number, here or before",
    "out of memory": "it ran out of its memory limit, here or before",
    "crashed": "its process ended, here or before",
    "box without target": "a box although the target is absent",
    "said absent": "said absent although something of the target is visible",
    "collapsed": "on the target, with less than a quarter of its area",
    "run away": "around the target, with more than four times its area",
    "frozen": "the same box for five frames and more while the target moves on",
    "distractor": "on another vehicle",
    "occluder": "where the target was last hidden",
    "lost": "elsewhere",
}
"""Kinds of failure of a frame, and their meaning. The first that fits is recorded."""

_ENDED: Final[dict[FailureKind, str]] = {
    "exception": "raised",
    "timeout": "hung",
    "not-a-number": "not-a-number",
    "memory": "out of memory",
    "crash": "crashed",
}
_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]


def failure_kinds(track: Track, sequence: Sequence) -> list[str]:
    """Return the kind of failure of each frame, empty where there is none.

    An estimate is a failure if its overlap with the truth is at most
    `simbench.evaluation.measures.losses.LOST_OVERLAP`, or its size is not that of the
    target.

    Parameters
    ----------
    track : Track
    sequence : Sequence
        As long as the track. Kinds that need other vehicles or occlusions are not
        found where it does not know these: the frame is then ``lost``.
    """
    truth, boxes = sequence.truth, track.boxes
    ratio = _area_ratio(boxes, truth.boxes)
    is_wrong = box.overlap(boxes, truth.boxes) <= LOST_OVERLAP
    has_box = np.isfinite(boxes).all(axis=1)
    has_truth = np.isfinite(truth.boxes).all(axis=1)
    found: dict[str, _Flags] = {
        "box without target": truth.absent & has_box,
        "said absent": track.absent & has_truth & (truth.visible_fraction != 0.0),
        "collapsed": _contains(truth.boxes, boxes) & (ratio < 1.0 / _SCALE),
        "run away": _contains(boxes, truth.boxes) & (ratio > _SCALE),
        "frozen": is_wrong & _frozen(boxes, truth.boxes),
        "distractor": is_wrong & _on_vehicle(boxes, sequence),
        "occluder": is_wrong & _on_occluder(boxes, sequence),
        "lost": is_wrong,
    }
    kinds = np.full(len(boxes), "", dtype=object)
    for kind, flags in reversed(found.items()):
        kinds[flags] = kind
    kinds[:1] = ""  # given
    for failure in track.failures:
        kinds[failure.frame :] = _ENDED[failure.kind]
    return [str(kind) for kind in kinds]


def main_failure(kinds: list[str]) -> tuple[str, int | None]:
    """Return the kind of most failed frames, and the first frame of it.

    Of several kinds with as many frames, the first; an empty text and None without any.
    """
    failed = [kind for kind in kinds if kind]
    if not failed:
        return "", None
    most = max(dict.fromkeys(failed), key=failed.count)
    return most, kinds.index(most)


def _area_ratio(boxes: _Floats, truth: _Floats) -> _Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio: _Floats = box.area(boxes) / box.area(truth)
    return ratio


def _contains(outer: _Floats, inner: _Floats) -> _Flags:
    """Return whether the centre of one box is inside the other."""
    point, low = box.centers(inner), outer[:, :2]
    inside: _Flags = np.all((point >= low) & (point <= low + outer[:, 2:]), axis=1)
    return inside


def _frozen(boxes: _Floats, truth: _Floats) -> _Flags:
    """Return where a box is the same as in the frames before, unlike the target."""
    numbers = np.arange(len(boxes))
    changes = np.ones(len(boxes), dtype=np.bool_)
    changes[1:] = (boxes[1:] != boxes[:-1]).any(axis=1)
    first = np.maximum.accumulate(np.where(changes, numbers, 0))  # with this box
    centers, size = box.centers(truth), np.sqrt(box.area(truth))
    moved = np.linalg.norm(centers - centers[first], axis=1)
    is_long = numbers - first + 1 >= _FROZEN_FRAMES
    return np.asarray(is_long & (moved > _FROZEN_MOTION * size), dtype=np.bool_)


def _on_vehicle(boxes: _Floats, sequence: Sequence) -> _Flags:
    vehicles = sequence.truth.vehicles
    if vehicles is None:
        return np.zeros(len(boxes), dtype=np.bool_)
    others = [i for i, v in enumerate(vehicles.vehicles) if v.name != "target"]
    shared = box.overlap(vehicles.boxes[:, others], boxes[:, None])
    seen = vehicles.visible_px[:, others] > 0.0
    on: _Flags = np.any(seen & (shared > _ON_VEHICLE), axis=1)
    return on


def _on_occluder(boxes: _Floats, sequence: Sequence) -> _Flags:
    """Return where a box is in the place in which the target was hidden last.

    The place is the true box in the most hidden frame of the last occlusion. Where the
    camera is known, its rotation since then is taken into account, its motion is not.
    """
    truth = sequence.truth
    on = np.zeros(len(boxes), dtype=np.bool_)
    events = occlusions(truth.visible_fraction, truth.absent) or ()
    for number, (first, last) in enumerate(events):
        peak = first + int(np.argmin(truth.visible_fraction[first : last + 1]))
        end = events[number + 1][0] if number + 1 < len(events) else len(boxes)
        frames = np.arange(first, end)
        places = _seen_later(truth.boxes[peak], peak, frames, sequence.cameras)
        on[first:end] = _contains(places, boxes[first:end])
    return on


def _seen_later(
    place: _Floats, before: int, later: NDArray[np.int64], cameras: tuple[Camera, ...]
) -> _Floats:
    """Return where a place in the image is after the camera has turned, (F, 4) px."""
    if not cameras:
        return np.tile(place, (len(later), 1))
    old, new = cameras[before], [cameras[frame] for frame in later]
    centre = np.append(box.centers(place), 1.0)
    direction = old.rotation.T @ np.linalg.solve(old.matrix, centre)
    rays = np.stack([one.matrix @ one.rotation @ direction for one in new])
    ahead = np.where(rays[:, 2:] > 0.0, rays[:, 2:], np.nan)
    focal = np.array([[one.focal_px] for one in new])
    size = place[2:] * focal / old.focal_px
    return np.hstack([rays[:, :2] / ahead - size / 2.0, size])
