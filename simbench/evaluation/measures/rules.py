"""The scoring rules of toolkits: which frames count, and how each is judged.

The measures of `simbench.evaluation.measures.track_measures` are the same everywhere;
toolkits differ in the frames that they count, in how they clip and round boxes, and in
what they take for a miss. A rule set turns the boxes of a run into overlaps and errors
by frame, after which any measure may be computed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import SimbenchError
from simbench.core.text import did_you_mean
from simbench.evaluation.measures import frame_errors, track_measures
from simbench.evaluation.measures.raster_overlap import raster_overlap

__all__ = ["RULES", "Judged", "RuleName", "Rules", "RunBoxes", "find_rules"]

RuleName = Literal["simbench", "otb", "got10k", "vot", "lasot"]

_VOT_BURN_IN: Final = 10  # frames after the start that are not counted
_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class RunBoxes:
    """What a rule set looks at: the boxes of one run over T frames.

    Attributes
    ----------
    estimates, truth : (T, 4) float, px
        ``left, top, width, height``. NaN where there is none.
    absent : (T,) bool
        The target is not in the image.
    said_absent : (T,) bool
        The tracker says so.
    visible_fraction : (T,) float, in [0, 1]
        NaN where unknown.
    width, height : int, px
        Size of the image.
    """

    estimates: _Floats
    truth: _Floats
    absent: _Flags
    said_absent: _Flags
    visible_fraction: _Floats
    width: int
    height: int

    @property
    def is_unknown(self) -> _Flags:
        """Where the target may be in the image but its box is not known, (T,)."""
        return ~self.absent & ~np.isfinite(self.truth).all(axis=1)


@dataclass(frozen=True, slots=True)
class Judged:
    """The frames of one run as a rule set judges them.

    Attributes
    ----------
    overlap : (T,) float, in [0, 1]
        0 for a miss; NaN where the truth is unknown and the frame is not scored.
    center_error : (T,) float, px
        Infinite for a miss; NaN as above.
    norm_center_error : (T,) float
        The same in units of the true box.
    scored : (T,) bool
        Frames that count.
    """

    overlap: _Floats
    center_error: _Floats
    norm_center_error: _Floats
    scored: _Flags


@dataclass(frozen=True, slots=True)
class Rules:
    """A rule set.

    Attributes
    ----------
    name : str
        One of `RuleName`.
    summary : str
        What it does, in one line for users.
    judge : callable, RunBoxes to Judged
    success_thresholds : (K,) float
        Of the success curve whose mean is ``success_auc``.
    one_is_reachable : bool
        Whether an overlap of exactly 1 passes the threshold 1.
    pooling : {"runs", "frames", "length"}
        Whether the toolkit's mean over sequences counts each run once or each frame
        that counts; or weights average overlap by the length of sequences.
    """

    name: RuleName
    summary: str
    judge: Callable[[RunBoxes], Judged]
    success_thresholds: _Floats
    one_is_reachable: bool = False
    pooling: Literal["runs", "frames", "length"] = "runs"

    def success_area(self, overlaps: _Floats) -> float:
        """Return the mean of the success curve over the thresholds of these rules.

        Parameters
        ----------
        overlaps : (F,) float, in [0, 1]
            Of the scored frames.
        """
        curve = track_measures.success_curve(overlaps, self.success_thresholds)
        if self.one_is_reachable and len(overlaps):
            curve[-1] = (overlaps >= 1.0).mean()
        return float(curve.mean())


def find_rules(name: str) -> Rules:
    """Return the rule set of a name.

    Raises
    ------
    SimbenchError
        If there is none, with the nearest name.
    """
    if name not in RULES:
        known = ", ".join(RULES)
        hint = did_you_mean(name, RULES)
        raise SimbenchError(f"rules: expected one of {known}, got {name!r}{hint}")
    return RULES[name]


def _by_simbench(run: RunBoxes) -> Judged:
    return Judged(
        frame_errors.frame_overlap(run.estimates, run.truth),
        frame_errors.center_error(run.estimates, run.truth),
        frame_errors.norm_center_error(run.estimates, run.truth),
        frame_errors.scored_frames(run.absent | run.is_unknown),
    )


def _by_otb(run: RunBoxes) -> Judged:
    """Judge as got10k's ``ExperimentOTB``: every frame counts, the first is a hit.

    Results are those of its text files, to a thousandth of a pixel. A frame without
    truth, which the benchmark does not have, is a miss.
    """
    estimates = _to_thousandths(run.estimates)
    estimates[:1] = run.truth[:1]
    return _every_frame(estimates, run.truth, _got10k_overlap(estimates, run.truth))


def _by_got10k(run: RunBoxes) -> Judged:
    """Judge as got10k's ``ExperimentGOT10k``: frames whose ``cover`` is above 0.

    The first frame does not count. Both boxes are clipped to the image in the toolkit's
    way, which keeps the width of a box that is cut on the left.
    """
    estimates = _to_thousandths(run.estimates)
    size = float(run.width), float(run.height)
    overlap = _got10k_overlap(
        _clipped_as_got10k(estimates, *size), _clipped_as_got10k(run.truth, *size)
    )
    covered = np.nan_to_num(run.visible_fraction, nan=1.0) > 0.0
    return Judged(
        overlap,
        frame_errors.center_error(estimates, run.truth),
        frame_errors.norm_center_error(estimates, run.truth),
        frame_errors.scored_frames(run.absent | run.is_unknown | ~covered),
    )


def _by_vot(run: RunBoxes) -> Judged:
    """Judge as the VOT toolkit's accuracy of an unsupervised run, burn-in 10.

    Boxes are rounded to whole pixels and cut at the image. An absent target is a
    hit where the tracker says so, else a miss. A frame after a failure is a miss.
    """
    estimates = np.where(run.said_absent[:, None], 0.0, run.estimates)
    truth = np.where(run.absent[:, None], 0.0, run.truth)
    has_answer = np.isfinite(estimates).all(axis=1)
    has_answer &= ~run.is_unknown
    overlap = np.zeros(len(truth))
    overlap[has_answer] = raster_overlap(
        estimates[has_answer], truth[has_answer], (run.width, run.height)
    )
    agreed = run.absent & run.said_absent
    missed = np.where(agreed, 0.0, np.inf)
    errors, norm_errors = (
        np.where(run.absent, missed, measure(run.estimates, run.truth))
        for measure in (frame_errors.center_error, frame_errors.norm_center_error)
    )
    scored = (np.arange(len(truth)) >= _VOT_BURN_IN) & ~run.is_unknown
    return Judged(
        np.where(run.is_unknown, np.nan, overlap), errors, norm_errors, scored
    )


def _by_lasot(run: RunBoxes) -> Judged:
    """Judge as the LaSOT toolkit: absent frames count as misses, the first as a hit.

    Absent is out of view or wholly hidden. A frame without an estimate repeats the
    last. A true box that begins outside the image, left or above, is no success but
    always precise, an accident of the toolkit.
    """
    estimates = _repeated(run.estimates)
    estimates[:1] = run.truth[:1]
    absent = run.absent | (run.visible_fraction == 0.0)
    overlap = _got10k_overlap(estimates, run.truth)
    errors = frame_errors.center_error(estimates, run.truth)
    offset = (estimates - run.truth) @ _CENTRE  # of the centres
    with np.errstate(divide="ignore", invalid="ignore"):
        norm_errors = np.hypot(*(offset / run.truth[:, 2:]).T)
    # counted from 1 there: a box at 0 begins in the first pixel
    is_outside = ~(run.truth + [1.0, 1.0, 0.0, 0.0] > 0.0).all(axis=1) & ~absent
    overlap = np.where(is_outside | absent, 0.0, overlap)
    errors = np.where(absent, np.inf, np.where(is_outside, 0.0, errors))
    norm_errors = np.where(absent, np.inf, np.where(is_outside, 0.0, norm_errors))
    return _every_frame_as(overlap, errors, norm_errors)


_CENTRE: Final = np.array([[1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.0, 0.5]])


def _every_frame(estimates: _Floats, truth: _Floats, overlap: _Floats) -> Judged:
    return _every_frame_as(
        overlap,
        frame_errors.center_error(estimates, truth),
        frame_errors.norm_center_error(estimates, truth),
    )


def _every_frame_as(overlap: _Floats, errors: _Floats, norm_errors: _Floats) -> Judged:
    """Score every frame; a frame whose truth is unknown is a miss."""
    return Judged(
        np.nan_to_num(overlap, nan=0.0),
        np.where(np.isnan(errors), np.inf, errors),
        np.where(np.isnan(norm_errors), np.inf, norm_errors),
        np.ones(len(overlap), dtype=np.bool_),
    )


def _got10k_overlap(estimates: _Floats, truth: _Floats) -> _Floats:
    """Return the overlap as got10k computes it: eps in the denominator; NaN is 0."""
    low = np.maximum(estimates[:, :2], truth[:, :2])
    high = np.minimum(estimates[:, :2] + estimates[:, 2:], truth[:, :2] + truth[:, 2:])
    shared = np.prod(np.maximum(high - low, 0.0), axis=1)
    areas = np.prod(estimates[:, 2:], axis=1) + np.prod(truth[:, 2:], axis=1)
    ratio = shared / (areas - shared + np.finfo(np.float64).eps)
    return np.asarray(np.nan_to_num(np.clip(ratio, 0.0, 1.0), nan=0.0))


def _clipped_as_got10k(boxes: _Floats, width: float, height: float) -> _Floats:
    corner = np.clip(boxes[:, :2], 0.0, [width, height])
    return np.hstack([corner, np.clip(boxes[:, 2:], 0.0, [width, height] - corner)])


def _to_thousandths(boxes: _Floats) -> _Floats:
    """Return boxes as a text file holds them that has three decimals."""
    return np.char.mod("%.3f", boxes).astype(np.float64)


def _repeated(boxes: _Floats) -> _Floats:
    """Return boxes where each one without area, or NaN, is that of the frame before."""
    with np.errstate(invalid="ignore"):
        has_area = (boxes[:, 2:] > 0.0).all(axis=1)
    is_valid = np.isfinite(boxes).all(axis=1) & has_area
    last = np.maximum.accumulate(np.where(is_valid, np.arange(len(boxes)), 0))
    return boxes[last]


_TWENTY_STEPS: Final = np.linspace(0.0, 1.0, 21)

RULES: Final[Mapping[str, Rules]] = {
    rules.name: rules
    for rules in (
        Rules(
            "simbench",
            "all frames but the first, without those in which the target is absent",
            _by_simbench,
            track_measures.SUCCESS_THRESHOLDS,
        ),
        Rules(
            "otb",
            "every frame, the first as a hit (got10k's ExperimentOTB)",
            _by_otb,
            _TWENTY_STEPS,
        ),
        Rules(
            "got10k",
            "all frames but the first that show the target, boxes cut at the image, "
            "101 thresholds (got10k's ExperimentGOT10k)",
            _by_got10k,
            np.linspace(0.0, 1.0, 101),
            pooling="frames",
        ),
        Rules(
            "vot",
            "frames from the eleventh on, boxes rounded to pixels and cut at the "
            "image, absence to be reported, 100 thresholds (vot-toolkit, burn-in 10)",
            _by_vot,
            np.linspace(0.0, 1.0, 100),
            one_is_reachable=True,
            pooling="length",
        ),
        Rules(
            "lasot",
            "every frame, the first as a hit, those without the target as misses; a "
            "missing estimate repeats the last (LaSOT's toolkit)",
            _by_lasot,
            track_measures.SUCCESS_THRESHOLDS,
        ),
    )
}
"""All rule sets by name."""
