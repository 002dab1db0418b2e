"""Boxes sampled around a target: candidates, and examples of it and of what is not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import centers, overlap

__all__ = [
    "boxes_off",
    "boxes_on",
    "candidate_boxes",
    "centered_inside",
    "regression_boxes",
    "resized",
    "whole_picture_boxes",
]

Boxes = NDArray[np.float64]

SCALE_STEP = 1.05
"""Ratio of two sizes, of the paper."""
_NEAR = (0.1, 2.5)  # deviations of examples: sides, steps of size
_FAR_STEPS = 5.0  # greatest change of size of those that are not the target
_REGRESSION = (0.3, 10.0, 0.1)  # greatest: sides, steps of size, log of the aspect
_TRIES = 20  # times as many boxes are sampled, at most, as are returned


def candidate_boxes(
    box: Boxes, count: int, spread: float, scale_spread: float, rng: np.random.Generator
) -> Boxes:
    """Return boxes around the last one of a target, (count, 4) px.

    Parameters
    ----------
    box : (4,) float, px
        ``left, top, width, height``, as everywhere here.
    count : int
    spread : float
        Standard deviation of the place, in mean sides of the box.
    scale_spread : float
        Standard deviation of the number of steps of 1.05 in size.
    rng : numpy.random.Generator

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking" (MDNet), CVPR 2016, section 5.1, target candidate generation.
    """
    return _moved(
        box,
        spread * rng.standard_normal((count, 2)),
        scale_spread * rng.standard_normal(count),
    )


def boxes_on(
    box: Boxes, count: int, least_overlap: float, rng: np.random.Generator
) -> Boxes:
    """Return boxes that overlap with a target's by at least a share, (count, 4) px.

    Normally distributed around it, as in the authors' code. The share is the
    intersection over the union, 0.7 in the paper's section 5.1.
    """
    spread, steps = _NEAR

    def sampled(number: int) -> Boxes:
        return candidate_boxes(box, number, spread, steps, rng)

    return _kept(sampled, count, lambda each: overlap(each, box) >= least_overlap, box)


def boxes_off(
    box: Boxes,
    count: int,
    most_overlap: float,
    reach: float,
    rng: np.random.Generator,
    extent: tuple[int, int] | None = None,
) -> Boxes:
    """Return boxes that overlap with a target's by at most a share, (count, 4) px.

    Uniformly distributed around it, as in the authors' code.

    Parameters
    ----------
    box : (4,) float, px
    count : int
    most_overlap : float
        Intersection over union.
    reach : float
        Greatest distance along each axis, in mean sides of the box.
    rng : numpy.random.Generator
    extent : (int, int), px, optional
        Width and height of the picture, in which the centres are.
    """

    def sampled(number: int) -> Boxes:
        found = _moved(
            box,
            rng.uniform(-reach, reach, (number, 2)),
            rng.uniform(-_FAR_STEPS, _FAR_STEPS, number),
        )
        return found if extent is None else centered_inside(found, extent)

    return _apart(sampled, count, most_overlap, box)


def whole_picture_boxes(
    box: Boxes,
    count: int,
    most_overlap: float,
    rng: np.random.Generator,
    extent: tuple[int, int],
) -> Boxes:
    """Return boxes anywhere in a picture, of about a target's size, (count, 4) px.

    Parameters as for `boxes_off`.
    """

    def sampled(number: int) -> Boxes:
        sizes = box[2:] * _scales(rng.uniform(-_FAR_STEPS, _FAR_STEPS, number))
        places = rng.uniform(0.0, 1.0, (number, 2)) * np.array(extent, np.float64)
        return np.concatenate([places - sizes / 2.0, sizes], axis=1)

    return _apart(sampled, count, most_overlap, box)


def regression_boxes(
    box: Boxes, count: int, least_overlap: float, rng: np.random.Generator
) -> Boxes:
    """Return boxes of other places, sizes and shapes for a regression, (count, 4) px.

    Uniformly distributed; they overlap with the target's by at least a share, as in the
    authors' code.
    """
    reach, steps, aspect = _REGRESSION

    def sampled(number: int) -> Boxes:
        found = _moved(
            box,
            rng.uniform(-reach, reach, (number, 2)),
            rng.uniform(-steps, steps, number),
        )
        shape = rng.uniform(-aspect, aspect, (number, 1)) * np.array([1.0, -1.0])
        return resized(found, found[:, 2:] * np.exp(shape))

    return _kept(sampled, count, lambda each: overlap(each, box) >= least_overlap, box)


def resized(boxes: Boxes, sizes: Boxes) -> Boxes:
    """Return boxes (N, 4) of other sizes (N, 2) around the same centres, px."""
    corners = boxes[:, :2] + (boxes[:, 2:] - sizes) / 2.0
    return np.concatenate([corners, sizes], axis=1)


def centered_inside(boxes: Boxes, extent: tuple[int, int]) -> Boxes:
    """Return boxes (N, 4) moved so that their centres are in a picture (px)."""
    found = boxes.copy()
    halves = boxes[:, 2:] / 2.0
    last = np.array(extent, np.float64) - 1.0
    found[:, :2] = np.clip(boxes[:, :2] + halves, 0.0, last) - halves
    return found


def _moved(box: Boxes, shifts: Boxes, steps: Boxes) -> Boxes:
    """Return a box moved by shifts (N, 2), in mean sides, and grown by steps (N,)."""
    sizes = box[2:] * _scales(steps)
    places = centers(box) + shifts * box[2:].mean()
    return np.concatenate([places - sizes / 2.0, sizes], axis=1)


def _scales(steps: Boxes) -> Boxes:
    """Return the factors of steps of size, (N,), as a column."""
    return np.asarray(SCALE_STEP ** steps[:, None], np.float64)


def _apart(
    sampled: Callable[[int], Boxes], count: int, most_overlap: float, box: Boxes
) -> Boxes:
    """Return boxes that overlap with one by at most a share; else one beside it."""
    aside = box + np.array([2.0 * box[2], 0.0, 0.0, 0.0])
    return _kept(sampled, count, lambda each: overlap(each, box) <= most_overlap, aside)


def _kept(
    sampled: Callable[[int], Boxes],
    count: int,
    is_kept: Callable[[Boxes], NDArray[np.bool_]],
    instead: Boxes,
) -> Boxes:
    """Return boxes that are kept of those sampled; if there are none, one instead."""
    found: list[Boxes] = []
    for _ in range(_TRIES):
        boxes = sampled(count)
        found.append(boxes[is_kept(boxes)])
        if sum(map(len, found)) >= count:
            break
    kept = np.concatenate(found)
    if not len(kept):
        kept = instead[None]
    return kept[np.arange(count) % len(kept)]
