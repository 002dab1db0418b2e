"""Doubles to order: vehicles of the target's class and colour that pass it."""

from __future__ import annotations

import numpy as np

from simbench.core.errors import ScenarioError
from simbench.scenarios.camera_path import place_points
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Road, Scenario, Stranger, scripted_lanes

__all__ = ["add_distractors", "beside", "gains_on"]

_CLOSING_MPS = 4.0
"""How much faster a double is than the target: it passes in about two seconds."""


def add_distractors(scenario: Scenario) -> Scenario:
    """Return the story with as many doubles as its dials ask for.

    They come up one after the other in the lanes beside the target, evenly over the
    story, and pass it, the first on the side away from the camera, where it does not
    hide the target. Strangers of the story that look like the target make way for
    them; others stay.

    Raises
    ------
    ScenarioError
        If there is no lane beside the target.
    """
    asked = scenario.dials.distractors
    if asked is None:
        return scenario
    target = scenario.target
    looks = target.vehicle_class, target.colour
    kept = [s for s in scenario.strangers if (s.vehicle_class, s.colour) != looks]
    doubles = []
    for number in range(asked.count):
        at_s = scenario.duration_s * (number + 1) / (asked.count + 1)
        right, left = beside(scenario, at_s, "distractors")
        lanes = (right, left) if _camera_is_left(scenario) else (left, right)
        doubles.append(
            Stranger(
                vehicle_class=target.vehicle_class,
                colour=target.colour,
                lane=lanes[number % 2],
                ahead_m=gains_on(scenario, at_s) - _CLOSING_MPS * at_s,
                speed_mps=target.speed_mps + _CLOSING_MPS,
            )
        )
    return scenario.model_copy(update={"strangers": (*kept, *doubles)})


def _camera_is_left(scenario: Scenario) -> bool:
    """Tell whether the camera stands to the left of the target's first lane."""
    line = RoadLine.from_road(scenario.carriageway)
    eye = place_points(line, scenario.camera.position, np.zeros(1))
    lateral = float(line.locate(eye)[0, 1])
    return lateral > float(line.lane_lateral(scenario.target.lane))


def beside(scenario: Scenario, at_s: float, dial: str) -> tuple[int, int]:
    """Return the lanes right and left of the target; twice the one where one is all.

    Raises
    ------
    ScenarioError
        If there is none; ``dial`` is the one that wanted it.
    """
    if not isinstance(scenario.road, Road):
        raise ScenarioError(
            f"{scenario.name}: dials.{dial}: wanted a carriageway (road.lanes), where "
            "vehicles can be told to drive beside the target"
        )
    lane = scenario.target.lane
    for told_s, told in scripted_lanes(scenario.target):
        lane = told if told_s <= at_s else lane
    lanes = [one for one in (lane - 1, lane + 1) if 0 <= one < scenario.road.lanes]
    if not lanes:
        raise ScenarioError(
            f"{scenario.name}: dials.{dial}: wanted a lane beside the target: make "
            "road.lanes at least 2"
        )
    return lanes[0], lanes[-1]


def gains_on(scenario: Scenario, at_s: float) -> float:
    """Return how much farther than at its first speed the target has got by then, m."""
    gained, speed, since = 0.0, scenario.target.speed_mps, 0.0
    moves = [m for m in scenario.target.manoeuvres if m.speed_mps is not None]
    for move in sorted(moves, key=lambda one: one.at_s):
        if move.at_s >= at_s:
            break
        gained += (speed - scenario.target.speed_mps) * (move.at_s - since)
        speed, since = float(move.speed_mps or 0.0), move.at_s
    return gained + (speed - scenario.target.speed_mps) * (at_s - since)
