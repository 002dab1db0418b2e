"""Measures of one track over its scored frames, as pure functions on arrays.

Shares are over the scored frames of one run, and are averaged over runs afterwards,
each run counting once. `simbench.evaluation.measures.frame_errors` says which frames
are scored.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "NORM_PRECISION_THRESHOLDS",
    "PRECISION_THRESHOLDS",
    "SUCCESS_THRESHOLDS",
    "average_overlap",
    "frames_per_second",
    "norm_precision",
    "norm_precision_area",
    "particle_usage",
    "precision",
    "precision_curve",
    "success",
    "success_area",
    "success_curve",
]

# Quotients, not accumulated steps: index 10 of the success thresholds is exactly 0.5.
PRECISION_THRESHOLDS: Final = np.arange(51, dtype=np.float64)
SUCCESS_THRESHOLDS: Final = np.arange(21) / 20.0
NORM_PRECISION_THRESHOLDS: Final = np.arange(51) / 100.0


def precision_curve(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of frames whose centre error is at most 0, 1, ..., 50 px.

    Parameters
    ----------
    errors : (F,) float, px
        Centre errors of the scored frames; infinite for a miss.

    Returns
    -------
    (51,) float, in [0, 1]
        One value for each of `PRECISION_THRESHOLDS`, **inclusive**; ascending. NaN if
        there is no frame.

    References
    ----------
    Wu, Lim, Yang (2015), "Object tracking benchmark", IEEE TPAMI 37(9); used by
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 4.3. Inclusive as in got10k, pysot, pytracking.
    """
    return _share(errors[:, None] <= PRECISION_THRESHOLDS)


def precision(errors: NDArray[np.float64], threshold_px: float = 20.0) -> float:
    """Return the share of frames whose centre error is at most a threshold.

    Parameters
    ----------
    errors : (F,) float, px
        Centre errors of the scored frames; infinite for a miss.
    threshold_px : float, px
        **Inclusive**. At 20 it is the precision score of the object tracking benchmark
        and element 20 of `precision_curve`.

    Returns
    -------
    float, in [0, 1]
        NaN if there is no frame.
    """
    return float(_share(errors <= threshold_px))


def success_curve(
    overlaps: NDArray[np.float64],
    thresholds: NDArray[np.float64] = SUCCESS_THRESHOLDS,
) -> NDArray[np.float64]:
    """Return the share of frames whose overlap is above 0, 0.05, ..., 1.

    Parameters
    ----------
    overlaps : (F,) float, in [0, 1]
        Overlaps of the scored frames; 0 for a miss.
    thresholds : (K,) float, in [0, 1]

    Returns
    -------
    (K,) float, in [0, 1]
        One value for each threshold, **strict**; descending. That at 1 is
        always 0, and a frame without any overlap fails even the first. NaN if there is
        no frame.

    References
    ----------
    Wu, Lim, Yang (2015), "Object tracking benchmark", IEEE TPAMI 37(9); used by
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 4.3. Strict as in got10k, pysot, pytracking; the
    VOT toolkit's plot has 100 thresholds and is inclusive at 1.
    """
    return _share(overlaps[:, None] > thresholds)


def average_overlap(overlaps: NDArray[np.float64]) -> float:
    """Return the mean overlap: GOT-10k's AO, and VOT's accuracy of a run.

    Parameters
    ----------
    overlaps : (F,) float, in [0, 1]
        Overlaps of the scored frames; 0 for a miss.

    Returns
    -------
    float, in [0, 1]
        NaN if there is no frame.

    References
    ----------
    Huang, Zhao, Huang (2021), "GOT-10k: a large high-diversity benchmark for generic
    object tracking in the wild", IEEE TPAMI 43(5), which names it AO.
    """
    return float(overlaps.mean()) if len(overlaps) else float("nan")


def success(overlaps: NDArray[np.float64], threshold: float = 0.5) -> float:
    """Return the share of frames whose overlap is above a threshold.

    Parameters
    ----------
    overlaps : (F,) float, in [0, 1]
        Overlaps of the scored frames; 0 for a miss.
    threshold : float, in [0, 1]
        **Strict**: an overlap of exactly 0.5 is no success. At 0.5 it is
        GOT-10k's success rate and element 10 of `success_curve`.

    Returns
    -------
    float, in [0, 1]
        NaN if there is no frame.
    """
    return float(_share(overlaps > threshold))


def success_area(overlaps: NDArray[np.float64]) -> float:
    """Return the area under the success curve: the mean of its 21 values.

    Parameters
    ----------
    overlaps : (F,) float, in [0, 1]
        Overlaps of the scored frames; 0 for a miss.

    Returns
    -------
    float, in [0, 20/21]
        20/21 = 0.952 for perfect boxes, since no overlap is above 1. NaN if there is
        no frame.

    Notes
    -----
    The "success score" or AUC of got10k's OTB experiment, pysot, pytracking and the
    OTB toolkit. With more thresholds it tends to the mean overlap.
    """
    return float(success_curve(overlaps).mean())


def norm_precision(errors: NDArray[np.float64], threshold: float = 0.2) -> float:
    """Return the share of frames whose normalised error is at most a threshold.

    Parameters
    ----------
    errors : (F,) float
        Normalised centre errors of the scored frames; infinite for a miss.
    threshold : float
        **Inclusive**. At 0.2 it is what pytracking and pysot print as normalised
        precision; got10k's LaSOT and TrackingNet experiments print
        `norm_precision_area` under the same name.

    Returns
    -------
    float, in [0, 1]
        NaN if there is no frame.
    """
    return float(_share(errors <= threshold))


def norm_precision_area(errors: NDArray[np.float64]) -> float:
    """Return the area under the normalised precision curve: the mean of 51 values.

    The values are the shares of frames whose normalised error is at most 0, 0.01, ...,
    0.5 (`NORM_PRECISION_THRESHOLDS`, **inclusive**).

    Parameters
    ----------
    errors : (F,) float
        Normalised centre errors of the scored frames; infinite for a miss.

    Returns
    -------
    float, in [0, 1]
        What got10k's LaSOT and TrackingNet experiments print as normalised precision;
        not the value at 0.2. NaN if there is no frame.
    """
    return float(_share(errors[:, None] <= NORM_PRECISION_THRESHOLDS).mean())


def frames_per_second(seconds: NDArray[np.float64]) -> float:
    """Return the number of updates over the total time they took.

    Parameters
    ----------
    seconds : (T,) float, s
        Wall time of the initialisation (element 0) and of each update; NaN from a
        failure on.

    Returns
    -------
    float, 1/s
        Initialisation is excluded: in a short sequence it would dominate. Updates
        without an estimate are excluded. NaN without a timed update.

    Notes
    -----
    Total frames over total time. The got10k toolkit prints the mean of ``1 / seconds``
    with initialisation included, which one fast frame can raise without bound.
    """
    updates = seconds[1:]
    updates = updates[np.isfinite(updates)]
    total = float(updates.sum())
    return len(updates) / total if total > 0.0 else float("nan")


def particle_usage(
    particles: NDArray[np.int64], estimated: NDArray[np.bool_]
) -> tuple[float, float]:
    """Return the minimum and the mean number of particles per frame.

    Parameters
    ----------
    particles : (T,) int
        Likelihood evaluations by frame; element 0 (initialisation) is not counted.
    estimated : (T,) bool
        Frames with an estimate; the others are not counted. Absent frames are, since
        the tracker works there too.

    Returns
    -------
    minimum, mean : float
        NaN if no frame is counted.

    References
    ----------
    Particle usage as tabulated by Yildirim et al., "direction-based modified particle
    filter for vehicle tracking", ETRI Journal (DPF), table 1.
    """
    used = particles[1:][estimated[1:]]
    if used.size == 0:
        return float("nan"), float("nan")
    return float(used.min()), float(used.mean())


def _share(hits: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the share of true elements along the first axis; NaN if it is empty."""
    if len(hits) == 0:
        return np.full(hits.shape[1:], np.nan)
    return np.asarray(hits.mean(axis=0), dtype=np.float64)
