"""Breaking points: values of a dial at which success falls to one half.

Success at 0.5 is a share of frames, so its mean as a function of the dial is modelled
as a logistic curve and fitted by maximum quasi-likelihood (the fractional logit of
Papke and Wooldridge): consistent if the mean is modelled correctly, whatever the
distribution of the shares, and valid for shares of exactly 0 and 1. The curve may rise
or fall: more occlusion is harder, but more contrast is easier.

References
----------
Papke and Wooldridge (1996), "Econometric methods for fractional response variables
with an application to 401(k) plan participation rates", J. Appl. Econometrics 11(6),
eq. (5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from simbench.evaluation.statistics.instance_statistics import (
    bootstrap_counts,
    expanded_levels,
)
from simbench.evaluation.statistics.intervals import LEAST_COUNT

__all__ = [
    "LEAST_SEEDS",
    "BreakingPoint",
    "breaking_point",
    "fit_logistic",
    "step_at",
]

LEAST_SEEDS: Final = 3
"""Fewest seeds of which an interval is stated."""

State = Literal["within", "beyond", "below"]
Floats = NDArray[np.float64]

# For data that a step separates, whose likelihood has no maximum, it limits the slope
# to the order of 100 over the range of the dial: a fall from 0.9 to 0.1 over some 4 %
# of it. On other data its effect is in the fourth digit.
_PENALTY: Final = 1e-5
_STEPS: Final = 60
_HALVINGS: Final = 20
_CLOSE: Final = 1e-9
_TINY: Final = 1e-12


@dataclass(frozen=True, slots=True)
class BreakingPoint:
    """Value of a dial at which success falls to one half, with its interval.

    Attributes
    ----------
    state : {"within", "beyond", "below"}
        Whether it is within the range of the dial; ``beyond`` if success is above one
        half over the whole range, ``below`` if it is below.
    value : float
        Value of the dial; NaN unless ``within``.
    low, high : float
        Bootstrap interval over seeds, wider at each end by half the step of the dial
        there, up to the range: where all seeds fall between the same two values, the
        fall may be anywhere between them. With 3 or 4 seeds, whose bootstrap is too
        narrow, it is wider by the whole step. Infinite where it leaves the range, since
        the curve is not extrapolated. NaN for fewer than 3 seeds: n too small.
    range_low, range_high : float
        Minimum and maximum value of the dial.
    intercept, slope : float
        The curve: ``1 / (1 + exp(-(intercept + slope * dial)))``. NaN if all shares
        are 0, or all 1.
    seeds : int
    """

    state: State
    value: float
    low: float
    high: float
    range_low: float
    range_high: float
    intercept: float
    slope: float
    seeds: int


def breaking_point(
    dial: Floats,
    success: Floats,
    seeds: NDArray[Any],
    rng: np.random.Generator,
    *,
    is_harder_upwards: bool = True,
    level: float = 0.95,
    samples: int = 1000,
    steps: Floats | None = None,
) -> BreakingPoint:
    """Fit a logistic curve and return where it crosses one half.

    Parameters
    ----------
    dial : (n,) float
        Value of the dial that a sequence achieved; n is at least 1.
    success : (n,) float, in [0, 1]
        Share of its frames with success.
    seeds : (n,) int
        Seed of the sequence. The bootstrap resamples whole seeds: traffic and
        appearance are the same at every value of the dial.
    rng : numpy.random.Generator
    is_harder_upwards : bool
        End of the range to which a bootstrap sample counts whose curve does not cross
        one half within it. The curve itself may rise or fall.
    level : float, in (0, 1)
        Coverage of the interval, at the quantiles of
        `simbench.evaluation.statistics.instance_statistics.expanded_levels`.
    samples : int
        Bootstrap samples.
    steps : (k,) float, optional
        Values between which the dial was varied; by default all that were achieved.

    Examples
    --------
    >>> dial = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    >>> shares = np.array([1.0, 1.0, 1.0, 0.0, 0.0])
    >>> seed = np.zeros(5, dtype=int)
    >>> found = breaking_point(dial, shares, seed, np.random.default_rng(0))
    >>> found.state, round(found.value, 3)
    ('within', 0.625)
    """
    ends = float(dial.min()), float(dial.max())
    steps = np.unique(dial if steps is None else steps)
    names, place = np.unique(seeds, return_inverse=True)
    line = fit_logistic(dial, success, np.ones((1, len(dial))))
    at = float(_crossings(line, ends)[0])
    intercept, slope = line[0] if np.isfinite(line).all() else (np.nan, np.nan)
    low = high = float("nan")
    if len(names) >= LEAST_SEEDS:
        # few seeds give few distinct samples: each is fitted once
        counts, turns = np.unique(
            bootstrap_counts(len(names), samples, rng), axis=0, return_counts=True
        )
        lines = fit_logistic(dial, success, counts[:, place].astype(np.float64))
        found = _crossings(lines, ends)
        if not is_harder_upwards:
            found[np.isinf(found)] *= -1.0
        low, high = np.quantile(
            np.repeat(found, turns),
            expanded_levels(len(names), level),
            method="inverted_cdf",  # no interpolation with infinite values
        ).tolist()
        share = 1.0 if len(names) < LEAST_COUNT else 0.5
        if np.isfinite(low):
            low = max(low - share * step_at(steps, low), ends[0])
        if np.isfinite(high):
            high = min(high + share * step_at(steps, high), ends[1])
    return BreakingPoint(
        state="within" if np.isfinite(at) else "beyond" if at > 0 else "below",
        value=at if np.isfinite(at) else float("nan"),
        low=low,
        high=high,
        range_low=ends[0],
        range_high=ends[1],
        intercept=float(intercept),
        slope=float(slope),
        seeds=len(names),
    )


def step_at(values: Floats, place: float) -> float:
    """Return the distance between the neighbours of a place; 0 beyond all values.

    Examples
    --------
    >>> step_at(np.array([0.0, 0.5, 0.75, 1.0]), 0.6)
    0.25
    """
    if len(values) < 2 or not values[0] <= place <= values[-1]:
        return 0.0
    index = int(np.clip(np.searchsorted(values, place), 1, len(values) - 1))
    return float(values[index] - values[index - 1])


def fit_logistic(dial: Floats, success: Floats, weights: Floats) -> Floats:
    """Fit logistic curves to the same shares with several sets of weights.

    Parameters
    ----------
    dial, success : (n,) float
        As for `breaking_point`.
    weights : (r, n) float
        Weight of each share; not all 0.

    Returns
    -------
    (r, 2) float
        Intercept and slope. If all shares are 1 or all 0 the likelihood has no
        maximum: the intercept is infinite and the slope 0.
    """
    middle = 0.5 * float(dial.min() + dial.max())
    extent = float(np.ptp(dial)) or 1.0
    means = weights @ success / weights.sum(axis=1)
    lines = np.stack([logit(means), np.zeros(len(weights))], axis=1)
    mixed = np.isfinite(lines[:, 0])
    lines[mixed] = _maximise(
        (dial - middle) / extent, success, weights[mixed], lines[mixed]
    )
    slopes = lines[:, 1] / extent
    return np.stack([lines[:, 0] - slopes * middle, slopes], axis=1)


def _maximise(dial: Floats, success: Floats, weights: Floats, lines: Floats) -> Floats:
    """Return the maxima of the penalised quasi-likelihoods, by Newton's method."""
    heights = _likelihood(lines, dial, success, weights)
    for _ in range(_STEPS):
        shares = expit(lines[:, :1] + lines[:, 1:] * dial)
        missing = weights * (success - shares)
        slopes = np.stack(
            [missing.sum(axis=1), missing @ dial - _PENALTY * lines[:, 1]], axis=1
        )
        spread = weights * shares * (1.0 - shares)
        curvatures = np.empty((len(lines), 2, 2))
        curvatures[:, 0, 0] = spread.sum(axis=1) + _TINY
        curvatures[:, 0, 1] = curvatures[:, 1, 0] = spread @ dial
        curvatures[:, 1, 1] = spread @ dial**2 + _PENALTY
        steps = np.linalg.solve(curvatures, slopes[:, :, None])[:, :, 0]
        for _ in range(_HALVINGS):  # halve a step that overshoots
            tried = _likelihood(lines + steps, dial, success, weights)
            worse = tried < heights - _CLOSE
            if not worse.any():
                break
            steps[worse] *= 0.5
        lines = lines + steps
        heights = tried
        if np.abs(steps).max(initial=0.0) < _CLOSE:
            break
    return lines


def _likelihood(
    lines: Floats, dial: Floats, success: Floats, weights: Floats
) -> Floats:
    """Return the quasi-log-likelihoods minus the penalty on the slope."""
    odds = lines[:, :1] + lines[:, 1:] * dial
    likelihoods: Floats = (weights * (success * odds - np.logaddexp(0.0, odds))).sum(
        axis=1
    )
    return likelihoods - 0.5 * _PENALTY * lines[:, 1] ** 2


def _crossings(lines: Floats, ends: tuple[float, float]) -> Floats:
    """Return the values at which curves cross one half within the ends.

    Infinite for curves that do not: positive if above one half, else negative.
    """
    odds = lines[:, :1] + lines[:, 1:] * np.array(ends)
    is_above = odds >= -_CLOSE  # exactly one half is not below it
    crosses = is_above[:, 0] != is_above[:, 1]
    found = np.where(is_above.all(axis=1), np.inf, -np.inf)
    found[crosses] = np.clip(-lines[crosses, 0] / lines[crosses, 1], *ends)
    return found
