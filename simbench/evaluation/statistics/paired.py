"""Tests of paired differences, their correction for many tests, and their power.

A sign-flip test asks how often the mean of the differences is as large by chance, if
each could as well have had the other sign. It needs no distribution and is exact for
few pairs; with fewer than six it cannot reach 0.05.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import nctdtr, stdtrit

from simbench.evaluation.statistics.intervals import LEAST_COUNT, student_interval

__all__ = [
    "LEAST_PAIRS",
    "PairedDifference",
    "count_to_detect",
    "holm",
    "least_pairs",
    "paired_difference",
    "random_signs",
    "sign_flip_p",
]

Floats = NDArray[np.float64]
Alternative = Literal["two-sided", "less"]

LEAST_PAIRS: Final = 6
"""Fewest pairs of which a two-sided sign-flip test can be below 0.05: 2 / 2^6."""

_MOST_EXACT: Final = 13  # 2^13 sign flips, all of them
_FLIPS: Final = 10_000
_CHUNK: Final = 4096
_MOST_KEPT: Final = 2_000_000  # signs of one count: 16 MB
_SEED: Final = 0x5EED  # the same flips in every call: a p value has no luck
_ROUND_OFF: Final = 1e-9
_MOST_COUNT: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """Mean of paired differences, with its interval, test and effect sizes.

    Attributes
    ----------
    count : int
        Pairs in which both values are known.
    mean, sd : float
        NaN for no pair, the deviation also for one.
    low, high : float
        Student's 95 % interval of the mean; NaN for fewer than
        `simbench.evaluation.statistics.intervals.LEAST_COUNT` pairs.
    minimum, maximum : float
    p : float, in (0, 1]
        Of the two-sided sign-flip test, not corrected for other tests; 1 for no pair.
    effect : float
        Standardised mean difference of pairs (Cohen's d_z), mean / sd: infinite where
        all pairs differ equally, 0 where none does.
    wins : float, in [0, 1]
        Share of pairs with a positive difference, ties counting one half: the
        probability of superiority.
    """

    count: int
    mean: float
    sd: float
    low: float
    high: float
    minimum: float
    maximum: float
    p: float
    effect: float
    wins: float


def paired_difference(values: ArrayLike) -> PairedDifference:
    """Summarise and test paired differences.

    Parameters
    ----------
    values : (n,) float
        One for each scenario instance; NaN is ignored.

    Examples
    --------
    >>> found = paired_difference([0.1, 0.2, 0.1, 0.3, 0.1, 0.2])
    >>> found.count, round(found.mean, 3), found.p, found.wins
    (6, 0.167, 0.03125, 1.0)
    """
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    count, nan = len(known), float("nan")
    if count == 0:
        return PairedDifference(0, nan, nan, nan, nan, nan, nan, 1.0, nan, nan)
    mean = float(known.mean())
    sd = float(known.std(ddof=1)) if count > 1 else nan
    low = high = nan
    if count >= LEAST_COUNT:
        low, high = map(float, student_interval(known))
    if count > 1 and sd <= _ROUND_OFF:
        effect = 0.0 if abs(mean) <= _ROUND_OFF else math.copysign(math.inf, mean)
    else:
        effect = mean / sd
    wins = float((known > _ROUND_OFF).mean() + 0.5 * (abs(known) <= _ROUND_OFF).mean())
    ends = float(known.min()), float(known.max())
    p = float(sign_flip_p(known))
    return PairedDifference(count, mean, sd, low, high, *ends, p, effect, wins)


def sign_flip_p(
    values: Floats, alternative: Alternative = "two-sided", flips: int = _FLIPS
) -> Floats:
    """Return p values of sign-flip tests of the mean of paired differences.

    Parameters
    ----------
    values : (n,) or (n, k) float
        Differences, one test a column.
    alternative : {"two-sided", "less"}
        What is tested for: a mean that is not 0, or one below it.
    flips : int
        Random sign flips where all 2^n would be more than 8192.

    Returns
    -------
    () or (k,) float, in (0, 1]
        All sign flips are counted for up to 13 pairs, else the observed one and random
        ones, the same in every call.

    References
    ----------
    Fisher (1935), "The design of experiments", section 21. Phipson and Smyth (2010),
    "Permutation p-values should never be zero", Stat. Appl. Genet. Mol. Biol. 9(1):
    the observed flip counts.

    Examples
    --------
    >>> float(sign_flip_p(-np.ones(6), "less"))
    0.015625
    """
    table = values.reshape(len(values), -1)
    found = table.sum(axis=0)
    slack = _ROUND_OFF * np.abs(table).sum(axis=0)
    extreme, count = np.zeros(table.shape[1]), 0
    for signs in random_signs(len(table), flips):
        sums = signs @ table
        if alternative == "less":
            extreme += (sums <= found + slack).sum(axis=0)
        else:
            extreme += (np.abs(sums) >= np.abs(found) - slack).sum(axis=0)
        count += len(signs)
    return (extreme / count).reshape(values.shape[1:])


def holm(p_values: ArrayLike) -> Floats:
    """Return p values corrected for their number by Holm's method.

    Parameters
    ----------
    p_values : (m,) float, in [0, 1]

    Returns
    -------
    (m,) float, in [0, 1]
        One below a level is significant with the share of sets of tests that find
        anything where nothing is at most that level.

    References
    ----------
    Holm (1979), "A simple sequentially rejective multiple test procedure", Scand. J.
    Statist. 6(2).

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).tolist()
    [0.03, 0.06, 0.06]
    """
    p = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(p, kind="stable")
    scaled = p[order] * np.arange(len(p), 0, -1)
    corrected = np.empty_like(p)
    corrected[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return corrected


def count_to_detect(
    difference: float, sd: float, *, level: float = 0.05, power: float = 0.8
) -> int | None:
    """Return how many pairs a two-sided paired t test needs to see a difference.

    Parameters
    ----------
    difference : float
        True mean difference, not 0.
    sd : float
        Standard deviation of the paired differences.
    level, power : float, in (0, 1)
        False alarms and detections to plan for.

    Returns
    -------
    int or None
        At least `LEAST_PAIRS`; None for more than a million, or an unknown deviation.

    References
    ----------
    Cohen (1988), "Statistical power analysis for the behavioral sciences", section
    2.3: the power of the t test, by the noncentral t distribution.

    Examples
    --------
    >>> count_to_detect(0.5, 1.0)
    34
    """
    if not math.isfinite(sd) or difference == 0.0:
        return None
    if sd == 0.0:
        return LEAST_PAIRS
    shift = abs(difference) / sd

    def reaches(count: int) -> bool:
        bound = float(stdtrit(count - 1, 1.0 - level / 2.0))
        beta = float(nctdtr(count - 1, shift * math.sqrt(count), bound))
        return 1.0 - beta >= power

    # ahead of the normal approximation, whose noncentral t is out of range of scipy's
    if (2.8 / shift) ** 2 > _MOST_COUNT:
        return None
    low, high = LEAST_PAIRS - 1, LEAST_PAIRS
    while not reaches(high):
        low, high = high, 2 * high
        if high > _MOST_COUNT:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if reaches(middle) else (middle, high)
    return high


def least_pairs(comparisons: int, level: float = 0.05) -> int:
    """Return the fewest pairs with which one of several sign-flip tests can tell.

    The least p value of N pairs is 2 / 2^N; Holm's method multiplies the least of all
    by their number.

    Examples
    --------
    >>> least_pairs(1), least_pairs(3), least_pairs(15)
    (6, 7, 10)
    """
    return 1 + math.ceil(math.log2(max(comparisons, 1) / level))


def random_signs(count: int, flips: int) -> Iterable[Floats]:
    """Return rows of signs, the first all positive: all of them if they are few."""
    if count * flips <= _MOST_KEPT:
        return _kept_signs(count, flips)
    return _drawn_signs(count, flips)


@lru_cache(maxsize=4)
def _kept_signs(count: int, flips: int) -> tuple[Floats, ...]:
    """Return the same signs, kept: a report asks for those of one count a lot."""
    kept = tuple(_drawn_signs(count, flips))
    for signs in kept:
        signs.flags.writeable = False
    return kept


def _drawn_signs(count: int, flips: int) -> Iterator[Floats]:
    if count <= _MOST_EXACT:
        every = np.arange(2**count)[:, None] >> np.arange(count)
        yield _as_signs(every & 1)
        return
    rng = np.random.default_rng([_SEED, count])
    yield np.ones((1, count))
    for first in range(1, flips, _CHUNK):
        rows = min(_CHUNK, flips - first)
        drawn = np.frombuffer(rng.bytes(rows * ((count + 7) // 8)), np.uint8)
        yield _as_signs(np.unpackbits(drawn.reshape(rows, -1), axis=1, count=count))


def _as_signs(bits: NDArray[np.integer[Any]]) -> Floats:
    """Return 1 for each 0 and -1 for each 1."""
    return 1.0 - 2.0 * bits.astype(np.float64)
