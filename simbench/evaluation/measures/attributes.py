"""What makes a frame hard, by frame, from the truth: the attributes of benchmarks.

What a sequence does not know is unknown (NA), never false.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray
from pandas.arrays import BooleanArray

from simbench.core import box
from simbench.core.sequence import Sequence, Truth
from simbench.datasets.attributes import fast_motion, low_resolution
from simbench.evaluation.measures.losses import HIDDEN

__all__ = ["ATTRIBUTES", "attributes"]

ATTRIBUTES: Final = {
    "occluded": "less than half of the target is visible",
    "small": "the true box is smaller than 400 px² (low resolution in OTB)",
    "fast": "the target moves by more than half of its size from the last frame",
    "near_distractor": "another vehicle of its class is within one target's size",
    "night": "the scenario is at night",
}
"""Attributes of a frame, each a column of the frame table, and their meaning."""


def attributes(sequence: Sequence) -> dict[str, BooleanArray]:
    """Return each of `ATTRIBUTES` as a (T,) nullable boolean array.

    Parameters
    ----------
    sequence : Sequence

    References
    ----------
    Wu, Lim, Yang (2015), "Object tracking benchmark", IEEE TPAMI 37(9), table 2 (low
    resolution); Fan et al. (2021), "LaSOT: a high-quality large-scale single object
    tracking benchmark", IJCV 129, for motion in units of the target.
    """
    truth = sequence.truth
    area = box.area(truth.boxes)
    size = np.sqrt(area)
    there = ~truth.absent
    light = (sequence.scenario or {}).get("light")
    is_dark = isinstance(light, dict) and light.get("time") == "night"
    is_lit = sequence.scenario is not None
    return {
        "occluded": _known(
            truth.visible_fraction < HIDDEN, there & ~np.isnan(truth.visible_fraction)
        ),
        "small": _flags(low_resolution(area)),
        "fast": _flags(fast_motion(truth.displacement_px, area)),
        "near_distractor": _near_distractor(truth, size),
        "night": _known(
            np.full(len(area), is_dark), np.full(len(area), is_lit, dtype=np.bool_)
        ),
    }


def _near_distractor(truth: Truth, size: NDArray[np.float64]) -> BooleanArray:
    if truth.vehicles is None:
        return _known(np.zeros(len(size), np.bool_), np.zeros(len(size), np.bool_))
    every = truth.vehicles.vehicles
    kind = next((v.vehicle_class for v in every if v.name == "target"), None)
    others = [
        index
        for index, vehicle in enumerate(every)
        if vehicle.name != "target" and vehicle.vehicle_class == kind
    ]
    distance = box.gap(truth.vehicles.boxes[:, others], truth.boxes[:, None])
    shown = truth.vehicles.visible_px[:, others] > 0.0
    with np.errstate(invalid="ignore"):
        near = np.any(shown & (distance <= size[:, None]), axis=1)
    return _known(near, np.isfinite(size))


def _flags(values: NDArray[np.float64]) -> BooleanArray:
    """Return 1 and 0 as flags; NaN is unknown."""
    return _known(values == 1.0, ~np.isnan(values))


def _known(flags: NDArray[np.bool_], known: NDArray[np.bool_]) -> BooleanArray:
    return BooleanArray(np.asarray(flags, dtype=np.bool_), ~known)
