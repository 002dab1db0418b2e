"""SUMO on a user's network, in a process of its own: request in, recording out.

``python -m simbench.scenarios.network.sumo_process FILE`` reads a request (JSON) from
standard input and writes a recording (NPZ) to FILE; see `simbench.scenarios.run_sumo`.
"""

from __future__ import annotations

import json
import os
from typing import Any

import libsumo
import numpy as np

from simbench.core.errors import TrafficError
from simbench.scenarios.highway.sumo_process import answer_request, main, sumo_command
from simbench.scenarios.time_step import STEP_S

__all__ = ["answer_request", "simulate"]

_MOST_ROWS = 5_000_000  # of 80 bytes
_DEFAULT_COLOUR = (255, 255, 0)  # SUMO's yellow where no colour is given
_COLUMNS = "step vehicle lane x y z angle slope along aside".split()


def simulate(request: dict[str, Any]) -> dict[str, Any]:
    """Simulate a request, see `simbench.scenarios.network.simulate`."""
    os.chdir(request["folder"])
    options = {
        "collision.action": "warn",
        "time-to-teleport": "-1",  # vehicles must not jump
        **request["options"],
    }
    if "lateral-resolution" not in options:
        options.setdefault("lanechange.duration", request["lane_change_s"])
    libsumo.start(sumo_command(options, request["seed"]))
    try:
        return _record(request)
    finally:
        libsumo.close()


def _record(request: dict[str, Any]) -> dict[str, Any]:
    """Step until the end or until no vehicle is left, and record every vehicle."""
    vehicles: dict[str, int] = {}
    looks = []
    lanes: dict[str, int] = {}
    table = []
    recorded = 0
    steps = round(request["duration_s"] / STEP_S) + 2
    for step in range(steps):
        libsumo.simulationStep()
        rows = []
        for name in libsumo.vehicle.getIDList():
            lane = libsumo.vehicle.getLaneID(name)
            if not lane:
                continue  # SUMO is moving it from one place to another
            if name not in vehicles:
                vehicles[name] = len(vehicles)
                looks.append(_looks(name))
            rows.append(
                (
                    step,
                    vehicles[name],
                    lanes.setdefault(lane, len(lanes)),
                    *libsumo.vehicle.getPosition3D(name),
                    libsumo.vehicle.getAngle(name),
                    libsumo.vehicle.getSlope(name),
                    libsumo.vehicle.getLanePosition(name),
                    libsumo.vehicle.getLateralLanePosition(name),
                )
            )
        recorded += len(rows)
        if recorded > _MOST_ROWS:
            raise TrafficError(
                f"expected at most {_MOST_ROWS} positions of vehicles, got more in "
                f"{step * STEP_S:.0f} s of {request['duration_s']:.0f} s: shorten the "
                "search (road.search_s) or the sequence, or thin the traffic"
            )
        table.append(np.array(rows, dtype=np.float64).reshape(-1, len(_COLUMNS)))
        if not rows and libsumo.simulation.getMinExpectedNumber() == 0:
            break
    columns = dict(zip(_COLUMNS, np.concatenate(table).T, strict=True))
    return columns | {
        "steps": len(table),
        "names": np.array(list(vehicles), dtype=np.str_),
        "lanes": np.array(list(lanes), dtype=np.str_),
        "looks": np.array(json.dumps(looks)),
    }


def _looks(name: str) -> dict[str, Any]:
    """Return a vehicle's constant properties; the colour is null if none is set."""
    kind = libsumo.vehicle.getTypeID(name)
    colours = [libsumo.vehicle.getColor(name), libsumo.vehicletype.getColor(kind)]
    own = [list(c[:3]) for c in colours if tuple(c[:3]) != _DEFAULT_COLOUR]
    return {
        "vehicle_class": libsumo.vehicle.getVehicleClass(name),
        "shape": libsumo.vehicle.getShapeClass(name),
        "length": libsumo.vehicle.getLength(name),
        "width": libsumo.vehicle.getWidth(name),
        "height": libsumo.vehicle.getHeight(name),
        "colour": own[0] if own else None,
    }


if __name__ == "__main__":
    main(simulate)
