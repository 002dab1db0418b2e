"""A SUMO network of the user's, as a program of its own: request in, recording out.

``python -m simbench.scenarios.network.sumo_process FILE`` reads a request (JSON) from
standard input and writes a recording (NPZ) to FILE; for why it is a child process, see
`simbench.scenarios.highway.sumo_process`.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import libsumo
import numpy as np

from simbench.scenarios.highway.bending import STEP_S
from simbench.scenarios.highway.sumo_process import die_with_parent

__all__ = ["main"]

_UNTOLD = (255, 255, 0)  # SUMO's yellow where no colour is given
_COLUMNS = (
    "step",
    "vehicle",
    "lane",
    "x",
    "y",
    "z",
    "angle",
    "slope",
    "along",
    "aside",
)


def main() -> int:
    """Run one request; 0 on success, 1 after writing why not to standard error."""
    die_with_parent()
    request = json.load(sys.stdin)
    answer = Path(sys.argv[1]).resolve()
    os.chdir(request["folder"])
    try:
        libsumo.start(_command(request))
        try:
            recording = _record(request)
        finally:
            libsumo.close()
    except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
        print(f"Error: {error}", file=sys.stderr)
        return 1
    np.savez(answer, **recording)
    return 0


def _command(request: dict[str, Any]) -> list[str]:
    options = {
        "collision.action": "warn",
        "time-to-teleport": "-1",  # a car that jumps is no drive to film
        **request["options"],
        "step-length": STEP_S,
        "seed": request["seed"] % 2**31,
        "xml-validation": "never",
    }
    if "lateral-resolution" not in options:
        options.setdefault("lanechange.duration", request["lane_change_s"])
    pairs = [
        text for key, value in options.items() for text in (f"--{key}", str(value))
    ]
    return ["sumo", *pairs, "--no-step-log", "--no-warnings", "--duration-log.disable"]


def _record(request: dict[str, Any]) -> dict[str, Any]:
    """Step to the end, or until the last vehicle is gone; write down every vehicle."""
    vehicles: dict[str, int] = {}
    looks = []
    lanes: dict[str, int] = {}
    table = []
    steps = round(request["duration_s"] / STEP_S) + 2
    for step in range(steps):
        libsumo.simulationStep()
        rows = []
        for name in libsumo.vehicle.getIDList():
            lane = libsumo.vehicle.getLaneID(name)
            if not lane:
                continue  # being moved by SUMO from one place to another
            if name not in vehicles:
                vehicles[name] = len(vehicles)
                looks.append(_look(name))
            x, y, z = libsumo.vehicle.getPosition3D(name)
            rows.append(
                (
                    step,
                    vehicles[name],
                    lanes.setdefault(lane, len(lanes)),
                    x,
                    y,
                    z,
                    libsumo.vehicle.getAngle(name),
                    libsumo.vehicle.getSlope(name),
                    libsumo.vehicle.getLanePosition(name),
                    libsumo.vehicle.getLateralLanePosition(name),
                )
            )
        table.append(np.array(rows, dtype=np.float64).reshape(-1, len(_COLUMNS)))
        if not rows and libsumo.simulation.getMinExpectedNumber() == 0:
            break
    rows_of_all = np.concatenate(table)
    columns = {name: rows_of_all[:, n] for n, name in enumerate(_COLUMNS)}
    return columns | {
        "steps": len(table),
        "names": np.array(list(vehicles), dtype=np.str_),
        "lanes": np.array(list(lanes), dtype=np.str_),
        "looks": np.array(json.dumps(looks)),
    }


def _look(name: str) -> dict[str, Any]:
    """Return what does not change about a vehicle; its colour is null if not told."""
    kind = libsumo.vehicle.getTypeID(name)
    colours = [libsumo.vehicle.getColor(name), libsumo.vehicletype.getColor(kind)]
    told = [list(colour[:3]) for colour in colours if tuple(colour[:3]) != _UNTOLD]
    return {
        "vehicle_class": libsumo.vehicle.getVehicleClass(name),
        "shape": libsumo.vehicle.getShapeClass(name),
        "length": libsumo.vehicle.getLength(name),
        "width": libsumo.vehicle.getWidth(name),
        "height": libsumo.vehicle.getHeight(name),
        "colour": told[0] if told else None,
    }


if __name__ == "__main__":
    sys.exit(main())
