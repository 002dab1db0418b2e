"""Highway traffic by SUMO, as a program of its own: request in, recording out.

``python -m simbench.scenarios.highway.sumo_process FILE`` reads a request (JSON) from
standard input and writes a recording (NPZ) to FILE. SUMO has one simulation a process,
writes to the process's outputs and crashes on some networks; a child process makes all
three harmless. The roads are straight here: SUMO decides who drives where along the
lanes, and `simbench.scenarios.highway.bending` puts the result onto the real road.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any

import libsumo
import numpy as np

from simbench.scenarios.highway.bending import STEP_S
from simbench.scenarios.highway.fleet import FLEET
from simbench.scenarios.highway.sumo_files import network_xml, types_xml

__all__ = ["die_with_parent", "main"]

_TOLD_CHANGES_ONLY = 256  # none of its own; told ones unless it would hit someone
_ENTRY_M = 18.0
_COMFORTABLE = 2.0  # m/s^2, told changes of speed


def main() -> int:
    """Run one request; 0 on success, 1 after writing why not to standard error."""
    die_with_parent()
    request = json.load(sys.stdin)
    answer = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory(prefix="simbench-sumo-") as folder:
        try:
            recording = _simulate(request, Path(folder))
        except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
            print(f"Error: {error}", file=sys.stderr)
            return 1
    np.savez(answer, **recording)
    return 0


def die_with_parent() -> None:
    """Ask Linux to end this process when the one that started it is gone."""
    if sys.platform == "linux":
        set_parent_death_signal = 1
        ctypes.CDLL(None).prctl(set_parent_death_signal, signal.SIGKILL)


def _simulate(request: dict[str, Any], folder: Path) -> dict[str, Any]:
    rng = np.random.default_rng(request["seed"])
    network, types = "road.net.xml", "types.rou.xml"
    (folder / network).write_text(network_xml(request))
    (folder / types).write_text(types_xml(request))
    os.chdir(folder)  # SUMO reads a comma in a path as the start of another
    libsumo.start(_command(request, network, types))
    try:
        sides = ["near", "far"] if request["opposite"] else ["near"]
        drivers = [_Carriageway(side, request, rng) for side in sides]
        for carriageway in drivers:
            carriageway.populate()
        for _ in range(round(request["warm_up_s"] / STEP_S)):
            _advance(drivers)
        _place(request)
        _advance(drivers)
        return _record(request, drivers)
    finally:
        libsumo.close()


def _advance(carriageways: list[_Carriageway]) -> None:
    for carriageway in carriageways:
        carriageway.replenish()
    libsumo.simulationStep()


class _Carriageway:
    """Fills one direction and keeps it filled, without anyone running into anyone."""

    def __init__(
        self, side: str, request: dict[str, Any], rng: np.random.Generator
    ) -> None:
        self.side = side
        self.request = request
        self.rng = rng
        self.count = 0
        self.last: dict[int, str] = {}
        self.due = [self._gap() for _ in range(request["lanes"])]

    def populate(self) -> None:
        """Put vehicles all along every lane."""
        for lane in range(self.request["lanes"]):
            place = _ENTRY_M + self._gap()
            while place < self.request["length_m"] - 10.0:
                kind = self._kind(lane)
                place += FLEET[kind].length
                self._add(kind, lane, place, self._speed(kind, lane))
                place += self._gap()

    def replenish(self) -> None:
        """Let a vehicle in at the upstream end of a lane where there is room.

        With SUMO's own insertion checks off (they starve a populated road), entering
        vehicles would pile into each other without this guard.
        """
        present = set(libsumo.vehicle.getIDList())
        for lane in range(self.request["lanes"]):
            leader = self.last.get(lane)
            if leader is None or leader not in present:
                leader = self._last_on(lane)
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

    def _last_on(self, lane: int) -> str | None:
        names = libsumo.lane.getLastStepVehicleIDs(f"{self.side}_{lane}")
        return names[0] if names else None

    def _gap(self) -> float:
        density = self.request["density_per_km_lane"]
        if density <= 0:
            return float("inf")
        return 30.0 + float(self.rng.exponential(max(1000.0 / density - 36.0, 1.0)))

    def _kind(self, lane: int) -> Any:
        lanes = self.request["lanes"]
        mix = {
            kind: weight
            for kind, weight in self.request["mix"].items()
            if FLEET[kind].is_light or lanes < 3 or lane < lanes - 1
        } or self.request["mix"]
        weights = np.array(list(mix.values()), dtype=np.float64)
        total = weights.sum()
        if total <= 0:
            return "car"
        return list(mix)[int(self.rng.choice(len(weights), p=weights / total))]

    def _speed(self, kind: Any, lane: int) -> float:
        build = FLEET[kind]
        limit = self.request["speed_limit_mps"]
        share = build.speed_factor - 0.08 + 0.06 * lane
        return float(min(limit * share, build.max_speed - 1.0))

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


def _place(request: dict[str, Any]) -> None:
    """Clear room for the story's own vehicles and put them in."""
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
        _insert(
            actor["name"],
            "near",
            f"{actor['kind']}.actor",
            actor["lane"],
            actor["front_m"],
            actor["speed_mps"],
        )


def _record(
    request: dict[str, Any], carriageways: list[_Carriageway]
) -> dict[str, Any]:
    """Step through the story and write down every vehicle at every step."""
    steps = round(request["duration_s"] / STEP_S) + 2
    rows: list[tuple[int, int, float, float]] = []
    index: dict[str, int] = {}
    collisions = np.zeros(steps, dtype=np.int64)
    script = _Script(request["actors"])
    for step in range(steps):
        script.play(step * STEP_S)
        present = libsumo.vehicle.getIDList()
        for name in present:
            number = index.setdefault(name, len(index))
            lane = libsumo.vehicle.getLaneIndex(name)
            offset = libsumo.vehicle.getLateralLanePosition(name)
            place = libsumo.vehicle.getLanePosition(name)
            rows.append((step, number, place, lane + offset / request["lane_width_m"]))
        if "target" not in present:
            break  # the story is over; the caller says why
        if step < steps - 1:
            _advance(carriageways)
            collisions[step] = libsumo.simulation.getCollidingVehiclesNumber()
    table = np.array(rows, dtype=np.float64)
    at = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)
    front = np.full((steps, len(index)), np.nan)
    lanes = np.full((steps, len(index)), np.nan)
    front[at], lanes[at] = table[:, 2], table[:, 3]
    names = np.array(list(index))
    return {"names": names, "front": front, "lane": lanes, "collisions": collisions}


class _Script:
    """What the story's own vehicles are told, and when."""

    def __init__(self, actors: list[dict[str, Any]]) -> None:
        orders = [
            (move["at_s"], actor["name"], move)
            for actor in actors
            for move in actor["manoeuvres"]
        ]
        self.pending = sorted(orders, key=lambda order: order[:2])
        self.ramps: dict[str, list[float]] = {}
        for actor in actors:
            libsumo.vehicle.setLaneChangeMode(actor["name"], _TOLD_CHANGES_ONLY)
            libsumo.vehicle.setSpeed(actor["name"], actor["speed_mps"])

    def play(self, now_s: float) -> None:
        """Give the orders that are due."""
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
    """Return the speeds of the next steps; told at once, SUMO brakes its hardest."""
    now = libsumo.vehicle.getSpeed(name)
    count = max(1, math.ceil(abs(goal_mps - now) / _COMFORTABLE / STEP_S))
    return [now + (goal_mps - now) * (n + 1) / count for n in range(count)]


def _command(request: dict[str, Any], network: str, types: str) -> list[str]:
    options = {
        "--net-file": network,
        "--route-files": types,
        "--step-length": STEP_S,
        "--step-method.ballistic": "true",
        "--seed": request["seed"] % 2**31,
        "--default.action-step-length": 0.2,
        "--lanechange.duration": request["lane_change_s"],
        "--insertion-checks": "none",
        "--eager-insert": "true",
        "--collision.action": "warn",
        "--time-to-teleport": -1,
        "--xml-validation": "never",
    }
    flags = ["--no-step-log", "--no-warnings", "--duration-log.disable"]
    pairs = [str(part) for option in options.items() for part in option]
    return ["sumo", *pairs, *flags]


if __name__ == "__main__":
    sys.exit(main())
