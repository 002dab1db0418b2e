"""The files that SUMO reads: a straight road and the vehicles that may use it."""

from __future__ import annotations

from typing import Any

from simbench.scenarios.highway.bending import STEP_S
from simbench.scenarios.highway.fleet import FLEET

__all__ = ["network_xml", "types_xml"]


def network_xml(request: dict[str, Any]) -> str:
    """Return the network: one straight edge a direction, ends without junctions.

    Written by hand; SUMO crashes on a network without the version attribute.
    """
    sides = ["near", "far"] if request["opposite"] else ["near"]
    parts = ['<net version="1.20">']
    length, width = request["length_m"], request["lane_width_m"]
    for number, side in enumerate(sides):
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
    """Return vehicle types and routes; the story's own vehicles have types apart."""
    classes = {
        "van": "delivery",
        "truck": "truck",
        "trailer": "trailer",
        "bus": "bus",
        "motorcycle": "motorcycle",
    }
    parts = ["<routes>"]
    for kind, build in FLEET.items():
        common = (
            f'vClass="{classes.get(kind, "passenger")}" length="{build.length}" '
            f'width="{build.width}" height="{build.height}" accel="{build.accel}" '
            f'decel="{build.decel}" sigma="0" '
        )
        parts.append(
            f'<vType id="{kind}" {common} maxSpeed="{build.max_speed}" '
            f'speedFactor="normc({build.speed_factor},0.08,0.6,1.2)" '
            f'lcSpeedGain="3" lcKeepRight="0.4" lcAssertive="1.5"/>'
        )
        parts.append(
            f'<vType id="{kind}.actor" {common} maxSpeed="80" '
            f'speedFactor="2" speedDev="0" actionStepLength="{STEP_S}"/>'
        )
    sides = ["near", "far"] if request["opposite"] else ["near"]
    parts += [f'<route id="{side}" edges="{side}"/>' for side in sides]
    return "".join([*parts, "</routes>"])
