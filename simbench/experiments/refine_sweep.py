"""Refine a sweep where success falls to one half: a few more films, a finer answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from simbench.evaluation.statistics.sweep_axes import Axis, Sweep
from simbench.evaluation.statistics.sweep_scores import SweepScores
from simbench.experiments.request import Request
from simbench.experiments.run import RunResult
from simbench.scenarios.schema import Scenario

__all__ = ["ROUNDS", "new_values", "refined_run"]

ROUNDS: Final = 2
"""Rounds by default: the step at a breaking point becomes a quarter."""
_MOST_VALUES: Final = 4  # new in one round, for all trackers together
_DIGITS: Final = 6
_ROUND_OFF: Final = 1e-6


def refined_run(
    base: Scenario,
    request: Request,
    run: Callable[[Request], RunResult],
    rounds: int = ROUNDS,
) -> RunResult:
    """Run a sweep, then values in the middle of the steps in which success falls.

    Parameters
    ----------
    base : Scenario
        Scenario whose dial is varied.
    request : Request
        Of a sweep. One of two dials is not refined.
    run : callable of Request
        Runs it into a folder that grows.
    rounds : int
        How often steps are halved.
    """
    result = run(request)
    sweep = request.sweep
    if sweep is None or len(sweep.axes) > 1:
        return result
    for _ in range(rounds):
        if result.swept is None:
            break
        values = new_values(result.swept, sweep.axes[0], rounds)
        if not values:
            break
        axis = Axis(sweep.axes[0].dial, values)
        finer = Sweep(sweep.scenario, sweep.variant, (axis,))
        variants = tuple(finer.variants(base))
        result = run(replace(request, scenarios=variants, sweep=finer))
    return result


def new_values(swept: SweepScores, coarse: Axis, rounds: int) -> tuple[float, ...]:
    """Return values of the dial in the middle of steps that are still to be halved.

    Parameters
    ----------
    swept : SweepScores
        So far, of one dial.
    coarse : Axis
        As requested first: the steps are halved ``rounds`` times, however often this
        is asked.
    rounds : int
    """
    dial = coarse.dial
    found = set()
    row: Any
    for row in swept.breaking[swept.breaking["state"] == "within"].itertuples():
        points = swept.points[swept.points["tracker"] == row.tracker]
        points = points[points[f"achieved.{dial}"].notna()]
        points = points.sort_values(f"requested.{dial}")
        requested = points[f"requested.{dial}"].to_numpy(np.float64)
        achieved = points[f"achieved.{dial}"].to_numpy(np.float64)
        sides = np.sign(achieved - float(row.value))
        crossed = np.flatnonzero(sides[:-1] * sides[1:] <= 0.0)
        if not len(crossed):
            continue
        low, high = requested[crossed[0]], requested[crossed[0] + 1]
        width = _width(coarse, float(low), float(high)) / 2**rounds
        if high - low > width * (1.0 + _ROUND_OFF):
            found.add(float(f"{0.5 * (low + high):.{_DIGITS}g}"))
    known = set(swept.sweep.axes[0].values)
    return tuple(sorted(found - known)[:_MOST_VALUES])


def _width(coarse: Axis, low: float, high: float) -> float:
    """Return the step of the dial, as requested first, that holds a part of it."""
    values = np.array(coarse.values)
    index = int(
        np.clip(np.searchsorted(values, 0.5 * (low + high)), 1, len(values) - 1)
    )
    return float(values[index] - values[index - 1])
