"""Trajectories of a scenario on a SUMO network, and the path of its target."""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import ScenarioError
from simbench.core.trajectories import LaneChange, Trajectories, Vehicle
from simbench.scenarios.geometry.line import Line
from simbench.scenarios.highway.fleet import sample_paint
from simbench.scenarios.highway.kinematics import gradient, interpolate
from simbench.scenarios.highway.tractrix import body_poses
from simbench.scenarios.network.recording import RecordedVehicle, Recording
from simbench.scenarios.network.shapes import Network, read_network
from simbench.scenarios.network.target import Paint, choose_target
from simbench.scenarios.network.target_line import target_line
from simbench.scenarios.run_sumo import run_sumo
from simbench.scenarios.schema import Scenario, SumoRoad, TargetRule
from simbench.scenarios.schema.frame_times import frame_times
from simbench.scenarios.schema.seeds import generator, stream_seed
from simbench.scenarios.schema.sumo_config import SumoFiles
from simbench.scenarios.time_step import STEP_S

__all__ = ["NetworkSimulation", "simulate_network"]

logger = logging.getLogger(__name__)

_ATTEMPTS = 3
_SETTLING = round(10.0 / STEP_S)  # steps before the first frame, for the headings
_NEAR_M = 900.0


@dataclass(frozen=True, slots=True)
class NetworkSimulation:
    """Result of a simulation on a network.

    Attributes
    ----------
    network : Network
        In its own coordinates; ``line.map_origin`` is where the road frame begins.
    line : Line
        The path of the target, along 0 where it is in frame 0.
    trajectories : Trajectories
    """

    network: Network
    line: Line
    trajectories: Trajectories


def simulate_network(
    scenario: Scenario, seed: int, *, skip: int = 0
) -> NetworkSimulation:
    """Simulate the traffic on a SUMO network and choose the target.

    Parameters
    ----------
    scenario : Scenario
        Its road is a `SumoRoad`.
    seed : int
        Seed of the run; the traffic's stream becomes SUMO's seed.
    skip : int
        Traffic attempts to skip because they were rejected later.

    Raises
    ------
    TrafficError
        With SUMO's own message, if it refuses the network or crashes on it.
    ScenarioError
        If no vehicle meets the conditions on the target.
    """
    road, rule = scenario.road, scenario.target.rule
    if not isinstance(road, SumoRoad) or rule is None:
        raise ScenarioError(
            f"{scenario.name}: expected road: {{sumo: ...}} and target.choose"
        )
    files = _files(scenario.name, road)
    path = str(files.network)
    times = frame_times(scenario, seed)
    duration_s = float(times[-1])
    network = _network(path, files.content)
    problem: ScenarioError | None = None
    for attempt in range(skip, skip + _ATTEMPTS):
        sumo_seed = stream_seed(scenario, seed, "traffic", attempt)
        request = _request(scenario, road, rule, files, sumo_seed, duration_s)
        vehicles = _recorded(json.dumps(request), path, files.content).vehicles
        looks = generator(scenario, seed, "looks")
        paints = [v.colour or sample_paint(v.vehicle_class, looks) for v in vehicles]
        try:
            target, start = choose_target(
                rule, vehicles, paints, duration_s, road.search_s, network.roads
            )
        except ScenarioError as error:
            problem = error
            logger.info("%s seed %d: traffic rejected: %s", scenario.name, seed, error)
            continue
        return _cut(network, vehicles, paints, target, start, times, attempt)
    raise ScenarioError(f"{scenario.name}: target.choose: {problem}")


def _files(name: str, road: SumoRoad) -> SumoFiles:
    """Read the files again: they may have changed since the scenario was read."""
    try:
        files = road.files
    except ValueError as error:
        raise ScenarioError(f"{name}: road: {error}") from None
    if files.content != road.content:
        raise ScenarioError(
            f"{name}: road: {files.network} or its routes changed after the scenario "
            "was read: read it again"
        )
    return files


def _request(
    scenario: Scenario,
    road: SumoRoad,
    rule: TargetRule,
    files: SumoFiles,
    seed: int,
    duration_s: float,
) -> dict[str, object]:
    begin = {} if road.begin_s is None else {"begin": str(road.begin_s)}
    lasts_s = max(rule.lasts_s or 0.0, duration_s)
    return {
        "folder": str(files.folder.resolve()),
        "options": files.options | begin,
        "seed": seed,
        "duration_s": rule.after_s + road.search_s + lasts_s,
        "lane_change_s": scenario.traffic.lane_change_s,
    }


@lru_cache(maxsize=4)
def _network(path: str, _content: str) -> Network:
    return read_network(Path(path))


@lru_cache(maxsize=2)
def _recorded(request: str, path: str, content: str) -> Recording:
    """Run SUMO once for all calls with the same request."""
    raw = run_sumo("simbench.scenarios.network.sumo_process", json.loads(request))
    return Recording.from_arrays(raw, _network(path, content))


def _cut(
    network: Network,
    vehicles: tuple[RecordedVehicle, ...],
    paints: list[Paint],
    target: int,
    start: int,
    times: NDArray[np.float64],
    traffic_redraws: int,
) -> NetworkSimulation:
    """Cut the scenario out of a recording, from the target's first step on."""
    first = max(0, start - _SETTLING)
    last = start + int(np.ceil(times[-1] / STEP_S)) + 2
    kept = _near(vehicles, target, start, last)
    own = kept.index(target)
    # SUMO may know another vehicle by the name that is kept for the target.
    names = [f"sumo.{v.name}" if v.name == "target" else v.name for v in vehicles]
    names[target] = "target"
    fields = [_dense(vehicles[number], first, last) for number in kept]
    front, heading, slope, lanes = (
        np.stack(one, axis=1) for one in zip(*fields, strict=True)
    )
    lengths = np.array([vehicles[number].length for number in kept])
    centre, heading, pitch = body_poses(front, heading, slope, lengths)
    steps = start - first + times / STEP_S
    positions = interpolate(centre, steps)
    origin = positions[0, own].copy()
    lanes = np.nan_to_num(lanes[np.rint(steps).astype(np.int64)], nan=-1.0)
    trajectories = Trajectories(
        times=times,
        vehicles=tuple(_vehicle(vehicles[n], names[n], paints[n]) for n in kept),
        positions=positions - origin,
        headings=interpolate(heading, steps),
        pitches=interpolate(pitch, steps),
        speeds=np.linalg.norm(interpolate(gradient(centre), steps), axis=-1),
        lanes=np.where(np.isnan(positions[..., 0]), -1, lanes).astype(np.int64),
        target=own,
        lane_changes=_lane_changes(vehicles, names, kept, start, times[-1]),
        traffic_redraws=traffic_redraws,
    )
    return NetworkSimulation(
        network, target_line(vehicles[target], origin), trajectories
    )


def _near(
    vehicles: tuple[RecordedVehicle, ...], target: int, start: int, last: int
) -> list[int]:
    """Return the numbers of the vehicles that come near the target's path."""
    shown = [
        vehicle.front[(vehicle.steps >= start) & (vehicle.steps < last), :2]
        for vehicle in vehicles
    ]
    low = shown[target].min(axis=0) - _NEAR_M
    high = shown[target].max(axis=0) + _NEAR_M
    return [
        number
        for number, places in enumerate(shown)
        if np.any(np.all((places >= low) & (places <= high), axis=1))
    ]


def _dense(
    vehicle: RecordedVehicle, first: int, last: int
) -> tuple[NDArray[np.float64], ...]:
    """Return front, heading, slope and lane at every step; NaN where it is absent."""
    rows = (vehicle.steps >= first) & (vehicle.steps < last)

    def spread(values: NDArray[Any]) -> NDArray[np.float64]:
        dense = np.full((last - first, *values.shape[1:]), np.nan)
        dense[vehicle.steps[rows] - first] = values[rows]
        return dense

    fields = vehicle.smooth_front, vehicle.heading, vehicle.slope, vehicle.index
    return tuple(spread(values) for values in fields)


def _vehicle(vehicle: RecordedVehicle, name: str, paint: Paint) -> Vehicle:
    return Vehicle(
        name,
        vehicle.vehicle_class,
        vehicle.length,
        vehicle.width,
        vehicle.height,
        paint,
    )


def _lane_changes(
    vehicles: tuple[RecordedVehicle, ...],
    names: list[str],
    kept: list[int],
    start: int,
    until_s: float,
) -> tuple[LaneChange, ...]:
    """Return the lane changes that begin in the sequence, in its time."""
    changes = [
        LaneChange(
            names[number],
            float((change.start - start) * STEP_S),
            float((change.end - start) * STEP_S),
            change.origin,
            change.goal,
        )
        for number in kept
        for change in vehicles[number].changes
    ]
    shown = [change for change in changes if 0.0 <= change.start_s <= until_s]
    return tuple(sorted(shown, key=lambda change: (change.start_s, change.vehicle)))
