"""From a scenario to trajectories: ask SUMO in a child process, check the draw."""

from __future__ import annotations

import json
import logging
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.core.trajectories import Trajectories
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.highway.bending import STEP_S, bend
from simbench.scenarios.highway.fleet import FLEET
from simbench.scenarios.schema import Scenario, scripted_lanes
from simbench.scenarios.schema.frame_times import frame_times
from simbench.scenarios.schema.seeds import stream

__all__ = ["raise_if_failed", "run_sumo", "simulate"]

logger = logging.getLogger(__name__)

_DRAWS = 20
_PLAUSIBLE_BRAKING = 6.0  # m/s^2; harder is an emergency stop, not driving
_TIMEOUT_S = 600.0
_KEEP = 3


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
        Draws to pass over because they were found unfit later.

    Returns
    -------
    Trajectories
        At the times of the kept frames. The target is called ``target``.

    Raises
    ------
    TrafficError
        If SUMO refuses or crashes, or no plausible draw was found.
    """
    reason = ""
    times = frame_times(scenario, seed)
    for attempt in range(skip, skip + _DRAWS):
        draw = stream(scenario, seed, "traffic", attempt)
        request = _request(scenario, line, draw, times)
        recording = _recorded(request)
        reason = _implausible(recording, request, scenario)
        if not reason:
            return bend(recording, scenario, line, seed, times, traffic_redraws=attempt)
        logger.info("%s seed %d: drawn again: %s", scenario.name, seed, reason)
    raise TrafficError(
        f"{scenario.name}: no plausible traffic in {_DRAWS} draws, wanted one without "
        f"collisions and with the target as told; the last one: {reason}"
    )


def _request(
    scenario: Scenario, line: RoadLine, seed: int, times: NDArray[np.float64]
) -> dict[str, Any]:
    road, target = scenario.carriageway, scenario.target
    front = target.along_m + road.before_m + FLEET[target.vehicle_class].length / 2
    actors = [_actor("target", target, front, target.clear_m)]
    for number, stranger in enumerate(scenario.strangers):
        there = front + stranger.ahead_m
        actors.append(_actor(f"stranger.{number}", stranger, there, 15.0))
    inside = [20.0 <= actor["front_m"] <= road.length_m - 20.0 for actor in actors]
    if not all(inside):
        name = actors[inside.index(False)]["name"]
        raise TrafficError(f"{scenario.name}: {name} must start on the road")
    traffic = scenario.traffic
    return {
        "seed": seed,
        "lanes": road.lanes,
        "lane_width_m": road.lane_width_m,
        "length_m": road.length_m,
        "speed_limit_mps": road.speed_limit_mps,
        "opposite": road.opposite,
        "density_per_km_lane": traffic.density_per_km_lane,
        "mix": dict(traffic.mix),
        "warm_up_s": traffic.warm_up_s,
        "lane_change_s": traffic.lane_change_s,
        "duration_s": float(times[-1]),
        "actors": actors,
    }


def _actor(name: str, role: Any, front_m: float, clear_m: float) -> dict[str, Any]:
    told = scripted_lanes(role)
    lanes = {role.lane, *(lane for _, lane in told)}
    moves = [{"at_s": at_s, "speed_mps": None, "lane": lane} for at_s, lane in told]
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
        "lanes": sorted(lanes),
        "clears_all_lanes": name == "target",
        "front_m": front_m,
        "clear_m": clear_m,
        "speed_mps": role.speed_mps,
        "manoeuvres": moves,
    }


_kept: dict[str, dict[str, NDArray[Any]]] = {}
"""The last recordings, under what made them; a solver asks for one many times over."""


def _recorded(request: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the recording of a request, cut from a longer one where there is one.

    SUMO steps forward only, so the first steps of a longer run are those of a shorter
    one: cut or run anew, the recording is the same to the bit.
    """
    key = json.dumps(request | {"duration_s": None}, sort_keys=True)
    steps = round(request["duration_s"] / STEP_S) + 2
    kept = _kept.get(key)
    if kept is None or len(kept["front"]) < steps:
        kept = run_sumo("simbench.scenarios.highway.sumo_process", request)
        while len(_kept) >= _KEEP:
            del _kept[next(iter(_kept))]
        _kept[key] = kept
    front, lane = kept["front"][:steps], kept["lane"][:steps]
    came = ~np.all(np.isnan(front), axis=0)
    return {
        "names": kept["names"][came],
        "front": front[:, came],
        "lane": lane[:, came],
        "collisions": kept["collisions"][: steps - 1],
    }


def run_sumo(module: str, request: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Run a module that drives SUMO in a child process, and return its recording.

    Raises
    ------
    TrafficError
        With SUMO's own words, if it refuses, crashes or does not come to an end.
    """
    with tempfile.TemporaryDirectory(prefix="simbench-traffic-") as folder:
        answer = Path(folder) / "recording.npz"
        # -P: a random.py in the user's directory must not stand in for the real one
        program = [sys.executable, "-P", "-m", module, str(answer)]
        try:
            done = subprocess.run(
                program,
                input=json.dumps(request).encode(),
                capture_output=True,
                timeout=_TIMEOUT_S,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise TrafficError(f"SUMO took longer than {_TIMEOUT_S:g} s") from error
        raise_if_failed(done)
        with np.load(answer) as recording:
            return dict(recording)


def raise_if_failed(done: subprocess.CompletedProcess[bytes]) -> None:
    """Turn a failed SUMO process into an error that carries SUMO's own words."""
    if done.returncode < 0:
        raise TrafficError(f"SUMO crashed (signal {-done.returncode})")
    if done.returncode != 0:
        words = [line for line in done.stderr.decode(errors="replace").splitlines()]
        said = [line for line in words if "Error" in line] or words[-1:]
        raise TrafficError(f"SUMO refused: {' '.join(said)[:500]}")


def _implausible(
    recording: dict[str, NDArray[Any]], request: dict[str, Any], scenario: Scenario
) -> str:
    """Say what is wrong with a draw, or nothing."""
    if recording["collisions"].any():
        return "vehicles collided"
    names = recording["names"].tolist()
    column = names.index("target")
    front = recording["front"][:, column]
    if np.isnan(front).any():
        left = int(np.isnan(front).argmax()) * STEP_S
        raise TrafficError(
            f"{scenario.name}: the target reaches the end of the road after {left:.1f} "
            f"s of {request['duration_s']:.1f}: lengthen road.sections or start "
            "earlier"
        )
    speed = np.diff(front) / STEP_S
    window = round(0.2 / STEP_S)  # drivers act five times a second
    braking = -(speed[window:] - speed[:-window]) / (window * STEP_S)
    if len(braking) and braking.max() > _PLAUSIBLE_BRAKING:
        return f"the target braked with {braking.max():.1f} m/s^2"
    for actor in request["actors"]:
        lane = recording["lane"][:, names.index(actor["name"])]
        if not _changed_as_told(lane, actor, request["lane_change_s"]):
            return f"{actor['name']} could not change lane as told"
    return ""


def _changed_as_told(
    lane: NDArray[np.float64], actor: dict[str, Any], lasts_s: float
) -> bool:
    """Tell whether every lane change began within a second and took its time."""

    def at(time_s: float) -> float:
        """Return the lane then, or NaN past the end or off the road."""
        step = round(time_s / STEP_S)
        return float(lane[step]) if step < len(lane) else float("nan")

    before = actor["lane"]
    moves = [move for move in actor["manoeuvres"] if move["lane"] is not None]
    nexts = [move["at_s"] for move in moves[1:]] + [np.inf]
    for move, next_s in zip(moves, nexts[: len(moves)], strict=True):
        begun = move["at_s"] + 1.0
        done = min(move["at_s"] + 1.2 + lasts_s, next_s)
        # NaN compares false: what the recording does not show is not held against it.
        if abs(at(begun) - before) < 1e-6 or abs(at(done) - move["lane"]) > 0.02:
            return False
        before = move["lane"]
    return True
