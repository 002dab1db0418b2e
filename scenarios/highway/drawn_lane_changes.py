"""Lane changes of scripted vehicles at random times."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from simbench.scenarios.schema import (
    LaneChanges,
    Manoeuvre,
    Scenario,
    ScriptedVehicle,
    Target,
)
from simbench.scenarios.schema.seeds import generator

__all__ = ["with_lane_changes"]

_HORIZON_S = 600.0
"""Changes are drawn for so long: a shorter sequence has the first ones of a longer."""
_REST_S = 1.5  # in the lane, before the next change

VehicleT = TypeVar("VehicleT", Target, ScriptedVehicle)


def with_lane_changes(scenario: Scenario, seed: int, attempt: int) -> Scenario:
    """Return a scenario whose random lane changes are manoeuvres at fixed times.

    Parameters
    ----------
    scenario : Scenario
        On a carriageway.
    seed : int
        Seed of the run; the traffic's stream draws the times and directions.
    attempt : int
        Other times in every attempt: traffic may leave no room at some.
    """

    def drawn(vehicle: VehicleT, number: int) -> VehicleT:
        changes = vehicle.lane_changes
        if changes is None or scenario.carriageway.lanes < 2:
            return vehicle
        rng = generator(scenario, seed, "lane_changes", attempt, number)
        moves: list[Manoeuvre] = _moves(scenario, changes, vehicle.lane, rng)
        return vehicle.model_copy(update={"manoeuvres": (*vehicle.manoeuvres, *moves)})

    strangers = tuple(drawn(v, n) for n, v in enumerate(scenario.strangers, start=1))
    target = drawn(scenario.target, 0)
    return scenario.model_copy(update={"target": target, "strangers": strangers})


def _moves(
    scenario: Scenario, changes: LaneChanges, lane: int, rng: np.random.Generator
) -> list[Manoeuvre]:
    """Draw lane changes in order of time, within the lanes of the road."""
    busy_s = scenario.traffic.lane_change_s + _REST_S
    mean_s = 60.0 / changes.per_min
    moves: list[Manoeuvre] = []
    at_s = changes.from_s + float(rng.uniform(0.2, mean_s))
    while at_s < _HORIZON_S:
        is_left = bool(rng.random() < 0.5)
        if not 0 <= lane + (1 if is_left else -1) < scenario.carriageway.lanes:
            is_left = not is_left
        lane += 1 if is_left else -1
        moves.append(Manoeuvre(at_s=at_s, change_lane="left" if is_left else "right"))
        at_s += busy_s + float(rng.exponential(max(mean_s - busy_s, 0.5)))
    return moves
