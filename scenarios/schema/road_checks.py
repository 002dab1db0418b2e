"""Checks that a scenario's parts are possible on its road, floor or SUMO network."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from simbench.scenarios.schema.ball import Ball
from simbench.scenarios.schema.mistakes import Mistake, Mistakes
from simbench.scenarios.schema.road import Floor, FloorPlan, Road, SumoRoad
from simbench.scenarios.schema.traffic import ScriptedVehicle, Target, scripted_lanes
from simbench.scenarios.time_step import STEP_S

if TYPE_CHECKING:
    from simbench.scenarios.schema.scenario import Scenario

__all__ = ["MOST_POSITIONS", "require_parts_fit"]

MOST_POSITIONS: Final = 100_000_000
"""Most vehicles times steps of a simulated dual carriageway: 1.6 GB."""
_END_MARGIN_M = 20.0
_LONGEST_S = 14_400.0
_NEEDS_FLOOR = "balls need a floor: expected road: {floor: ...}"


def require_parts_fit(scenario: Scenario) -> None:
    """Refuse a scenario with a part that its kind of road cannot have.

    Raises
    ------
    Mistakes
        Naming the keys: on a floor there are balls only, on a SUMO network the
        network's own vehicles; tunnels and gantries need a dual carriageway; balls
        start on the floor, vehicles start and stay on the lanes of the road; every
        manoeuvre and kick is before the last frame; the traffic can be simulated.
    """
    mistakes = [*_too_long(scenario), *_mistakes(scenario)]
    if mistakes:
        raise Mistakes(mistakes)


def _mistakes(scenario: Scenario) -> Iterator[Mistake]:
    if isinstance(scenario.road, Road):
        yield from _in_carriageway(scenario, scenario.road)
        return
    yield from _spanning(scenario)
    if isinstance(scenario.road, Floor):
        yield from _in_floor(scenario, scenario.road.floor)
    if isinstance(scenario.road, SumoRoad):
        yield from _in_network(scenario)


def _too_long(scenario: Scenario) -> Iterator[Mistake]:
    lasts_s = scenario.duration_s / (1.0 - scenario.imaging.drop_share)
    if lasts_s > _LONGEST_S:
        yield _mistake(
            "frames",
            f"expected at most {_LONGEST_S:g} s, got {lasts_s:.0f} s: "
            f"{scenario.frames} frames of {scenario.imaging.interval_s:g} s and lost "
            "ones (imaging)",
        )


def _mistake(key: str, text: str) -> Mistake:
    return Mistake(tuple(key.split(".")), text)


def _spanning(scenario: Scenario) -> Iterator[Mistake]:
    spanning = [
        f"occluders.{n}.kind"
        for n, occluder in enumerate(scenario.occluders)
        if occluder.kind == "gantry"
    ]
    for key in ("gantry_spacing_m", "tunnel"):
        if getattr(scenario.surroundings, key) is not None:
            spanning.append(f"surroundings.{key}")
    for key in spanning:
        what = "a gantry" if key.endswith("kind") else "it"
        yield _mistake(key, f"{what} needs a dual carriageway to span")


def _in_floor(scenario: Scenario, floor: FloorPlan) -> Iterator[Mistake]:
    if scenario.target.ball is None:
        yield _mistake("target.ball", "is required on a floor but missing")
    if scenario.strangers:
        yield _mistake("strangers", "cannot drive on a floor: use traffic.balls")
    balls = {f"traffic.balls.{n}": b for n, b in enumerate(scenario.traffic.balls)}
    if scenario.target.ball is not None:
        balls = {"target.ball": scenario.target.ball} | balls
    for where, ball in balls.items():
        yield from _off_floor(where, ball, floor)
        times = [kick.at_s for kick in ball.kicks]
        yield from _too_late(f"{where}.kicks", times, scenario)


def _off_floor(where: str, ball: Ball, floor: FloorPlan) -> Iterator[Mistake]:
    radius, half = ball.diameter_m / 2.0, floor.width_m / 2.0
    largest = min(floor.length_m, floor.width_m) / 2.0
    if ball.diameter_m > largest:
        yield _mistake(
            f"{where}.diameter_m",
            f"must be at most half the floor's shorter side, {largest:g}, got "
            f"{ball.diameter_m:g}",
        )
        return
    for key, value, low, high in (
        ("along_m", ball.along_m, radius, floor.length_m - radius),
        ("lateral_m", ball.lateral_m, radius - half, half - radius),
    ):
        if not low <= value <= high:
            text = f"must be on the floor, within {low:g} to {high:g}, got {value:g}"
            yield _mistake(f"{where}.{key}", text)


def _too_late(where: str, times: list[float], scenario: Scenario) -> Iterator[Mistake]:
    for index, at_s in enumerate(times):
        if at_s > scenario.last_s:
            yield _mistake(
                f"{where}.{index}.at_s",
                f"must be at most {scenario.last_s:.2f}, the last frame, got {at_s:g}",
            )


def _in_network(scenario: Scenario) -> Iterator[Mistake]:
    if scenario.target.rule is None:
        text = "target.id or target.choose is required on a SUMO network"
        yield _mistake("target", text)
    if scenario.strangers:
        text = "cannot be put on a SUMO network: use its routes"
        yield _mistake("strangers", text)
    if scenario.traffic.balls:
        yield _mistake("traffic.balls", _NEEDS_FLOOR)


def _in_carriageway(scenario: Scenario, road: Road) -> Iterator[Mistake]:
    target = scenario.target
    if target.rule is not None:
        yield _mistake("target", "target.id and target.choose need road: {sumo: ...}")
        return
    for key, balls in (
        ("target.ball", target.ball),
        ("traffic.balls", scenario.traffic.balls),
    ):
        if balls:
            yield _mistake(key, _NEEDS_FLOOR)
    if target.ball is not None:
        return
    vehicles: dict[str, Target | ScriptedVehicle] = {"target": target} | {
        f"strangers.{n}": vehicle for n, vehicle in enumerate(scenario.strangers)
    }
    for where, vehicle in vehicles.items():
        if vehicle.lane >= road.lanes:
            text = f"must be below road.lanes = {road.lanes}, got {vehicle.lane}"
            yield _mistake(f"{where}.lane", text)
            continue
        times = [manoeuvre.at_s for manoeuvre in vehicle.manoeuvres]
        yield from _too_late(f"{where}.manoeuvres", times, scenario)
        yield from _off_lanes(f"{where}.manoeuvres", vehicle, scenario, road)
    first = _END_MARGIN_M - road.before_m
    last = road.length_m - road.before_m - _END_MARGIN_M
    if not first <= target.along_m <= last:
        yield _mistake(
            "target.along_m",
            f"must be on the road, within {first:g} to {last:g}, got "
            f"{target.along_m:g}",
        )
    yield from _too_much_traffic(scenario, road)


def _off_lanes(
    where: str, vehicle: Target | ScriptedVehicle, scenario: Scenario, road: Road
) -> Iterator[Mistake]:
    """Yield lane changes off the road or before the previous one has ended."""
    duration_s, previous_s = scenario.traffic.lane_change_s, -math.inf
    if vehicle.lane_changes is not None and scripted_lanes(vehicle):
        yield _mistake(where, "lane_changes excludes change_lane, got both")
        return
    for at_s, lane in scripted_lanes(vehicle):
        if not 0 <= lane < road.lanes:
            yield _mistake(
                where,
                f"must stay on lanes 0 to {road.lanes - 1}, got lane {lane} at "
                f"{at_s:g} s",
            )
            return
        if at_s < previous_s + duration_s:
            yield _mistake(
                where,
                f"lane changes take {duration_s:g} s (traffic.lane_change_s), got "
                f"{previous_s:g} s and {at_s:g} s",
            )
            return
        previous_s = at_s


def _too_much_traffic(scenario: Scenario, road: Road) -> Iterator[Mistake]:
    """Yield a mistake if the recording of the traffic would not fit into memory."""
    lanes = road.lanes * (2 if road.opposite else 1)
    simulated_s = scenario.duration_s / (1.0 - scenario.imaging.drop_share)
    entering_m = road.speed_limit_mps * (simulated_s + scenario.traffic.warm_up_s)
    per_m = scenario.traffic.density_per_km_lane / 1000.0
    vehicles = 1 + per_m * lanes * (road.length_m + entering_m)
    steps = simulated_s / STEP_S
    if vehicles * steps > MOST_POSITIONS:
        yield _mistake(
            "frames",
            f"expected traffic of at most {MOST_POSITIONS:g} positions, vehicles times "
            f"steps of {STEP_S:g} s, got about {vehicles * steps:.2g}: {vehicles:.0f} "
            f"vehicles (traffic.density_per_km_lane, road.sections) for "
            f"{simulated_s:.0f} s (frames, imaging)",
        )
