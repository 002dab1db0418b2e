"""Highway trajectories of a scenario: SUMO in a child process, and plausibility."""

from __future__ import annotations

import json
import logging
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.core.trajectories import Trajectories
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.highway.drawn_lane_changes import with_lane_changes
from simbench.scenarios.highway.fleet import FLEET
from simbench.scenarios.highway.kinematics import road_trajectories
from simbench.scenarios.run_sumo import run_sumo
from simbench.scenarios.schema import Scenario, ScriptedVehicle, Target, scripted_lanes
from simbench.scenarios.schema.frame_times import frame_times
from simbench.scenarios.schema.seeds import stream_seed
from simbench.scenarios.time_step import STEP_S

__all__ = ["simulate"]

logger = logging.getLogger(__name__)

_ATTEMPTS = 20
_PLAUSIBLE_BRAKING = 6.0  # m/s^2; harder is an emergency stop, not driving
_CACHED_RECORDINGS = 3


def simulate(
    scenario: Scenario, line: RoadLine, seed: int, *, skip: int = 0
) -> Trajectories:
    """Simulate the traffic of a scenario.

    Parameters
    ----------
    scenario : Scenario
    line : RoadLine
        The scenario's road.
    seed : int
        Seed of the run; ``scenario.seeds`` may hold parts of it fixed. The same
        scenario and seed give bit-identical trajectories, in any process.
    skip : int
        Traffic attempts to skip because they were rejected later.

    Returns
    -------
    Trajectories
        At the times of the kept frames. The target is called ``target``.

    Raises
    ------
    TrafficError
        If SUMO refuses or crashes, or no plausible traffic was found.
    """
    reason = ""
    times = frame_times(scenario, seed)
    for attempt in range(skip, skip + _ATTEMPTS):
        sumo_seed = stream_seed(scenario, seed, "traffic", attempt)
        acted = with_lane_changes(scenario, seed, attempt)
        request = _request(acted, line, sumo_seed, float(times[-1]))
        recording = _recorded(request)
        reason = _implausible(recording, request, scenario)
        if not reason:
            return road_trajectories(
                recording, scenario, line, seed, times, traffic_redraws=attempt
            )
        logger.info("%s seed %d: traffic rejected: %s", scenario.name, seed, reason)
    raise TrafficError(
        f"{scenario.name}: no plausible traffic in {_ATTEMPTS} attempts: expected no "
        f"collision and the scripted motion of the target, got in the last: {reason}"
    )


def _request(
    scenario: Scenario, line: RoadLine, seed: int, duration_s: float
) -> dict[str, Any]:
    road, target = scenario.carriageway, scenario.target
    front = target.along_m + road.before_m + FLEET[target.vehicle_class].length / 2
    actors = [_actor("target", target, front, target.clear_m)]
    for number, scripted in enumerate(scenario.strangers):
        place = front + scripted.ahead_m
        actors.append(_actor(f"stranger.{number}", scripted, place, 15.0))
    for actor in actors:
        if not 20.0 <= actor["front_m"] <= road.length_m - 20.0:
            raise TrafficError(
                f"{scenario.name}: {actor['name']} must start on the road"
            )
    return {
        "seed": seed,
        "length_m": road.length_m,
        **road.model_dump(
            include={"lanes", "lane_width_m", "speed_limit_mps", "opposite"}
        ),
        **scenario.traffic.model_dump(exclude={"balls"}),
        "duration_s": duration_s,
        "actors": actors,
    }


def _actor(
    name: str, role: Target | ScriptedVehicle, front_m: float, clear_m: float
) -> dict[str, Any]:
    """Return a scripted vehicle as a request describes it."""
    lane_moves = scripted_lanes(role)
    moves: list[dict[str, Any]] = [
        {"at_s": at_s, "speed_mps": None, "lane": lane} for at_s, lane in lane_moves
    ]
    moves += [
        {"at_s": move.at_s, "speed_mps": move.speed_mps, "lane": None}
        for move in role.manoeuvres
        if move.speed_mps is not None
    ]
    return {
        "name": name,
        "kind": role.vehicle_class,
        "length_m": FLEET[role.vehicle_class].length,
        "lane": role.lane,
        "lanes": sorted({role.lane, *(lane for _, lane in lane_moves)}),
        "clears_all_lanes": name == "target",
        "front_m": front_m,
        "clear_m": clear_m,
        "speed_mps": role.speed_mps,
        "manoeuvres": moves,
    }


_cache: dict[str, dict[str, NDArray[Any]]] = {}
"""The last recordings by request without duration; dial solvers repeat requests."""


def _recorded(request: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the recording of a request, cut from a longer one where there is one.

    SUMO steps forward only, so the first steps of a longer run are those of a shorter
    one: cut or run anew, the recording is the same to the bit.
    """
    key = json.dumps(request | {"duration_s": None}, sort_keys=True)
    steps = round(request["duration_s"] / STEP_S) + 2
    found = _cache.get(key)
    if found is None or len(found["front"]) < steps:
        found = run_sumo("simbench.scenarios.highway.sumo_process", request)
        while len(_cache) >= _CACHED_RECORDINGS:
            del _cache[next(iter(_cache))]
        _cache[key] = found
    front, lane = found["front"][:steps], found["lane"][:steps]
    present = ~np.all(np.isnan(front), axis=0)
    return {
        "names": found["names"][present],
        "front": front[:, present],
        "lane": lane[:, present],
        "collisions": found["collisions"][: steps - 1],
    }


def _implausible(
    recording: dict[str, NDArray[Any]], request: dict[str, Any], scenario: Scenario
) -> str:
    """Return why to reject a recording, or an empty string."""
    if recording["collisions"].any():
        return "vehicles collided"
    names = recording["names"].tolist()
    front = recording["front"][:, names.index("target")]
    if np.isnan(front).any():
        left_s = int(np.isnan(front).argmax()) * STEP_S
        raise TrafficError(
            f"{scenario.name}: the target reaches the end of the road after "
            f"{left_s:.1f} s of {request['duration_s']:.1f}: lengthen road.sections or "
            "start earlier"
        )
    speed = np.diff(front) / STEP_S
    window = round(0.2 / STEP_S)  # drivers act five times a second
    braking = -(speed[window:] - speed[:-window]) / (window * STEP_S)
    if len(braking) and braking.max() > _PLAUSIBLE_BRAKING:
        return f"the target braked with {braking.max():.1f} m/s^2"
    for actor in request["actors"]:
        lane = recording["lane"][:, names.index(actor["name"])]
        if not _changes_as_scripted(lane, actor, request["lane_change_s"]):
            return f"{actor['name']} could not change lane as scripted"
    return ""


def _changes_as_scripted(
    lane: NDArray[np.float64], actor: dict[str, Any], lasts_s: float
) -> bool:
    """Tell whether every lane change began within a second and ended in time."""

    def at(time_s: float) -> float:
        """Return the lane at a time, or NaN past the end or off the road."""
        step = round(time_s / STEP_S)
        return float(lane[step]) if step < len(lane) else float("nan")

    before = actor["lane"]
    moves = [move for move in actor["manoeuvres"] if move["lane"] is not None]
    for move, next_move in zip(moves, [*moves[1:], {"at_s": np.inf}], strict=False):
        end_s = min(move["at_s"] + 1.2 + lasts_s, next_move["at_s"])
        # NaN compares false: what the recording does not show is not counted against it
        begun = not abs(at(move["at_s"] + 1.0) - before) < 1e-6
        if not begun or abs(at(end_s) - move["lane"]) > 0.02:
            return False
        before = move["lane"]
    return True
