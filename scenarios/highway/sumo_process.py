"""SUMO on a highway, in a process of its own: request in, recording out.

``python -m simbench.scenarios.highway.sumo_process FILE`` reads a request (JSON) from
standard input and writes a recording (NPZ) to FILE; see
`simbench.scenarios.run_sumo`. The roads are straight here: SUMO simulates the
driving along the lanes, and `simbench.scenarios.highway.kinematics` maps the result
onto the real road.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import libsumo
import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.runtime.process_control import die_with
from simbench.runtime.scratch import scratch_folder
from simbench.scenarios.highway.fleet import FLEET
from simbench.scenarios.highway.sumo_files import network_xml, sides_of, types_xml
from simbench.scenarios.time_step import STEP_S

__all__ = ["Simulate", "answer_request", "main", "simulate", "sumo_command"]

_SCRIPTED_CHANGES_ONLY = 256  # SUMO's lane change mode; it still avoids collisions
_ENTRY_M = 18.0
_COMFORTABLE = 2.0  # m/s^2, scripted changes of speed


Simulate = Callable[[dict[str, Any]], dict[str, Any]]
"""Simulates a request and returns the arrays of its recording."""


def answer_request(simulate: Simulate, request: dict[str, Any], answer: Path) -> int:
    """Simulate a request and save the recording.

    Returns the exit status: 0 on success, 1 after writing SUMO's error to standard
    error.
    """
    try:
        recording = simulate(request)
    except (
        libsumo.TraCIException,
        libsumo.FatalTraCIError,
        TrafficError,
    ) as error:
        print(f"Error: {error}", file=sys.stderr)
        return 1
    np.savez(answer, **recording)
    return 0


def main(simulate: Simulate) -> NoReturn:
    """Answer the request on standard input, in the file that the command line names."""
    die_with(os.getppid())
    answer = Path(sys.argv[1]).resolve()
    sys.exit(answer_request(simulate, json.load(sys.stdin), answer))


def sumo_command(options: dict[str, Any], seed: int) -> list[str]:
    """Return the command line of SUMO for options by their names without dashes."""
    fixed = {"step-length": STEP_S, "seed": seed % 2**31, "xml-validation": "never"}
    pairs = [
        part
        for name, value in (options | fixed).items()
        for part in (f"--{name}", str(value))
    ]
    return ["sumo", *pairs, "--no-step-log", "--no-warnings", "--duration-log.disable"]


def simulate(request: dict[str, Any]) -> dict[str, Any]:
    """Simulate a request, see `simbench.scenarios.highway.sumo_files`."""
    rng = np.random.default_rng(request["seed"])
    options = {
        "net-file": "road.net.xml",
        "route-files": "types.rou.xml",
        "step-method.ballistic": "true",
        "default.action-step-length": 0.2,
        "lanechange.duration": request["lane_change_s"],
        "insertion-checks": "none",
        "eager-insert": "true",
        "collision.action": "warn",
        "time-to-teleport": -1,
    }
    with scratch_folder("sumo-") as folder:
        os.chdir(folder)  # SUMO reads a comma in a path as the start of another
        Path(options["net-file"]).write_text(network_xml(request))
        Path(options["route-files"]).write_text(types_xml(request))
        libsumo.start(sumo_command(options, request["seed"]))
        try:
            carriageways = [_Carriageway(s, request, rng) for s in sides_of(request)]
            for carriageway in carriageways:
                carriageway.populate()
            for _ in range(round(request["warm_up_s"] / STEP_S)):
                _advance(carriageways)
            _insert_actors(request)
            _advance(carriageways)
            return _record(request, carriageways)
        finally:
            libsumo.close()


def _advance(carriageways: list[_Carriageway]) -> None:
    for carriageway in carriageways:
        carriageway.replenish()
    libsumo.simulationStep()


class _Carriageway:
    """One direction of the road, kept filled with vehicles that do not collide."""

    def __init__(
        self, side: str, request: dict[str, Any], rng: np.random.Generator
    ) -> None:
        self.side = side
        self.request = request
        self.rng = rng
        self.count = 0
        self.last: dict[int, str] = {}
        # distance until the next entry, by lane [m]
        self.due = [self._gap() for _ in range(request["lanes"])]

    def populate(self) -> None:
        """Insert vehicles along every lane."""
        for lane in range(self.request["lanes"]):
            place = _ENTRY_M + self._gap()
            while place < self.request["length_m"] - 10.0:
                kind = self._kind(lane)
                place += FLEET[kind].length
                self._add(kind, lane, place, self._speed(kind, lane))
                place += self._gap()

    def replenish(self) -> None:
        """Insert a vehicle at the upstream end of each lane that has room.

        With SUMO's own insertion checks off (they starve a populated road), entering
        vehicles would collide without this guard.
        """
        present = set(libsumo.vehicle.getIDList())
        for lane in range(self.request["lanes"]):
            leader = self.last.get(lane)
            if leader not in present:
                names = libsumo.lane.getLastStepVehicleIDs(f"{self.side}_{lane}")
                leader = names[0] if names else None
            kind = self._kind(lane) if self.due[lane] <= 0 else None
            speed = self.request["speed_limit_mps"]
            if leader is not None:
                rear = libsumo.vehicle.getLanePosition(leader)
                rear -= libsumo.vehicle.getLength(leader)
                speed = min(speed, libsumo.vehicle.getSpeed(leader) + 0.5)
                if rear < _ENTRY_M + 4.0 + 1.2 * speed + 12.0:
                    kind = None
            self.due[lane] -= STEP_S * speed
            if kind is not None:
                speed = min(speed, self._speed(kind, lane))
                self._add(kind, lane, _ENTRY_M, speed)
                self.due[lane] = self._gap()

    def _gap(self) -> float:
        """Sample the distance to the next vehicle [m]."""
        density = self.request["density_per_km_lane"]
        if density <= 0:
            return float("inf")
        return 30.0 + float(self.rng.exponential(max(1000.0 / density - 36.0, 1.0)))

    def _kind(self, lane: int) -> Any:
        """Sample the class of a vehicle for a lane."""
        lanes, mix = self.request["lanes"], self.request["mix"]
        if lanes >= 3 and lane == lanes - 1:
            light = {kind: mix[kind] for kind in mix if FLEET[kind].is_light}
            mix = light or mix
        weights = np.array(list(mix.values()), dtype=np.float64)
        total = weights.sum()
        if total <= 0:
            return "car"
        return list(mix)[int(self.rng.choice(len(weights), p=weights / total))]

    def _speed(self, kind: Any, lane: int) -> float:
        model = FLEET[kind]
        limit = self.request["speed_limit_mps"]
        share = model.speed_factor - 0.08 + 0.06 * lane
        return float(min(limit * share, model.max_speed - 1.0))

    def _add(self, kind: str, lane: int, place: float, speed: float) -> None:
        name = f"{self.side}.{self.count}.{kind}"
        self.count += 1
        self.last[lane] = name
        _insert(name, self.side, kind, lane, place, speed)


def _insert(
    name: str, side: str, kind: str, lane: int, place: float, speed: float
) -> None:
    libsumo.vehicle.add(
        name,
        side,
        kind,
        depart="now",
        departLane=str(lane),
        departPos=f"{place:.3f}",
        departSpeed=f"{speed:.3f}",
    )


def _insert_actors(request: dict[str, Any]) -> None:
    """Remove the traffic around the scenario's own vehicles and insert these."""
    for actor in request["actors"]:
        for name in libsumo.vehicle.getIDList():
            if libsumo.vehicle.getRoadID(name) != "near":
                continue
            own = libsumo.vehicle.getLaneIndex(name) in actor["lanes"]
            if not own and not actor["clears_all_lanes"]:
                continue
            front = libsumo.vehicle.getLanePosition(name)
            rear = front - libsumo.vehicle.getLength(name)
            ahead = rear - actor["front_m"] < actor["clear_m"]
            behind = actor["front_m"] - actor["length_m"] - front < actor["clear_m"]
            if ahead and behind:
                libsumo.vehicle.remove(name)
    for actor in request["actors"]:
        place, speed = actor["front_m"], actor["speed_mps"]
        kind = f"{actor['kind']}.actor"
        _insert(actor["name"], "near", kind, actor["lane"], place, speed)


def _record(
    request: dict[str, Any], carriageways: list[_Carriageway]
) -> dict[str, Any]:
    """Step through the scenario and record every vehicle at every step."""
    steps = round(request["duration_s"] / STEP_S) + 2
    tracks: dict[str, NDArray[np.float64]] = defaultdict(
        lambda: np.full((2, steps), np.nan)
    )
    collisions = np.zeros(steps, dtype=np.int64)
    script = _Script(request["actors"])
    for step in range(steps):
        script.apply(step * STEP_S)
        present = libsumo.vehicle.getIDList()
        for name in present:
            lane = libsumo.vehicle.getLaneIndex(name)
            offset = libsumo.vehicle.getLateralLanePosition(name)
            place = libsumo.vehicle.getLanePosition(name)
            tracks[name][:, step] = place, lane + offset / request["lane_width_m"]
        if "target" not in present:
            break  # the caller reports why
        if step < steps - 1:
            _advance(carriageways)
            collisions[step] = libsumo.simulation.getCollidingVehiclesNumber()
    names = np.array(list(tracks))
    front, lanes = np.stack(list(tracks.values()), axis=-1)
    return {"names": names, "front": front, "lane": lanes, "collisions": collisions}


class _Script:
    """Scripted manoeuvres of the scenario's own vehicles."""

    def __init__(self, actors: list[dict[str, Any]]) -> None:
        moves = [
            (move["at_s"], actor["name"], move)
            for actor in actors
            for move in actor["manoeuvres"]
        ]
        self.pending = sorted(moves, key=lambda move: move[:2])
        self.ramps: dict[str, list[float]] = {}
        for actor in actors:
            libsumo.vehicle.setLaneChangeMode(actor["name"], _SCRIPTED_CHANGES_ONLY)
            libsumo.vehicle.setSpeed(actor["name"], actor["speed_mps"])

    def apply(self, now_s: float) -> None:
        """Start the manoeuvres that are due, and go on with those under way."""
        present = set(libsumo.vehicle.getIDList())
        while self.pending and self.pending[0][0] <= now_s + 1e-9:
            _, name, move = self.pending.pop(0)
            if name in present and move["speed_mps"] is not None:
                self.ramps[name] = _ramp(name, move["speed_mps"])
            elif name in present:
                libsumo.vehicle.changeLane(name, move["lane"], 1e6)
        for name, speeds in self.ramps.items():
            if speeds and name in present:
                libsumo.vehicle.setSpeed(name, speeds.pop(0))


def _ramp(name: str, goal_mps: float) -> list[float]:
    """Return the speeds of the next steps; SUMO would brake its hardest for a jump."""
    now = libsumo.vehicle.getSpeed(name)
    count = max(1, math.ceil(abs(goal_mps - now) / _COMFORTABLE / STEP_S))
    return [now + (goal_mps - now) * (n + 1) / count for n in range(count)]


if __name__ == "__main__":
    main(simulate)
