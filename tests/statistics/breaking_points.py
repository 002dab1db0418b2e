"""Coverage of the intervals of breaking points, by simulated sweeps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from simbench.evaluation.statistics.breaking_point import BreakingPoint, breaking_point
from simbench.experiments.refine_sweep import ROUNDS

__all__ = ["CASES", "Case", "Found", "coverage"]

Floats = NDArray[np.float64]
Film = Callable[[float], Floats]

_FRAMES: Final = 40
_GRID: Final = np.linspace(0.0, 1.0, 11)
_SAMPLES: Final = 300


@dataclass(frozen=True, slots=True)
class Case:
    """A fall of success along a dial.

    Attributes
    ----------
    name : str
    slope : float
        Of the logistic curve of a seed, by the range of the dial.
    sd : float
        Standard deviation of the breaking points of the seeds.
    seeds : int
    """

    name: str
    slope: float
    sd: float
    seeds: int


CASES: Final = (
    Case("gentle, 3 seeds", -8.0, 0.08, 3),
    Case("gentle, 20 seeds", -8.0, 0.08, 20),
    Case("steep, seeds differ, 5 seeds", -80.0, 0.08, 5),
    Case("steep between two steps, 3 seeds", -200.0, 0.004, 3),
    Case("steep between two steps, 20 seeds", -200.0, 0.004, 20),
)


@dataclass(frozen=True, slots=True)
class Found:
    """Shares of intervals that hold the breaking point, and their mean widths.

    Attributes
    ----------
    raw : float
        Coverage of the bootstrap alone, on the grid of the sweep.
    widened, refined : float
        Coverage as stated, before and after the dial is refined.
    width, refined_width : float
    """

    raw: float
    widened: float
    refined: float
    width: float
    refined_width: float


def coverage(case: Case, repeats: int, first: int = 0) -> Found:
    """Simulate sweeps whose mean breaking point is anywhere between two steps."""
    held = np.zeros((repeats, 3))
    widths = np.zeros((repeats, 2))
    for index in range(repeats):
        rng = np.random.default_rng([first + index, case.seeds, int(-case.slope)])
        true = float(rng.uniform(0.4, 0.6))
        own = true + rng.normal(0.0, case.sd, case.seeds)

        def film(value: float, own: Floats = own) -> Floats:
            shares = expit(case.slope * (value - own))
            made: Floats = rng.binomial(_FRAMES, shares) / _FRAMES  # noqa: B023
            return made

        films = {float(value): film(float(value)) for value in _GRID}
        coarse = _fit(films, rng)
        fine = _refined(films, film, coarse, rng)
        bare = _fit(films, rng, steps=np.zeros(1), only=_GRID)
        for column, one in enumerate((bare, coarse, fine)):
            held[index, column] = one.low <= true <= one.high
        for column, one in enumerate((coarse, fine)):
            widths[index, column] = min(one.high, 1.0) - max(one.low, 0.0)
    raw, widened, refined = held.mean(axis=0)
    width, refined_width = widths.mean(axis=0)
    return Found(*map(float, (raw, widened, refined, width, refined_width)))


def _refined(
    films: dict[float, Floats],
    film: Film,
    found: BreakingPoint,
    rng: np.random.Generator,
) -> BreakingPoint:
    """Halve the step of the breaking point as `refined_run` does."""
    for _ in range(ROUNDS):
        if found.state != "within":
            break
        values = np.array(sorted(films))
        place = int(np.clip(np.searchsorted(values, found.value), 1, len(values) - 1))
        middle = float(values[place - 1 : place + 1].mean())
        films[middle] = film(middle)
        found = _fit(films, rng)
    return found


def _fit(
    films: dict[float, Floats],
    rng: np.random.Generator,
    steps: Floats | None = None,
    only: Floats | None = None,
) -> BreakingPoint:
    values = sorted(films) if only is None else [float(one) for one in only]
    shares = np.array([films[value] for value in values])
    seeds = shares.shape[1]
    return breaking_point(
        np.repeat(values, seeds),
        shares.ravel(),
        np.tile(np.arange(seeds), len(values)),
        rng,
        samples=_SAMPLES,
        steps=steps,
    )
