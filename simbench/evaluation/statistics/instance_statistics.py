"""Statistics of scores over scenario instances: spread, intervals, curves.

Scenario instances (scenario, variant and seed) are the independent samples: repetitions
on one are averaged first, since they share the sequence and would make the spread seem
smaller than it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr, stdtrit

from simbench.evaluation.statistics.intervals import (
    LEAST_COUNT,
    share_interval,
    student_interval,
)

__all__ = [
    "GROUP",
    "Curve",
    "Spread",
    "bootstrap_counts",
    "curve",
    "expanded_levels",
    "is_share",
    "seed_means",
    "spread",
    "summary",
]

GROUP: Final = ("scenario", "variant", "tracker")

_SPREAD_COLUMNS: Final = ("mean", "sd", "min", "max", "low", "high")
_UNBOUNDED: Final = ("fps", "particles", "seconds", "frames", "center_error")
_MOST_FPS: Final = 50_000.0
"""Frame rate above which a tracker does no work: 20 microseconds are a few calls."""
_UNITS: Final = ("_px", "_s", "_m", "_kmh", "_frames")


@dataclass(frozen=True, slots=True)
class Spread:
    """Summary statistics of n values; NaN where n is too small.

    Attributes
    ----------
    mean, minimum, maximum : float
        NaN if ``count`` is 0.
    sd : float
        Sample standard deviation (n - 1); NaN if ``count`` is below 2.
    low, high : float
        Confidence interval of the mean; NaN if ``count`` is below
        `simbench.evaluation.statistics.intervals.LEAST_COUNT`: too few for one.
    count : int
        Number of values that were not NaN.
    """

    mean: float
    sd: float
    minimum: float
    maximum: float
    low: float
    high: float
    count: int


def spread(
    values: ArrayLike, *, level: float = 0.95, is_bounded: bool = False
) -> Spread:
    """Return mean, standard deviation, range and confidence interval of values.

    Parameters
    ----------
    values : (n,) float
        One for each scenario instance; NaN is ignored.
    level : float, in (0, 1)
        Coverage of the interval.
    is_bounded : bool
        Whether the values are shares in [0, 1]. Then the interval is that of
        `simbench.evaluation.statistics.intervals.share_interval`, else Student's.

    Returns
    -------
    Spread

    Examples
    --------
    >>> found = spread([0.8, 1.0, 0.9, 0.9, 0.9], is_bounded=True)
    >>> round(found.mean, 3), found.count, round(found.low, 2), round(found.high, 2)
    (0.9, 5, 0.78, 0.99)
    """
    known = np.asarray(values, dtype=np.float64)
    known = known[~np.isnan(known)]
    count = len(known)
    nan = float("nan")
    if count == 0:
        return Spread(nan, nan, nan, nan, nan, nan, 0)
    mean, least, most = float(known.mean()), float(known.min()), float(known.max())
    if count == 1 or not np.isfinite(mean):
        return Spread(mean, nan, least, most, nan, nan, count)
    sd = float(known.std(ddof=1))
    if count < LEAST_COUNT:
        return Spread(mean, sd, least, most, nan, nan, count)
    interval = share_interval if is_bounded else student_interval
    low, high = interval(known, level)
    return Spread(mean, sd, least, most, float(low), float(high), count)


def is_share(measure: str) -> bool:
    """Return whether a measure is a share in [0, 1], by its name.

    Examples
    --------
    >>> is_share("success_50"), is_share("center_error_px"), is_share("fps")
    (True, False, False)
    """
    return not measure.startswith(_UNBOUNDED) and not measure.endswith(_UNITS)


def bootstrap_counts(
    count: int, samples: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Return how often each of ``count`` seeds occurs in each bootstrap sample.

    Returns
    -------
    (samples, count) int
        Rows sum to ``count``.
    """
    return rng.multinomial(count, np.full(count, 1.0 / count), size=samples)


def expanded_levels(count: int, level: float) -> tuple[float, float]:
    """Return the two quantiles of bootstrap means that bound an interval.

    The plain percentile interval of few values is too narrow. The tails are shrunk so
    that it is as wide, for normal values, as Student's t: with three seeds, the
    interval is from the minimum to the maximum of the bootstrap samples.

    Parameters
    ----------
    count : int
        Number of values, at least 2.
    level : float, in (0, 1)

    References
    ----------
    Hesterberg (2015), "What teachers should know about the bootstrap", The American
    Statistician 69(4), section 4.5 (the expanded percentile interval).

    Examples
    --------
    >>> [round(tail, 4) for tail in expanded_levels(10, 0.95)]
    [0.0086, 0.9914]
    """
    widest = stdtrit(count - 1, 0.5 - level / 2.0) * np.sqrt(count / (count - 1))
    tail = float(ndtr(widest))
    return tail, 1.0 - tail


def seed_means(runs: pd.DataFrame, measures: Sequence[str]) -> pd.DataFrame:
    """Average the repetitions of each tracker on each seed.

    Parameters
    ----------
    runs : DataFrame
        `simbench.evaluation.scores.Scores.runs`.
    measures : sequence of str
        Columns to average; NaN is ignored.

    Returns
    -------
    DataFrame
        One row for each scenario, variant, tracker and seed, in order of appearance,
        with these four as columns and the measures.
    """
    keys = [*GROUP, "seed"]
    grouped = runs.groupby(keys, sort=False, dropna=False)[list(measures)]
    return grouped.mean().reset_index()


def summary(runs: pd.DataFrame, measures: Sequence[str]) -> pd.DataFrame:
    """Summarise measures over seeds, by scenario, variant and tracker.

    Parameters
    ----------
    runs : DataFrame
        `simbench.evaluation.scores.Scores.runs`.
    measures : sequence of str
        Columns to summarise.

    Returns
    -------
    DataFrame
        One row for each scenario, variant and tracker in order of appearance:
        these three, the numbers of ``seeds``, ``runs`` and ``failed`` runs, and for
        each measure ``<measure>.mean, .sd, .min, .max, .low, .high`` as in `Spread`.
        Failed runs are included with their scores. A tracker that does no work, such as
        ``still``, has no frame rate.
    """
    if "fps" in measures:
        runs = runs.assign(fps=_rates_of_work(runs))
    by_seed = seed_means(runs, measures)
    groups = runs.groupby(list(GROUP), sort=False)
    rows = []
    for keys, seeds in by_seed.groupby(list(GROUP), sort=False):
        group = groups.get_group(keys)
        row: dict[str, object] = dict(zip(GROUP, keys, strict=True))
        row["seeds"] = len(seeds)
        row["runs"] = len(group)
        row["failed"] = int((group["status"] != "ok").sum())
        for measure in measures:
            known = seeds[measure]
            bounded = is_share(measure) and bool(known.dropna().between(0, 1).all())
            *values, _ = astuple(spread(known, is_bounded=bounded))
            names = (f"{measure}.{part}" for part in _SPREAD_COLUMNS)
            row |= zip(names, values, strict=True)
        rows.append(row)
    return pd.DataFrame(rows)


def _rates_of_work(runs: pd.DataFrame) -> pd.Series:
    """Return frame rates; NaN for trackers whose rate is that of the calls alone."""
    fastest = runs.groupby("tracker")["fps"].transform("max")
    return runs["fps"].mask(fastest > _MOST_FPS)


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve averaged over seeds.

    Attributes
    ----------
    mean : (K,) float
        NaN where no seed has a value.
    low, high : (K,) float
        95 % interval of the mean; with fewer than
        `simbench.evaluation.statistics.intervals.LEAST_COUNT` seeds the range over
        them.
    count : int
        Number of seeds.
    """

    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    count: int


def curve(
    runs: pd.DataFrame,
    frames: pd.DataFrame,
    column: str,
    shares: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> Curve:
    """Average a success or precision curve over the seeds of one tracker.

    Parameters
    ----------
    runs, frames : DataFrame
        Rows of `simbench.evaluation.scores.Scores` for one scenario, variant and
        tracker.
    column : str
        Column of ``frames``: ``overlap`` or ``center_error_px``.
    shares : callable, (F,) float to (K,) float
        `simbench.evaluation.measures.track_measures.success_curve` or
        `precision_curve`.

    Returns
    -------
    Curve
        A failed run without frames counts as a curve of zeros. Runs without a sequence
        or without a scored frame are ignored.
    """
    scored = frames[frames["scored"]]
    curves_by_run = {
        keys: shares(group[column].to_numpy())
        for keys, group in scored.groupby(["seed", "repetition"], dropna=False)
    }
    zeros = np.zeros_like(shares(np.zeros(1)))
    by_seed: dict[object, list[NDArray[np.float64]]] = {}
    measured = runs["success_50"].notna()
    for run, is_measured in zip(runs.itertuples(), measured, strict=True):
        found = curves_by_run.get((run.seed, run.repetition))
        if found is None and run.status == "failed" and is_measured:
            found = zeros
        if found is not None:
            by_seed.setdefault(run.seed, []).append(found)
    if not by_seed:
        unknown = np.full_like(zeros, np.nan)
        return Curve(unknown, unknown, unknown, 0)
    curves = np.array([np.mean(one, axis=0) for one in by_seed.values()])
    low, high = curves.min(axis=0), curves.max(axis=0)
    if len(curves) >= LEAST_COUNT:
        low, high = share_interval(curves.T)
    return Curve(curves.mean(axis=0), low, high, len(curves))
