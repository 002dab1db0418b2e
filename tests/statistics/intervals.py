"""Coverage and width of intervals of a mean, by simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

from simbench.evaluation.statistics.intervals import share_interval, student_interval

__all__ = [
    "CASES",
    "COUNTS",
    "METHODS",
    "SHOWN",
    "Case",
    "Coverage",
    "Interval",
    "coverage",
]

Floats = NDArray[np.float64]
Interval = Callable[[Floats], tuple[Floats, Floats]]


@dataclass(frozen=True, slots=True)
class Case:
    """A distribution of scores.

    Attributes
    ----------
    name : str
    mean : float
    required : float
        Least coverage; 0 for a case that is only shown.
    draw : callable of (rng, shape)
    """

    name: str
    mean: float
    required: float
    draw: Callable[[np.random.Generator, tuple[int, int]], Floats]


@dataclass(frozen=True, slots=True)
class Coverage:
    """Share of intervals that hold the mean, and their mean width by Student's."""

    coverage: float
    width: float


def _beta(mean: float, sd: float) -> tuple[float, float]:
    """Return the parameters of a beta distribution."""
    both = mean * (1.0 - mean) / sd**2 - 1.0
    return mean * both, (1.0 - mean) * both


_BETA = _beta(0.95, 0.08)
CASES: Final = (
    Case("normal, mean .5, sd .1", 0.5, 0.93, lambda rng, n: rng.normal(0.5, 0.1, n)),
    Case("normal, mean .7, sd .1", 0.7, 0.93, lambda rng, n: rng.normal(0.7, 0.1, n)),
    Case("beta, mean .95, sd .08", 0.95, 0.88, lambda rng, n: rng.beta(*_BETA, n)),
)
SHOWN: Final = (
    Case("normal, mean .9, sd .02", 0.9, 0.0, lambda rng, n: rng.normal(0.9, 0.02, n)),
    Case("uniform", 0.5, 0.0, lambda rng, n: rng.random(n)),
    Case(
        "80 % ones, else 0",
        0.8,
        0.0,
        lambda rng, n: (rng.random(n) < 0.8).astype(np.float64),
    ),
)
COUNTS: Final = (3, 5, 10, 20)


def coverage(case: Case, count: int, repeats: int, interval: Interval) -> Coverage:
    """Simulate intervals of the mean of ``count`` values."""
    values = case.draw(np.random.default_rng([count, repeats]), (repeats, count))
    low, high = interval(values)
    student_low, student_high = student_interval(values)
    is_held = (low <= case.mean) & (case.mean <= high)
    width = (high - low).mean() / (student_high - student_low).mean()
    return Coverage(float(is_held.mean()), float(width))


def bootstrap(values: Floats, samples: int = 500) -> tuple[Floats, Floats]:
    """Return expanded percentile intervals (Hesterberg 2015)."""
    count = values.shape[1]
    rng = np.random.default_rng(0)
    counts = rng.multinomial(count, np.full(count, 1.0 / count), size=samples)
    tail = float(ndtr(stdtrit(count - 1, 0.025) * np.sqrt(count / (count - 1))))
    ends = np.quantile(values @ counts.T / count, [tail, 1.0 - tail], axis=1)
    return ends[0], ends[1]


def gaffke(values: Floats, samples: int = 500) -> tuple[Floats, Floats]:
    """Return intervals that always hold (Learned-Miller and Thomas 2020)."""
    weights = np.random.default_rng(0).dirichlet(np.ones(values.shape[1] + 1), samples)
    sorted_values = np.sort(values, axis=1)
    rows = len(values)
    low = np.hstack([np.zeros((rows, 1)), sorted_values]) @ weights.T
    high = np.hstack([sorted_values, np.ones((rows, 1))]) @ weights.T
    return np.quantile(low, 0.025, axis=1), np.quantile(high, 0.975, axis=1)


METHODS: Final[dict[str, tuple[Interval, int]]] = {
    "simbench": (share_interval, 20_000),
    "Student's t": (student_interval, 20_000),
    "bootstrap": (bootstrap, 2_000),
    "always holds": (gaffke, 2_000),
}
"""Methods, each with the repeats that it is given."""
