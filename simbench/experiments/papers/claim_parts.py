"""The parts of a published claim: one-sided tests, and what they would have seen.

Every one-sided test is at 2.5 %, as the two sides of an interval of 95 % are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr, bdtrc, betaincinv, stdtr, stdtrit

from simbench.evaluation.statistics.instance_statistics import spread
from simbench.evaluation.statistics.paired import paired_difference

__all__ = ["LEVEL", "Part", "difference_part", "range_part", "share_part"]

Floats = NDArray[np.float64]

LEVEL: Final = 0.025
"""Of each one-sided test."""
_SUPPOSED_SHARE: Final = 0.8  # for which the power of a test of a share is stated
_POWER: Final = 0.8  # for which the least difference that is seen is stated


@dataclass(frozen=True, slots=True)
class Part:
    """One comparison that a claim consists of.

    Attributes
    ----------
    what : str
        Which: a scenario, two trackers.
    measured : str
        With its 95 % interval.
    count : int
        Scenario instances; 0 where a tracker is missing.
    p_for, p_against : float, in (0, 1]
        Of the one-sided tests that the part is true, or that its opposite is; not
        corrected.
    power : str
        What the test would have seen.
    """

    what: str
    measured: str
    count: int
    p_for: float
    p_against: float
    power: str


def share_part(what: str, values: ArrayLike, *, above: bool = True) -> Part:
    """Test that an event happens in more than half of the instances, or in less.

    Parameters
    ----------
    what : str
    values : (n,) float
        1 where it happens, 0 where not; NaN is ignored.
    above : bool
        Whether the claim is that it happens in more than half.

    References
    ----------
    Clopper and Pearson (1934), "The use of confidence or fiducial limits illustrated
    in the case of the binomial", Biometrika 26(4).

    Examples
    --------
    >>> part = share_part("poles", [1.0] * 18 + [0.0] * 2)
    >>> part.measured, round(part.p_for, 4)
    ('18 of 20, 0.90 [0.68, 0.99]', 0.0002)
    """
    known = _known(values)
    count, hits = len(known), int(known.sum())
    if not count:
        return _absent(what)
    more = float(bdtrc(hits - 1, count, 0.5)) if hits else 1.0
    less = float(bdtr(hits, count, 0.5))
    low = float(betaincinv(hits, count - hits + 1, LEVEL)) if hits else 0.0
    high = 1.0
    if hits < count:
        high = float(betaincinv(hits + 1, count - hits, 1.0 - LEVEL))
    text = f"{hits} of {count}, {hits / count:.2f} [{low:.2f}, {high:.2f}]"
    true_share = _SUPPOSED_SHARE if above else 1.0 - _SUPPOSED_SHARE
    power = f"a true share of {true_share:.1f}: shown with {_share_power(count):.0%}"
    return Part(what, text, count, *((more, less) if above else (less, more)), power)


def difference_part(
    what: str, differences: ArrayLike, unit: str = "", *, decimals: int = 2
) -> Part:
    """Test that paired differences are above 0 in the mean, by sign flips.

    Parameters
    ----------
    what : str
    differences : (n,) float
        One for each scenario instance; NaN is ignored.
    unit : str
    decimals : int
        Of the printed means.

    Examples
    --------
    >>> part = difference_part("a - b", [0.1, 0.2, 0.1, 0.3, 0.1, 0.2, 0.2])
    >>> part.measured, part.p_for
    ('+0.17 [0.10, 0.24]', 0.0078125)
    """
    known = _known(differences)
    if not len(known):
        return _absent(what)
    found = paired_difference(known)
    half = found.p / 2.0
    for_it, against = (half, 1.0 - half) if found.mean > 0.0 else (1.0 - half, half)
    text = f"{found.mean:+.{decimals}f}{_unit(unit)}"
    if math.isfinite(found.low):
        text += f" [{found.low:.{decimals}f}, {found.high:.{decimals}f}]"
    seen = _least_seen(found.sd, found.count)
    power = f"{seen:.{decimals}f}{_unit(unit)}: shown with {_POWER:.0%}"
    if not math.isfinite(seen):
        power = "too few to see anything"
    return Part(what, text, found.count, for_it, against, power)


def range_part(
    what: str, values: ArrayLike, low: float, high: float, unit: str = ""
) -> Part:
    """Test that a mean is within a range, by two one-sided t tests.

    Parameters
    ----------
    what : str
    values : (n,) float
        One for each scenario instance; NaN is ignored.
    low, high : float
        The range.
    unit : str

    References
    ----------
    Schuirmann (1987), "A comparison of the two one-sided tests procedure and the power
    approach", J. Pharmacokinet. Biopharm. 15(6).
    """
    known = _known(values)
    if not len(known):
        return _absent(what)
    found = spread(known)
    text = f"{found.mean:.2f}{_unit(unit)}"
    if math.isfinite(found.low):
        text += f" [{found.low:.2f}, {found.high:.2f}]"
    text += f", expected {low:.2f} to {high:.2f}"
    above_low = _t_test(found.mean - low, found.sd, found.count)
    below_high = _t_test(high - found.mean, found.sd, found.count)
    against = min(1.0, 2.0 * min(1.0 - above_low, 1.0 - below_high))
    half = _half_width(found.sd, found.count)
    power = f"the interval reaches {half:.2f}{_unit(unit)} to each side"
    return Part(what, text, found.count, max(above_low, below_high), against, power)


def _t_test(margin: float, sd: float, count: int) -> float:
    """Return the p value of a mean above a bound, by its margin over it."""
    if count < 2:
        return 0.5
    if sd <= 1e-12:
        return 0.0 if margin > 0.0 else 1.0
    return 1.0 - float(stdtr(count - 1, margin / sd * math.sqrt(count)))


def _half_width(sd: float, count: int) -> float:
    if count < 2:
        return math.inf
    return float(stdtrit(count - 1, 1.0 - LEVEL)) * sd / math.sqrt(count)


def _least_seen(sd: float, count: int) -> float:
    """Return about the mean difference that is found with a probability of `_POWER`."""
    if count < 6:  # no sign-flip test of fewer is below 2.5 % on one side
        return math.inf
    ends = stdtrit(count - 1, 1.0 - LEVEL) + stdtrit(count - 1, _POWER)
    return float(ends) * sd / math.sqrt(count)


def _share_power(count: int) -> float:
    """Return how often a true share of `_SUPPOSED_SHARE` is shown to be above half."""
    for hits in range(count + 1):
        if float(bdtrc(hits - 1, count, 0.5) if hits else 1.0) <= LEVEL:
            return float(bdtrc(hits - 1, count, _SUPPOSED_SHARE))
    return 0.0


def _absent(what: str) -> Part:
    return Part(what, "not measured", 0, 1.0, 1.0, "")


def _known(values: ArrayLike) -> Floats:
    found = np.asarray(values, dtype=np.float64)
    return found[np.isfinite(found)]


def _unit(unit: str) -> str:
    return f" {unit}" if unit else ""
