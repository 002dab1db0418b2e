"""Measures of trackers that say whether the target is there: VOTS and long-term.

Overlaps are those of the VOT toolkit, see
`simbench.evaluation.measures.raster_overlap`. As there, the first frame counts as one
in which the target is said absent, so that a perfect tracker gets (T - 1) / T. A frame
after a failure is neither a box on the target nor a report of absence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.evaluation.measures.raster_overlap import raster_overlap
from simbench.evaluation.measures.rules import RunBoxes

__all__ = ["LongTerm", "Presence", "long_term", "overlaps_of", "presence"]

_MIN_ABSENT: Final = 10  # absence is judged only where it has more frames
_RESOLUTION: Final = 100  # thresholds of confidence


@dataclass(frozen=True, slots=True)
class Presence:
    """The measures of the VOTS challenge for one run and target, each in [0, 1].

    Attributes
    ----------
    quality : float
        Mean overlap of all frames, where agreement on absence is 1.
    accuracy : float
        Mean overlap of the frames with any, and of the first, which has none.
    robustness : float
        Share of the frames with the target in which the box touches it.
    not_reported_error : float
        Share of the frames with the target in which it is said absent (NRE).
    drift_rate_error : float
        Share of the frames with the target in which the box is elsewhere (DRE).
    absence_quality : float
        Share of the frames without the target in which it is said absent (ADQ); NaN
        for up to 10 of them.

    References
    ----------
    Kristan et al. (2023), "The first visual object tracking segmentation VOTS2023
    challenge results", ICCVW; vot-toolkit 0.9.0, ``analysis/longterm.py``.
    """

    quality: float
    accuracy: float
    robustness: float
    not_reported_error: float
    drift_rate_error: float
    absence_quality: float


def presence(run: RunBoxes) -> Presence:
    """Return the measures of the VOTS challenge for one run."""
    known = ~run.is_unknown
    overlap, absent = overlaps_of(run)[known], run.absent[known]
    said = run.said_absent[known]
    said[:1] = True
    tracked = ~absent & (overlap > 0.0)
    there, gone = int((~absent).sum()), int(absent.sum())
    missed = int((~absent & ~tracked & said).sum())
    hits = overlap[tracked]
    first = int(not absent[:1].all())
    nan = math.nan
    return Presence(
        float(overlap.mean()) if len(overlap) else nan,
        float(hits.sum()) / (len(hits) + first) if len(hits) + first else nan,
        len(hits) / there if there else nan,
        missed / there if there else nan,
        (there - len(hits) - missed) / there if there else nan,
        float(said[absent].mean()) if gone > _MIN_ABSENT else nan,
    )


@dataclass(frozen=True, slots=True)
class LongTerm:
    """Tracking precision, recall and F at the confidence that makes F greatest.

    Attributes
    ----------
    precision : float, in [0, 1]
        Mean overlap of the frames in which the tracker is at least so confident.
    recall : float, in [0, 1]
        Sum of these overlaps over the number of frames with the target.
    f : float, in [0, 1]
        Harmonic mean of the two.
    """

    precision: float
    recall: float
    f: float


def long_term(run: RunBoxes, confidence: NDArray[np.float64]) -> LongTerm:
    """Return the measures of VOT's long-term challenge for one run.

    Parameters
    ----------
    run : RunBoxes
    confidence : (T,) float, in [0, 1]
        NaN where the tracker states none: 0 in each such frame, so that a tracker
        without confidence is judged by all its boxes.

    References
    ----------
    Lukezic et al. (2018), "Now you see me: evaluating performance in long-term visual
    tracking"; vot-toolkit 0.9.0, ``analysis/longterm.py``. Where the target is said
    absent, or after a failure, there is no prediction, at any threshold.
    """
    known = ~run.is_unknown
    overlap = np.where(run.absent, 0.0, overlaps_of(run))[known]
    has_box = np.isfinite(run.estimates[known]).all(axis=1)
    level = np.where(has_box, np.nan_to_num(confidence[known], nan=0.0), -np.inf)
    level[:1] = 0.0
    shown = int((~run.absent[known]).sum())
    if shown == 0:
        return LongTerm(math.nan, math.nan, math.nan)
    best = LongTerm(1.0, 0.0, 0.0)
    for threshold in _thresholds(level[np.isfinite(level)]):
        subset = overlap[level >= threshold]
        if len(subset) == 0:
            continue
        precision, recall = float(subset.mean()), float(subset.sum()) / shown
        total = precision + recall
        f = 2.0 * precision * recall / total if total > 0.0 else 0.0
        if f > best.f:
            best = LongTerm(precision, recall, f)
    return best


def _thresholds(levels: NDArray[np.float64]) -> list[float]:
    """Return confidences that part the frames evenly, the highest first."""
    ordered = np.sort(levels)[::-1]
    if len(ordered) > _RESOLUTION - 2:
        step = len(ordered) // (_RESOLUTION - 2)
        places = np.linspace(step, len(ordered) - step, num=_RESOLUTION - 2)
        ordered = ordered[np.round(places).astype(np.int64)]
    return [*ordered.tolist(), -1.0]


def overlaps_of(run: RunBoxes) -> NDArray[np.float64]:
    """Return the overlap by frame: 0 in the first, and where there is no answer."""
    estimates = np.where(run.said_absent[:, None], 0.0, run.estimates)
    truth = np.where(run.absent[:, None], 0.0, run.truth)
    rows = np.isfinite(estimates).all(axis=1) & ~run.is_unknown
    overlap = np.zeros(len(truth))
    size = run.width, run.height
    overlap[rows] = raster_overlap(estimates[rows], truth[rows], size)
    overlap[:1] = 0.0
    return overlap
