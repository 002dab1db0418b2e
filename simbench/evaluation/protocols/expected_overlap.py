"""Accuracy, robustness and expected average overlap (EAO) of VOT's two protocols.

Overlaps are those of the VOT toolkit, see
`simbench.evaluation.measures.raster_overlap`; the first frame of each run, whose box is
given, has none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.evaluation.measures.presence import overlaps_of
from simbench.evaluation.measures.rules import RunBoxes
from simbench.evaluation.protocols.starts import restart_failure

__all__ = [
    "ProtocolScores",
    "multistart_curve",
    "multistart_scores",
    "restart_curve",
    "restart_scores",
]

_BURN_IN: Final = 10
_SENSITIVITY: Final = 30.0
_LOST_OVERLAP: Final = 0.1
_GRACE: Final = 10
_Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ProtocolScores:
    """The scores of a tracker over sequences by one of VOT's protocols.

    Attributes
    ----------
    accuracy : float, in [0, 1]
        Mean overlap before failures. NaN if there is no such frame.
    robustness : float, in [0, 1]
        Restart: exp(-30 failures / frames). Multi-start: share of the frames before
        failures.
    failures : float
        Failures per sequence; for restart averaged by length, as in the toolkit.
    eao : float, in [0, 1]
        Mean of the curve of expected average overlap over the lengths ``low`` to
        ``high``.
    low, high : int
        Frames. By default a quarter of the median length of the sequences, and that
        length.
    """

    accuracy: float
    robustness: float
    failures: float
    eao: float
    low: int
    high: int


def restart_scores(
    runs: Sequence[Sequence[RunBoxes]], low: int | None = None, high: int | None = None
) -> ProtocolScores:
    """Return the scores by the protocol ``restart``.

    Parameters
    ----------
    runs : sequence of sequence of RunBoxes
        By sequence, its segments in order; each reaches to the end of the sequence.
    low, high : int, optional

    Notes
    -----
    Accuracy leaves out the ten frames from each start on and averages over sequences
    by their length, as do failures.

    References
    ----------
    Kristan et al. (2016), "A novel performance evaluation methodology for single-target
    trackers", IEEE TPAMI 38(11); vot-toolkit 0.9.0, ``analysis/supervised.py``.
    """
    lengths = np.array([len(segments[0].truth) for segments in runs], np.float64)
    accuracies, failures = [], []
    for segments in runs:
        kept = [_fragment(one) for one in segments]
        frames = np.concatenate([overlap[_BURN_IN:] for overlap, _ in kept])
        accuracies.append(float(frames.mean()) if len(frames) else 0.0)
        failures.append(sum(has_failed for _, has_failed in kept))
    mean_failures = float(np.average(failures, weights=lengths))
    curve = restart_curve([one for segments in runs for one in segments])
    first, last = _interval(lengths, low, high)
    return ProtocolScores(
        float(np.average(accuracies, weights=lengths)),
        math.exp(-_SENSITIVITY * mean_failures / float(lengths.mean())),
        mean_failures,
        float(np.mean(curve[first : last + 1])),
        first,
        last,
    )


def restart_curve(segments: Sequence[RunBoxes]) -> _Floats:
    """Return the expected average overlap by length, of segments of any sequences.

    The mean overlap from the second frame to each length, over all segments, where one
    that failed has overlap 0 from then on and one that reached its end stops counting.
    """
    kept = [_fragment(one) for one in segments]
    longest = max(len(overlap) for overlap, _ in kept)
    rows = np.zeros((len(kept), longest))
    counts = np.zeros((len(kept), longest))
    for row, (overlap, has_failed) in enumerate(kept):
        rows[row, : len(overlap)] = overlap
        counts[row, : longest if has_failed else len(overlap)] = 1.0
    means = rows.copy()
    means[:, 1:] = np.cumsum(rows[:, 1:], axis=1) / np.arange(1, longest)
    total = counts.sum(axis=0)  # at least 1: the longest counts everywhere
    return np.asarray((means * counts).sum(axis=0) / total)


def multistart_scores(
    runs: Sequence[Sequence[RunBoxes]], low: int | None = None, high: int | None = None
) -> ProtocolScores:
    """Return the scores by the protocol ``multistart``.

    Parameters
    ----------
    runs : sequence of sequence of RunBoxes
        By sequence, its segments; the first begins at the first frame.
    low, high : int, optional

    References
    ----------
    Kristan et al. (2020), "The eighth visual object tracking VOT2020 challenge
    results", ECCVW; vot-toolkit 0.9.0, ``analysis/multistart.py``.
    """
    lengths = np.array([len(segments[0].truth) for segments in runs], np.float64)
    shares, kept, held, failures = [], 0.0, 0, []
    for segments in runs:
        before = [_progress(one) for one in segments]
        shares.append(sum(before) / sum(len(one.truth) for one in segments))
        kept += sum(
            float(overlaps_of(one)[:end].sum())
            for one, end in zip(segments, before, strict=True)
        )
        held += sum(before)
        failures.append(
            sum(end < len(one.truth) for one, end in zip(segments, before, strict=True))
        )
    first, last = _interval(lengths, low, high)
    curve = multistart_curve(runs, last)
    return ProtocolScores(
        kept / held if held else math.nan,
        float(np.average(shares, weights=lengths)),
        float(np.mean(failures)),
        float(np.mean(curve[first : last + 1])),
        first,
        last,
    )


def multistart_curve(runs: Sequence[Sequence[RunBoxes]], high: int) -> _Floats:
    """Return the expected average overlap for the lengths 0 to ``high`` - 1.

    As `restart_curve`, over the segments of all sequences. A length without any segment
    is 0, and a failed segment that is shorter than a length ``j`` counts with its sum
    over ``j - 1``, as in the toolkit.
    """
    total, count = np.zeros(high), np.zeros(high)
    for one in (one for segments in runs for one in segments):
        overlap, end = overlaps_of(one).copy(), _progress(one)
        overlap[end:] = 0.0
        size = min(len(overlap), high)
        steps = np.arange(1, size)
        total[1:size] += np.cumsum(overlap[1:size]) / steps
        count[1:size] += 1
        if end < len(overlap) and size < high:
            with np.errstate(divide="ignore", invalid="ignore"):
                total[size:] += overlap[1:].sum() / (np.arange(size, high) - 1)
            count[size:] += 1
    return np.divide(total, count, out=np.zeros(high), where=count > 0)


def _fragment(run: RunBoxes) -> tuple[_Floats, bool]:
    """Return the overlaps of a segment until it fails, and whether it does.

    Frames without the target, which VOT did not have, are left out.
    """
    truth = np.where(run.absent[:, None], np.nan, run.truth)
    failed = restart_failure(run.estimates, truth, (run.width, run.height))
    end = len(truth) if failed is None else failed
    return overlaps_of(run)[:end][~run.absent[:end]], failed is not None


def _progress(run: RunBoxes) -> int:
    """Return the frame after which ten in a row have an overlap of at most 0.1."""
    low = (overlaps_of(run) <= _LOST_OVERLAP) & ~run.absent
    grace = _GRACE
    for frame, is_low in enumerate(low.tolist()):
        grace = grace - 1 if is_low else _GRACE
        if grace == 0:
            return frame + 1 - _GRACE
    return len(low)


def _interval(lengths: _Floats, low: int | None, high: int | None) -> tuple[int, int]:
    median = int(np.median(lengths))
    last = max(median - 1, 1) if high is None else high
    return (max(median // 4, 1) if low is None else low), last
