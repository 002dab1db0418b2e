"""Distractors: vehicles of the target's class and colour that overtake it."""

from __future__ import annotations

import numpy as np

from simbench.core.errors import ScenarioError
from simbench.scenarios.camera_path import place_points
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Road, Scenario, ScriptedVehicle, scripted_lanes

__all__ = ["add_distractors", "adjacent_lanes", "distance_gained"]

_CLOSING_MPS = 4.0
"""Speed of a distractor relative to the target: it passes in about two seconds."""


def add_distractors(scenario: Scenario) -> Scenario:
    """Return the scenario with the number of distractors that its dials request.

    They overtake the target one after the other in the adjacent lanes, evenly over the
    sequence; the first on the side away from the camera, where it does not hide the
    target. They replace the scenario's own scripted vehicles that look like the
    target; others stay.

    Raises
    ------
    ScenarioError
        If there is no lane beside the target.
    """
    requested = scenario.dials.distractors
    if requested is None:
        return scenario
    target = scenario.target
    looks = target.vehicle_class, target.colour
    kept = [v for v in scenario.strangers if (v.vehicle_class, v.colour) != looks]
    distractors = []
    for number in range(requested.count):
        at_s = scenario.duration_s * (number + 1) / (requested.count + 1)
        right, left = adjacent_lanes(scenario, at_s, "distractors")
        lanes = (right, left) if _camera_is_left(scenario) else (left, right)
        distractors.append(
            ScriptedVehicle(
                vehicle_class=target.vehicle_class,
                colour=target.colour,
                lane=lanes[number % 2],
                ahead_m=distance_gained(scenario, at_s) - _CLOSING_MPS * at_s,
                speed_mps=target.speed_mps + _CLOSING_MPS,
            )
        )
    return scenario.model_copy(update={"strangers": (*kept, *distractors)})


def _camera_is_left(scenario: Scenario) -> bool:
    """Tell whether the camera is to the left of the target's first lane."""
    line = RoadLine.from_road(scenario.carriageway)
    eye = place_points(line, scenario.camera.position, np.zeros(1))
    lateral = float(line.locate(eye)[0, 1])
    return lateral > float(line.lane_lateral(scenario.target.lane))


def adjacent_lanes(scenario: Scenario, at_s: float, dial: str) -> tuple[int, int]:
    """Return the lanes right and left of the target; the same lane twice at an edge.

    Raises
    ------
    ScenarioError
        If there is none; ``dial`` is the one that needs it.
    """
    if not isinstance(scenario.road, Road):
        raise ScenarioError(
            f"{scenario.name}: dials.{dial}: expected a carriageway (road.lanes), "
            "where scripted vehicles can drive beside the target"
        )
    lane = scenario.target.lane
    for change_s, changed in scripted_lanes(scenario.target):
        lane = changed if change_s <= at_s else lane
    lanes = [n for n in (lane - 1, lane + 1) if 0 <= n < scenario.road.lanes]
    if not lanes:
        raise ScenarioError(
            f"{scenario.name}: dials.{dial}: expected a lane beside the target: make "
            "road.lanes at least 2"
        )
    return lanes[0], lanes[-1]


def distance_gained(scenario: Scenario, at_s: float) -> float:
    """Return the distance [m] that speed changes gain the target by a time."""
    gained, speed, since = 0.0, scenario.target.speed_mps, 0.0
    moves = [m for m in scenario.target.manoeuvres if m.speed_mps is not None]
    for move in sorted(moves, key=lambda move: move.at_s):
        if move.at_s >= at_s:
            break
        gained += (speed - scenario.target.speed_mps) * (move.at_s - since)
        speed, since = float(move.speed_mps or 0.0), move.at_s
    return gained + (speed - scenario.target.speed_mps) * (at_s - since)
