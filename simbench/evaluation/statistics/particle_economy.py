"""Particle economy: what precision and success cost in likelihood evaluations."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from simbench.evaluation.statistics.instance_statistics import seed_means, spread

__all__ = ["PRECISION", "Cost", "Economy", "particle_economy"]

PRECISION: Final = 0.9
"""Precision for which the particles needed are asked."""

_MEASURES: Final = ("particles_mean", "precision_20", "success_50")
_PARTICLES: Final = re.compile(r"@(particles|n)=\d+")


@dataclass(frozen=True, slots=True)
class Cost:
    """What one tracker uses and reaches, over all scenario instances of a run.

    Attributes
    ----------
    tracker : str
    family : str
        Its specification without a number of particles: trackers that differ in nothing
        else are of one family.
    particles : float
        Mean likelihood evaluations in a frame, above 0.
    precision, success : float, in [0, 1]
    low, high : float
        95 % interval of the precision; NaN for few instances.
    is_on_front : bool
        Whether no tracker with as few particles is as precise.
    """

    tracker: str
    family: str
    particles: float
    precision: float
    success: float
    low: float
    high: float
    is_on_front: bool


@dataclass(frozen=True, slots=True)
class Economy:
    """Particle economy of the trackers of a run.

    Attributes
    ----------
    costs : tuple of Cost
        Of the trackers that use particles, by particles.
    needed : mapping from family to float
        Particles needed for a precision of `PRECISION`, interpolated on the logarithm
        between trackers of the family; NaN where it is not reached. Where the one with
        the fewest particles is that precise, its particles.
    """

    costs: tuple[Cost, ...]
    needed: Mapping[str, float]


def particle_economy(runs: pd.DataFrame, specs: Mapping[str, str]) -> Economy:
    """Return the particle economy of a run.

    Parameters
    ----------
    runs : DataFrame
        `simbench.evaluation.scores.Scores.runs`.
    specs : mapping from label to str
        Specifications of the trackers, such as ``condensation@particles=50``; a
        tracker without one is a family of its own.
    """
    means = seed_means(runs, _MEASURES)
    rows = []
    for tracker, of in means.groupby("tracker", sort=False):
        used = float(of["particles_mean"].mean())
        if not used > 0.0:
            continue
        precision = spread(of["precision_20"], is_bounded=True)
        success = float(of["success_50"].mean())
        rows.append((used, str(tracker), precision, success))
    rows.sort(key=lambda row: row[:2])
    costs, best = [], -1.0
    for used, tracker, precision, success in rows:
        spec = specs.get(tracker, tracker).removeprefix(f"{tracker}=")
        cost = Cost(
            tracker,
            _PARTICLES.sub("", spec),
            used,
            precision.mean,
            success,
            precision.low,
            precision.high,
            precision.mean > best,
        )
        best = max(best, precision.mean)
        costs.append(cost)
    families = dict.fromkeys(cost.family for cost in costs)
    needed = {
        family: _needed([cost for cost in costs if cost.family == family])
        for family in families
    }
    return Economy(tuple(costs), needed)


def _needed(costs: list[Cost]) -> float:
    """Return the particles at which precision first reaches the one asked for."""
    last = None
    for cost in costs:
        if cost.precision >= PRECISION:
            if last is None or last.precision == cost.precision:
                return cost.particles
            share = (PRECISION - last.precision) / (cost.precision - last.precision)
            ends = np.log([last.particles, cost.particles])
            return float(np.exp(ends[0] + share * (ends[1] - ends[0])))
        last = cost
    return float("nan")
