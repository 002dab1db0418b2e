"""When a tracker loses its target, finds it again, and how long it holds it.

A target is lost from the first of `LOSS_FRAMES` frames in a row with an overlap of at
most `LOST_OVERLAP`, and found again in the first frame with an overlap above
`FOUND_OVERLAP`: a tracker whose box flickers around one threshold does not lose and
find in turn. Only scored frames count: a target cannot be lost while it is absent.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "FOUND_OVERLAP",
    "HIDDEN",
    "LOSS_FRAMES",
    "LOST_OVERLAP",
    "Loss",
    "Survival",
    "find_losses",
    "occlusions",
    "runs_of",
    "survival",
]

LOST_OVERLAP: Final = 0.1
"""As in VOT's multi-start protocol."""
LOSS_FRAMES: Final = 5
FOUND_OVERLAP: Final = 0.5
HIDDEN: Final = 0.5
"""A target is occluded while less than this share of it is visible."""


@dataclass(frozen=True, slots=True)
class Loss:
    """One loss of the target.

    Attributes
    ----------
    frame : int
        First frame without the target.
    found : int or None
        Frame in which it is found again, None if never.
    end : int
        ``found``, or the number of frames.
    """

    frame: int
    found: int | None
    end: int


def find_losses(
    overlap: NDArray[np.float64], scored: NDArray[np.bool_]
) -> tuple[Loss, ...]:
    """Return the losses of one run, in order.

    Parameters
    ----------
    overlap : (T,) float, in [0, 1]
        0 where there is no estimate.
    scored : (T,) bool
        Frames that count.
    """
    frames = np.flatnonzero(scored)
    known = overlap[frames]
    losses: list[Loss] = []
    free_from = 0
    for first, last in runs_of(known <= LOST_OVERLAP):
        if first < free_from or last - first + 1 < LOSS_FRAMES:
            continue
        again = first + np.flatnonzero(known[first:] > FOUND_OVERLAP)
        found = int(frames[again[0]]) if len(again) else None
        end = len(overlap) if found is None else found
        losses.append(Loss(int(frames[first]), found, end))
        free_from = int(again[0]) if len(again) else len(known)
    return tuple(losses)


def occlusions(
    visible_fraction: NDArray[np.float64], absent: NDArray[np.bool_]
) -> tuple[tuple[int, int], ...] | None:
    """Return the first and last frame of each occlusion; None if that is not known.

    Parameters
    ----------
    visible_fraction : (T,) float, in [0, 1]
        NaN where unknown.
    absent : (T,) bool
    """
    if np.isnan(visible_fraction[~absent]).all():
        return None
    return tuple(runs_of(~absent & (visible_fraction < HIDDEN)))


def runs_of(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the first and last index of each run of true values."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    firsts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    yield from zip(firsts.tolist(), (ends - 1).tolist(), strict=True)


@dataclass(frozen=True, slots=True)
class Survival:
    """The share of runs that still hold their target, by time.

    Attributes
    ----------
    time_s : (K,) float, s
        Times of losses and of ends of runs, ascending; the first is 0.
    share : (K,) float, in [0, 1]
        Kaplan-Meier estimate just after each time.
    low, high : (K,) float, in [0, 1]
        95 % interval by Greenwood's formula on the log-log scale; NaN where it is not
        defined, as where no run or every run was lost.
    """

    time_s: NDArray[np.float64]
    share: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def survival(time_s: ArrayLike, is_lost: ArrayLike) -> Survival:
    """Return the survival curve of the time to the first loss.

    Parameters
    ----------
    time_s : (N,) float, s
        Time to the first loss, or to the end of a run without one.
    is_lost : (N,) bool
        False where the run ended first: the loss is censored, it would come later.

    Raises
    ------
    ValueError
        If there is no run.

    References
    ----------
    Kaplan, Meier (1958), "Nonparametric estimation from incomplete observations", JASA
    53(282); the interval is the log-log one of Kalbfleisch, Prentice (1980), "The
    Statistical Analysis of Failure Time Data", with Greenwood's variance. As
    `scipy.stats.ecdf`, whose import takes longer than a short run.
    """
    times = np.asarray(time_s, dtype=np.float64)
    lost = np.asarray(is_lost, dtype=np.bool_)
    if len(times) == 0:
        raise ValueError("time_s: expected at least one run, got none")
    moments, place = np.unique(times, return_inverse=True)
    losses = np.bincount(place, lost)
    ended = np.bincount(place)
    at_risk = ended[::-1].cumsum()[::-1]
    share = np.cumprod(1.0 - losses / at_risk)
    with np.errstate(divide="ignore", invalid="ignore"):  # undefined is NaN
        variance = np.cumsum(losses / (at_risk * (at_risk - losses)))
        width = NormalDist().inv_cdf(0.975) * np.sqrt(variance) / np.log(share)
        middle = np.log(-np.log(share))
        low, high = (np.exp(-np.exp(middle + side * width)) for side in (-1.0, 1.0))
    return Survival(
        np.concatenate([[0.0], moments]),
        np.concatenate([[1.0], share]),
        np.concatenate([[1.0], low]),
        np.concatenate([[1.0], high]),
    )
