"""Checks that a scenario's parts are possible on its road, floor or SUMO network."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from simbench.scenarios.schema.ball import Ball
from simbench.scenarios.schema.road import Floor, FloorPlan, Road, SumoRoad
from simbench.scenarios.schema.traffic import ScriptedVehicle, Target, scripted_lanes

if TYPE_CHECKING:
    from simbench.scenarios.schema.scenario import Scenario

__all__ = ["require_parts_fit"]

_END_MARGIN_M = 20.0


def require_parts_fit(scenario: Scenario) -> None:
    """Refuse a scenario with a part that its kind of road cannot have.

    Raises
    ------
    ValueError
        Naming the key: on a floor there are balls only, on a SUMO network the network's
        own vehicles; tunnels and gantries need a dual carriageway; balls start on the
        floor, vehicles start and stay on the lanes of the road; every manoeuvre and
        kick is before the last frame.
    """
    if isinstance(scenario.road, Road):
        _require_carriageway_fits(scenario, scenario.road)
        return
    _require_nothing_spans(scenario)
    if isinstance(scenario.road, Floor):
        _require_balls_fit(scenario, scenario.road.floor)
    if isinstance(scenario.road, SumoRoad):
        _require_network_fits(scenario)


def _require_nothing_spans(scenario: Scenario) -> None:
    spanning = [
        f"occluders.{n}.kind: gantry"
        for n, occluder in enumerate(scenario.occluders)
        if occluder.kind == "gantry"
    ]
    for key in ("gantry_spacing_m", "tunnel"):
        if getattr(scenario.surroundings, key) is not None:
            spanning.append(f"surroundings.{key}")
    if spanning:
        raise ValueError(f"{spanning[0]} needs a dual carriageway to span")


def _require_balls_fit(scenario: Scenario, floor: FloorPlan) -> None:
    if scenario.target.ball is None:
        raise ValueError("target.ball is required on a floor but missing")
    if scenario.strangers:
        raise ValueError("strangers cannot drive on a floor: use traffic.balls")
    balls = {"target.ball": scenario.target.ball} | {
        f"traffic.balls.{n}": ball for n, ball in enumerate(scenario.traffic.balls)
    }
    for where, ball in balls.items():
        _require_on_floor(where, ball, floor)
        times = [kick.at_s for kick in ball.kicks]
        _require_in_time(f"{where}.kicks", times, scenario)


def _require_on_floor(where: str, ball: Ball, floor: FloorPlan) -> None:
    radius, half = ball.diameter_m / 2.0, floor.width_m / 2.0
    largest = min(floor.length_m, floor.width_m) / 2.0
    if ball.diameter_m > largest:
        raise ValueError(
            f"{where}.diameter_m must be at most half the floor's shorter side, "
            f"{largest:g}, got {ball.diameter_m:g}"
        )
    for key, value, low, high in (
        ("along_m", ball.along_m, radius, floor.length_m - radius),
        ("lateral_m", ball.lateral_m, radius - half, half - radius),
    ):
        if not low <= value <= high:
            raise ValueError(
                f"{where}.{key} must be on the floor, within {low:g} to {high:g}, got "
                f"{value:g}"
            )


def _require_in_time(where: str, times: list[float], scenario: Scenario) -> None:
    for index, at_s in enumerate(times):
        if at_s > scenario.last_s:
            raise ValueError(
                f"{where}.{index}.at_s must be at most {scenario.last_s:.2f}, the last "
                f"frame, got {at_s:g}"
            )


def _require_network_fits(scenario: Scenario) -> None:
    if scenario.target.rule is None:
        raise ValueError("target.id or target.choose is required on a SUMO network")
    if scenario.strangers:
        raise ValueError("strangers cannot be put on a SUMO network: use its routes")
    if scenario.traffic.balls:
        raise ValueError("balls need a floor: expected road: {floor: ...}")


def _require_carriageway_fits(scenario: Scenario, road: Road) -> None:
    target = scenario.target
    if target.rule is not None:
        raise ValueError("target.id and target.choose need road: {sumo: ...}")
    if target.ball is not None or scenario.traffic.balls:
        raise ValueError("balls need a floor: expected road: {floor: ...}")
    vehicles: dict[str, Target | ScriptedVehicle] = {"target": target} | {
        f"strangers.{n}": vehicle for n, vehicle in enumerate(scenario.strangers)
    }
    for where, vehicle in vehicles.items():
        if vehicle.lane >= road.lanes:
            raise ValueError(
                f"{where}.lane must be below road.lanes = {road.lanes}, got "
                f"{vehicle.lane}"
            )
    for where, vehicle in vehicles.items():
        times = [manoeuvre.at_s for manoeuvre in vehicle.manoeuvres]
        _require_in_time(f"{where}.manoeuvres", times, scenario)
        _require_lanes_exist(f"{where}.manoeuvres", vehicle, scenario, road)
    first = _END_MARGIN_M - road.before_m
    last = road.length_m - road.before_m - _END_MARGIN_M
    if not first <= target.along_m <= last:
        raise ValueError(
            f"target.along_m must be on the road, within {first:g} to {last:g}, got "
            f"{target.along_m:g}"
        )


def _require_lanes_exist(
    where: str, vehicle: Target | ScriptedVehicle, scenario: Scenario, road: Road
) -> None:
    """Refuse lane changes off the road or before the previous one has ended."""
    duration_s, previous_s = scenario.traffic.lane_change_s, -math.inf
    for at_s, lane in scripted_lanes(vehicle):
        if not 0 <= lane < road.lanes:
            raise ValueError(
                f"{where} must stay on lanes 0 to {road.lanes - 1}, got lane {lane} at "
                f"{at_s:g} s"
            )
        if at_s < previous_s + duration_s:
            raise ValueError(
                f"{where}: lane changes take {duration_s:g} s "
                f"(traffic.lane_change_s), got {previous_s:g} s and {at_s:g} s"
            )
        previous_s = at_s
