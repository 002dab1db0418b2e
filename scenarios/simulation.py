"""From a scenario to trajectories: ask SUMO, bend its straight road, check the draw."""

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

from simbench.errors import TrafficError
from simbench.scenarios.fleet import FLEET, PAINTS, draw_paint
from simbench.scenarios.road import RoadLine
from simbench.scenarios.schema import Scenario
from simbench.scenarios.seeds import generator, stream
from simbench.trajectories import LaneChange, Trajectories, Vehicle

__all__ = ["raise_if_failed", "simulate", "smooth_lane"]

logger = logging.getLogger(__name__)

_STEP_S = 0.04
_DRAWS = 20
_PLAUSIBLE_BRAKING = 6.0  # m/s^2; harder is an emergency stop, not driving
_TIMEOUT_S = 600.0


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
    for attempt in range(skip, skip + _DRAWS):
        request = _request(scenario, line, stream(scenario, seed, "traffic", attempt))
        recording = _run_sumo(request)
        reason = _implausible(recording, request, scenario)
        if not reason:
            return _trajectories(recording, scenario, line, seed, attempt)
        logger.info("%s seed %d: drawn again: %s", scenario.name, seed, reason)
    raise TrafficError(
        f"{scenario.name}: no plausible traffic in {_DRAWS} draws, wanted one without "
        f"collisions and with the target as told; the last one: {reason}"
    )


def _request(scenario: Scenario, line: RoadLine, seed: int) -> dict[str, Any]:
    road, target = scenario.road, scenario.target
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
        "duration_s": scenario.duration_s,
        "actors": actors,
    }


def _actor(name: str, role: Any, front_m: float, clear_m: float) -> dict[str, Any]:
    lanes = {role.lane}
    lane = role.lane
    for move in role.manoeuvres:
        if move.change_lane is not None:
            lane += 1 if move.change_lane == "left" else -1
            lanes.add(lane)
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
        "manoeuvres": [move.model_dump() for move in role.manoeuvres],
    }


def _run_sumo(request: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Run `simbench.scenarios.traffic` in a child process."""
    with tempfile.TemporaryDirectory(prefix="simbench-traffic-") as folder:
        answer = Path(folder) / "recording.npz"
        # -P: a random.py in the user's directory must not stand in for the real one
        module = "simbench.scenarios.traffic"
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
    if recording["collisions"] > 0:
        return "vehicles collided"
    names = recording["names"].tolist()
    column = names.index("target")
    front = recording["front"][:, column]
    if np.isnan(front).any():
        left = int(np.isnan(front).argmax()) * _STEP_S
        raise TrafficError(
            f"{scenario.name}: the target reaches the end of the road after {left:.1f} "
            f"s of {scenario.duration_s:.1f}: lengthen road.sections, or start earlier"
        )
    speed = np.diff(front) / _STEP_S
    window = round(0.2 / _STEP_S)  # drivers act five times a second
    braking = -(speed[window:] - speed[:-window]) / (window * _STEP_S)
    if len(braking) and braking.max() > _PLAUSIBLE_BRAKING:
        return f"the target braked with {braking.max():.1f} m/s^2"
    for actor in request["actors"]:
        lane = recording["lane"][:, names.index(actor["name"])]
        told = _told_lane(actor["lane"], actor["manoeuvres"], request)
        if not np.isnan(lane[-1]) and abs(lane[-1] - told) > 0.6:
            return f"{actor['name']} could not change lane as told"
    return ""


def _told_lane(lane: int, moves: list[dict[str, Any]], request: dict[str, Any]) -> int:
    settled = request["duration_s"] - request["lane_change_s"] - 2.0
    for move in moves:
        if move["change_lane"] is not None and move["at_s"] <= settled:
            lane += 1 if move["change_lane"] == "left" else -1
    return lane


def _trajectories(
    recording: dict[str, NDArray[Any]],
    scenario: Scenario,
    line: RoadLine,
    seed: int,
    redraws: int,
) -> Trajectories:
    times = np.arange(scenario.frames, dtype=np.float64)
    times *= scenario.imaging.interval_s
    at = times / _STEP_S
    shown = ~np.all(np.isnan(_sample(recording["front"], at)), axis=0)
    front, lane = recording["front"][:, shown], recording["lane"][:, shown]
    names: list[str] = recording["names"][shown].tolist()
    kinds = [_kind(name, scenario) for name in names]
    near = np.array([not name.startswith("far.") for name in names])
    lengths = np.array([FLEET[kind].length for kind in kinds])
    changes = _lane_changes(lane, names, times[-1])
    lane = smooth_lane(lane)
    along = front - lengths / 2.0 - line.road.before_m
    end = line.road.length_m - line.road.before_m
    along = np.where(near, along, end - line.road.before_m - along)
    lateral = line.lane_lateral(lane) * np.where(near, 1.0, -1.0)
    places = line.point(along, lateral)
    turn = np.where(near, 0.0, np.pi)
    heading = line.heading_at(along) + turn + _drift(along, lateral, near)
    pitch = line.pitch_at(along) * np.where(near, 1.0, -1.0)
    velocity = _gradient(places)
    looks = generator(scenario, seed, "looks")
    sampled = _sample(places, at)
    present = ~np.isnan(sampled[..., 0])
    lanes = np.where(present, np.rint(np.nan_to_num(_sample(lane, at))), -1)
    return Trajectories(
        times=times,
        vehicles=_vehicles(names, kinds, scenario, looks),
        positions=sampled,
        headings=_sample(heading, at),
        pitches=_sample(pitch, at),
        speeds=np.linalg.norm(_sample(velocity, at), axis=-1),
        lanes=lanes.astype(np.int64),
        target=names.index("target"),
        lane_changes=changes,
        redraws=redraws,
    )


def _kind(name: str, scenario: Scenario) -> Any:
    if name == "target":
        return scenario.target.vehicle_class
    if name.startswith("stranger."):
        return scenario.strangers[int(name.split(".")[1])].vehicle_class
    return name.rsplit(".", 1)[1]


def _vehicles(
    names: list[str], kinds: list[Any], scenario: Scenario, looks: np.random.Generator
) -> tuple[Vehicle, ...]:
    vehicles = []
    for name, kind in zip(names, kinds, strict=True):
        build = FLEET[kind]
        colour = draw_paint(kind, looks)
        if name == "target":
            colour = PAINTS[scenario.target.colour]
        elif name.startswith("stranger."):
            colour = PAINTS[scenario.strangers[int(name.split(".")[1])].colour]
        vehicles.append(
            Vehicle(name, kind, build.length, build.width, build.height, colour)
        )
    return tuple(vehicles)


def smooth_lane(lane: NDArray[np.float64]) -> NDArray[np.float64]:
    """Round off SUMO's straight lane-change ramps.

    SUMO moves a vehicle sideways at constant speed between lane centres. The
    fraction of the way is mapped through the minimum-jerk polynomial, so that lateral
    speed and acceleration vanish at both ends; no history is needed.

    Parameters
    ----------
    lane : (...) float
        Lane coordinate: whole numbers are lane centres.

    Returns
    -------
    (...) float

    References
    ----------
    Flash and Hogan (1985), "The coordination of arm movements", J. Neuroscience 5(7).

    Examples
    --------
    >>> smooth_lane(np.array([1.0, 1.25, 1.5, 2.0])).round(3).tolist()
    [1.0, 1.104, 1.5, 2.0]
    """
    whole = np.floor(lane + 1e-9)
    part = np.clip(lane - whole, 0.0, 1.0)
    eased: NDArray[np.float64] = whole + part**3 * (10.0 + part * (-15.0 + 6.0 * part))
    return eased


def _gradient(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rate of change along axis 0 per second; one-sided next to NaN."""
    step = np.diff(values, axis=0) / _STEP_S
    pad = np.full((1, *values.shape[1:]), np.nan)
    before = np.concatenate([pad, step])
    after = np.concatenate([step, pad])
    before = np.where(np.isnan(before), after, before)
    after = np.where(np.isnan(after), before, after)
    mean: NDArray[np.float64] = (before + after) / 2.0
    return mean


def _drift(
    along: NDArray[np.float64], lateral: NDArray[np.float64], near: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the angle [rad] between a vehicle's motion and its lane."""
    forward = np.where(near, 1.0, -1.0)
    sideways, onward = _gradient(lateral) * forward, _gradient(along) * forward
    return np.where(onward > 1.0, np.arctan2(sideways, np.maximum(onward, 1.0)), 0.0)


def _sample(
    values: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Interpolate (T, ...) values linearly at fractional steps; NaN stays NaN."""
    low = np.minimum(np.floor(at + 1e-9).astype(np.int64), len(values) - 2)
    part = np.clip(at - low, 0.0, 1.0).reshape(-1, *[1] * (values.ndim - 1))
    mixed = values[low] + part * (values[low + 1] - values[low])
    sampled: NDArray[np.float64] = np.where(part < 1e-9, values[low], mixed)
    return sampled


def _lane_changes(
    lane: NDArray[np.float64], names: list[str], until_s: float
) -> tuple[LaneChange, ...]:
    changes = []
    for column, name in enumerate(names):
        track = lane[:, column]
        moving = np.abs(track - np.rint(track)) > 1e-6
        edges = np.flatnonzero(np.diff(moving.astype(np.int8)))
        starts = [edge for edge in edges if moving[edge + 1]]
        for start in starts:
            later = edges[edges > start]
            stop = int(later[0]) + 1 if len(later) else len(track) - 1
            origin, goal = track[start], track[stop]
            if np.isnan(goal) or np.isnan(origin) or round(goal) == round(origin):
                continue
            if start * _STEP_S <= until_s:
                changes.append(
                    LaneChange(
                        name,
                        float(start * _STEP_S),
                        float(stop * _STEP_S),
                        round(float(origin)),
                        round(float(goal)),
                    )
                )
    return tuple(sorted(changes, key=lambda change: (change.start_s, change.vehicle)))
