"""Errors and overlap of a track by frame, and which of its frames are scored.

Frame rule, for every share and every curve of simbench: frame 0 is the box the tracker
was given and is not scored; frames in which the target is absent are not scored, but
counted; a frame without an estimate (NaN, after a failure) is a miss: overlap 0,
centre error infinite. `simbench.evaluation.measures.rules` has the rules of toolkits.
Frame 0 and absent frames are thus treated as in GOT-10k; the OTB toolkits (got10k
``ExperimentOTB``, pysot, pytracking) also count frame 0 as a hit, and pytracking and
pysot divide by all frames, absent ones included.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core import box

__all__ = ["center_error", "frame_overlap", "norm_center_error", "scored_frames"]


def scored_frames(absent: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which frames are scored.

    Parameters
    ----------
    absent : (T,) bool
        No part of the target projects into the image.

    Returns
    -------
    (T,) bool
        True except in frame 0, whose box is given, and where the target is absent. A
        target that is occluded but inside the image is scored.
    """
    scored = ~absent
    scored[:1] = False
    return scored


def center_error(
    estimates: NDArray[np.float64], truth: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance between the centres of estimate and truth by frame.

    Parameters
    ----------
    estimates, truth : (T, 4) float, px
        ``left, top, width, height``.

    Returns
    -------
    (T,) float, px, in [0, inf]
        NaN where the truth is NaN; infinite where only the estimate is.

    Notes
    -----
    Equal to got10k, pysot, pytracking and the OTB toolkit, which put the centre at
    ``left + (width - 1) / 2``: the half pixel cancels in the difference.
    """
    offset = box.centers(estimates) - box.centers(truth)
    return _missed(np.hypot(offset[:, 0], offset[:, 1]), truth, np.inf)


def norm_center_error(
    estimates: NDArray[np.float64], truth: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the centre error in units of the true box by frame.

    The offset is divided by the width and height of the truth, each at least 1 px,
    before its length is computed.

    Parameters
    ----------
    estimates, truth : (T, 4) float, px
        ``left, top, width, height``.

    Returns
    -------
    (T,) float, in [0, inf]
        NaN where the truth is NaN; infinite where only the estimate is.

    References
    ----------
    Mueller et al. (2018), "TrackingNet: a large-scale dataset and benchmark for object
    tracking in the wild", ECCV. The minimum of 1 px is that of the got10k toolkit.
    """
    offset = box.centers(estimates) - box.centers(truth)
    offset = offset / np.maximum(truth[:, 2:], 1.0)
    return _missed(np.hypot(offset[:, 0], offset[:, 1]), truth, np.inf)


def frame_overlap(
    estimates: NDArray[np.float64], truth: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the intersection over union of estimate and truth by frame.

    Parameters
    ----------
    estimates, truth : (T, 4) float, px
        ``left, top, width, height``; neither is clipped to the image.

    Returns
    -------
    (T,) float, in [0, 1]
        NaN where the truth is NaN; 0 where only the estimate is.

    Notes
    -----
    Continuous area, as in got10k, pysot, pytracking and the OTB toolkit. GOT-10k's
    own scores first clip both boxes to the image; the VOT toolkit rasterises them.
    """
    return _missed(box.overlap(estimates, truth), truth, 0.0)


def _missed(
    values: NDArray[np.float64], truth: NDArray[np.float64], miss: float
) -> NDArray[np.float64]:
    """Replace NaN by ``miss`` where the truth is known, by NaN elsewhere."""
    known = np.isfinite(truth).all(axis=1)
    filled = np.where(np.isnan(values), miss, values)
    return np.where(known, filled, np.nan)
