"""Whether a tracker knows that it has lost its target: confidence against the truth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.evaluation.measures.losses import HIDDEN, Loss

__all__ = [
    "LOW_CONFIDENCE",
    "Calibration",
    "alarm_delays",
    "calibration",
    "false_alarms",
    "separation",
    "stated",
]

LOW_CONFIDENCE: Final = 0.5
"""A confidence below this, or the statement that the target is absent, is an alarm."""
_BINS: Final = 10
_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]


def stated(confidence: _Floats, said_absent: _Flags) -> _Floats | None:
    """Return the confidence that the box is on the target; None if it is not stated.

    Parameters
    ----------
    confidence : (T,) float, in [0, 1]
        NaN where the tracker states none.
    said_absent : (T,) bool
        Frames in which it says that the target is absent.

    Returns
    -------
    (T,) float, in [0, 1], or None
        0 where the target is said absent. None for a tracker that states nothing, or
        the same in every frame after the first, which says nothing either.
    """
    values = np.where(said_absent, 0.0, confidence)
    later = values[1:][np.isfinite(values[1:])]
    return values if len(later) and np.ptp(later) > 0.0 else None


def separation(confidence: _Floats, is_right: _Flags) -> float:
    """Return how well confidence tells right frames from wrong ones: the AUC.

    Parameters
    ----------
    confidence : (F,) float
        NaN is left out.
    is_right : (F,) bool

    Returns
    -------
    float, in [0, 1]
        Probability that a right frame has a higher confidence than a wrong one, ties
        counted by half: the area under the receiver operating characteristic. NaN if
        all frames are right, or none.

    References
    ----------
    Hanley, McNeil (1982), "The meaning and use of the area under a receiver operating
    characteristic (ROC) curve", Radiology 143(1).
    """
    known = np.isfinite(confidence)
    values, right = confidence[known], is_right[known]
    count, others = int(right.sum()), int((~right).sum())
    if count == 0 or others == 0:
        return float("nan")
    ranks = float(pd.Series(values).rank().to_numpy()[right].sum())
    return (ranks - count * (count + 1) / 2.0) / (count * others)


@dataclass(frozen=True, slots=True)
class Calibration:
    """Confidence against the share of frames that are right, in ten bins.

    Attributes
    ----------
    confidence : (10,) float, in [0, 1]
        Mean confidence of each bin ``[k / 10, (k + 1) / 10)``; the last includes 1. NaN
        in an empty bin.
    share : (10,) float, in [0, 1]
        Share of its frames that are right; NaN in an empty bin.
    count : (10,) int
        Its frames.
    """

    confidence: _Floats
    share: _Floats
    count: NDArray[np.int64]

    @property
    def error(self) -> float:
        """Expected calibration error, in [0, 1]: mean distance, weighted by frames.

        References
        ----------
        Guo et al. (2017), "On calibration of modern neural networks", ICML, eq. 3.
        """
        total = int(self.count.sum())
        if total == 0:
            return float("nan")
        filled = self.count > 0
        distance = np.abs(self.confidence - self.share)[filled]
        return float((distance * self.count[filled]).sum() / total)


def calibration(confidence: _Floats, is_right: _Flags) -> Calibration:
    """Return the calibration of confidences, (F,) float in [0, 1]; NaN is left out."""
    known = np.isfinite(confidence)
    values, right = confidence[known], is_right[known].astype(np.float64)
    bins = np.minimum((values * _BINS).astype(np.int64), _BINS - 1)
    count = np.bincount(bins, minlength=_BINS)
    filled = np.where(count > 0, count, np.nan)
    return Calibration(
        np.bincount(bins, values, _BINS) / filled,
        np.bincount(bins, right, _BINS) / filled,
        count.astype(np.int64),
    )


def alarm_delays(confidence: _Floats, losses: Iterable[Loss]) -> list[int | None]:
    """Return the frames from each loss to the first alarm before the target is found.

    0 where the alarm comes in the first lost frame, None where it never comes.
    """
    delays: list[int | None] = []
    for loss in losses:
        alarms = np.flatnonzero(confidence[loss.frame : loss.end] < LOW_CONFIDENCE)
        delays.append(int(alarms[0]) if len(alarms) else None)
    return delays


def false_alarms(
    confidence: _Floats, is_right: _Flags, visible_fraction: _Floats
) -> float:
    """Return the share of right frames with an alarm although the target is visible.

    Parameters
    ----------
    confidence : (F,) float, in [0, 1]
        NaN is left out.
    is_right : (F,) bool
        The box is on the target.
    visible_fraction : (F,) float, in [0, 1]
        Where it is NaN, unknown, the target counts as visible.

    Returns
    -------
    float, in [0, 1]
        NaN if there is no such frame.
    """
    seen = np.nan_to_num(visible_fraction, nan=1.0) >= HIDDEN
    values = confidence[is_right & seen & np.isfinite(confidence)]
    return float((values < LOW_CONFIDENCE).mean()) if len(values) else float("nan")
