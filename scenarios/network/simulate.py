"""From a scenario on a SUMO network to trajectories, and the path of its target."""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import ScenarioError
from simbench.core.trajectories import LaneChange, Trajectories, Vehicle
from simbench.scenarios.geometry.line import Line
from simbench.scenarios.highway.bending import STEP_S, gradient, sample
from simbench.scenarios.highway.fleet import sample_paint
from simbench.scenarios.highway.simulate import run_sumo
from simbench.scenarios.highway.tractrix import body_centre, calm_slope, towed
from simbench.scenarios.network.recording import Drive, Recording
from simbench.scenarios.network.shapes import Network, read_network
from simbench.scenarios.network.target import choose
from simbench.scenarios.network.target_line import target_line
from simbench.scenarios.schema import Scenario, SumoRoad
from simbench.scenarios.schema.frame_times import frame_times
from simbench.scenarios.schema.seeds import generator, stream
from simbench.scenarios.schema.sumo_config import SumoFiles

__all__ = ["NetworkDrive", "drive_network"]

logger = logging.getLogger(__name__)

_DRAWS = 3
_SETTLING = round(10.0 / STEP_S)  # steps before the story, for the headings
_NEAR_M = 900.0


@dataclass(frozen=True, slots=True)
class NetworkDrive:
    """What happened on a network.

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


def drive_network(scenario: Scenario, seed: int, *, skip: int = 0) -> NetworkDrive:
    """Drive on a SUMO network and find the target.

    Parameters
    ----------
    scenario : Scenario
        Its road is a `SumoRoad`.
    seed : int
        Seed of the run; the traffic's stream becomes SUMO's seed.
    skip : int
        Draws of the traffic to pass over because they were found unfit later.

    Raises
    ------
    TrafficError
        With SUMO's own words, if it refuses the network or crashes on it.
    ScenarioError
        If no vehicle is as the target should be.
    """
    road, choice = scenario.road, scenario.target.choice
    if not isinstance(road, SumoRoad) or choice is None:
        raise ScenarioError(f"{scenario.name}: wanted road: {{sumo: ...}} and a target")
    files = _files(scenario.name, road)
    path = str(files.network)
    times = frame_times(scenario, seed)
    network = _network(path, files.content)
    problem: ScenarioError | None = None
    for attempt in range(skip, skip + _DRAWS):
        draw = stream(scenario, seed, "traffic", attempt)
        request = _request(scenario, road, files, draw, float(times[-1]))
        recording = _recorded(json.dumps(request), path, files.content)
        looks = generator(scenario, seed, "looks")
        paints = [
            one.look.colour or sample_paint(one.look.vehicle_class, looks)
            for one in recording.drives
        ]
        try:
            target, start = choose(
                choice,
                recording.drives,
                paints,
                float(times[-1]),
                road.search_s,
                network.roads,
            )
        except ScenarioError as error:
            problem = error
            logger.info("%s seed %d: driven again: %s", scenario.name, seed, error)
            continue
        return _played(network, recording.drives, paints, target, start, times, attempt)
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
    scenario: Scenario, road: SumoRoad, files: SumoFiles, seed: int, lasts_s: float
) -> dict[str, object]:
    choice = scenario.target.choice
    options = dict(files.options)
    if road.begin_s is not None:
        options["begin"] = str(road.begin_s)
    after_s = 0.0
    if choice is not None:
        after_s, lasts_s = choice.after_s, max(choice.lasts_s or 0.0, lasts_s)
    return {
        "folder": str(files.folder.resolve()),
        "options": options,
        "seed": seed,
        "duration_s": after_s + road.search_s + lasts_s,
        "lane_change_s": scenario.traffic.lane_change_s,
    }


@lru_cache(maxsize=4)
def _network(path: str, _content: str) -> Network:
    return read_network(Path(path))


@lru_cache(maxsize=2)
def _recorded(request: str, path: str, content: str) -> Recording:
    """Run SUMO once for many questions about the same drive."""
    raw = run_sumo("simbench.scenarios.network.sumo_process", json.loads(request))
    return Recording.from_arrays(raw, _network(path, content))


def _played(
    network: Network,
    drives: tuple[Drive, ...],
    paints: list[tuple[int, int, int]],
    target: int,
    start: int,
    times: NDArray[np.float64],
    traffic_redraws: int,
) -> NetworkDrive:
    """Cut the story out of a recording."""
    first = max(0, start - _SETTLING)
    last = start + int(np.ceil(times[-1] / STEP_S)) + 2
    chosen = _near(drives, target, start, last)
    kept = [drives[number] for number in chosen]
    fields = [_dense(drive, first, last) for drive in kept]
    front, told, slope, lanes = (
        np.stack(one, axis=1) for one in zip(*fields, strict=True)
    )
    lengths = np.array([drive.look.length for drive in kept])
    heading = towed(front, told, lengths)
    pitch = calm_slope(slope)
    centre = body_centre(front, heading, pitch, lengths)
    at = start - first + times / STEP_S
    positions = sample(centre, at)
    own = chosen.index(target)
    origin = positions[0, own].copy()
    present = ~np.isnan(positions[..., 0])
    nearest = lanes[np.rint(at).astype(np.int64)]
    trajectories = Trajectories(
        times=times,
        vehicles=_vehicles(kept, [paints[number] for number in chosen], own),
        positions=positions - origin,
        headings=sample(heading, at),
        pitches=sample(pitch, at),
        speeds=np.linalg.norm(sample(gradient(centre), at), axis=-1),
        lanes=np.where(present, np.nan_to_num(nearest, nan=-1.0), -1).astype(np.int64),
        target=own,
        lane_changes=_changes(kept, own, start, float(times[-1])),
        traffic_redraws=traffic_redraws,
    )
    return NetworkDrive(network, target_line(drives[target], origin), trajectories)


def _near(drives: tuple[Drive, ...], target: int, start: int, last: int) -> list[int]:
    """Return the vehicles that come near the target's way while the story lasts."""

    def shown(drive: Drive) -> NDArray[np.float64]:
        return drive.front[(drive.steps >= start) & (drive.steps < last), :2]

    way = shown(drives[target])
    low, high = way.min(axis=0) - _NEAR_M, way.max(axis=0) + _NEAR_M
    near = []
    for number, drive in enumerate(drives):
        places = shown(drive)
        if np.any(np.all((places >= low) & (places <= high), axis=1)):
            near.append(number)
    return near


def _dense(drive: Drive, first: int, last: int) -> tuple[NDArray[np.float64], ...]:
    """Return front, heading, slope and lane at every step; NaN where it is absent."""
    rows = (drive.steps >= first) & (drive.steps < last)
    at = drive.steps[rows] - first
    front = np.full((last - first, 3), np.nan)
    front[at] = drive.eased_front[rows]
    others = []
    for values in (drive.heading, drive.slope, drive.index):
        spread = np.full(last - first, np.nan)
        spread[at] = values[rows]
        others.append(spread)
    return front, *others


def _vehicles(
    drives: list[Drive], paints: list[tuple[int, int, int]], target: int
) -> tuple[Vehicle, ...]:
    vehicles = []
    for number, (drive, paint) in enumerate(zip(drives, paints, strict=True)):
        look = drive.look
        vehicles.append(
            Vehicle(
                _name(drive, number == target),
                look.vehicle_class,
                look.length,
                look.width,
                look.height,
                paint,
            )
        )
    return tuple(vehicles)


def _name(drive: Drive, is_target: bool) -> str:
    """Return what a vehicle is called: only one may be the ``target``."""
    if is_target:
        return "target"
    return f"sumo.{drive.name}" if drive.name == "target" else drive.name


def _changes(
    drives: list[Drive], target: int, start: int, lasts_s: float
) -> tuple[LaneChange, ...]:
    """Return the lane changes that begin in the story, on its clock."""
    found = [
        LaneChange(
            _name(drive, number == target),
            float((change.start - start) * STEP_S),
            float((change.end - start) * STEP_S),
            change.origin,
            change.goal,
        )
        for number, drive in enumerate(drives)
        for change in drive.changes
        if 0.0 <= (change.start - start) * STEP_S <= lasts_s
    ]
    return tuple(sorted(found, key=lambda change: (change.start_s, change.vehicle)))
