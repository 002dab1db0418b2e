"""The files that SUMO reads: a straight road and the types of its vehicles."""

from __future__ import annotations

from typing import Any

from simbench.scenarios.highway.fleet import FLEET
from simbench.scenarios.time_step import STEP_S

__all__ = ["network_xml", "sides_of", "types_xml"]

_SUMO_CLASSES = {"car": "passenger", "suv": "passenger", "van": "delivery"}
"""SUMO's ``vClass`` where it is not called like ours."""


def sides_of(request: dict[str, Any]) -> list[str]:
    """Return the carriageways: the near one, and the far one where it has traffic."""
    return ["near", "far"] if request["opposite"] else ["near"]


def network_xml(request: dict[str, Any]) -> str:
    """Return the network: one straight edge a direction, ends without junctions.

    SUMO crashes on a network without the version attribute.
    """
    parts = ['<net version="1.20">']
    length, width = request["length_m"], request["lane_width_m"]
    for number, side in enumerate(sides_of(request)):
        base = 1000.0 * number
        lanes = [f"{side}_{lane}" for lane in range(request["lanes"])]
        parts.append(f'<edge id="{side}" from="{side}.a" to="{side}.b">')
        for lane, name in enumerate(lanes):
            y = base + lane * width
            parts.append(
                f'<lane id="{name}" index="{lane}" width="{width}" length="{length}" '
                f'speed="{request["speed_limit_mps"]}" shape="0,{y} {length},{y}"/>'
            )
        parts.append("</edge>")
        for end, x, incoming in (("a", 0.0, ""), ("b", length, " ".join(lanes))):
            parts.append(
                f'<junction id="{side}.{end}" type="dead_end" x="{x}" y="{base}" '
                f'incLanes="{incoming}" intLanes=""/>'
            )
    return "".join([*parts, "</net>"])


def types_xml(request: dict[str, Any]) -> str:
    """Return vehicle types and routes; scripted vehicles (actors) have own types."""
    parts = ["<routes>"]
    for kind, model in FLEET.items():
        common = (
            f'vClass="{_SUMO_CLASSES.get(kind, kind)}" length="{model.length}" '
            f'width="{model.width}" height="{model.height}" accel="{model.accel}" '
            f'decel="{model.decel}" sigma="0" '
        )
        parts.append(
            f'<vType id="{kind}" {common} maxSpeed="{model.max_speed}" '
            f'speedFactor="normc({model.speed_factor},0.08,0.6,1.2)" '
            f'lcSpeedGain="{3 * request["overtaking"]:g}" '
            f'lcKeepRight="0.4" lcAssertive="1.5"/>'
        )
        parts.append(
            f'<vType id="{kind}.actor" {common} maxSpeed="80" '
            f'speedFactor="2" speedDev="0" actionStepLength="{STEP_S}"/>'
        )
    parts += [f'<route id="{side}" edges="{side}"/>' for side in sides_of(request)]
    return "".join([*parts, "</routes>"])
