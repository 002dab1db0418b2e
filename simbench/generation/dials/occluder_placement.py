"""Placement of an occluder: on the line of sight, but not on the road."""

from __future__ import annotations

import math

import numpy as np

from simbench.core.errors import ScenarioError
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.geometry.road import RoadLine

__all__ = ["occluder_distance"]

_SHARES = (0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1, 0.07, 0.05)
"""Of the distance from the camera to the target, in order of preference."""
_BESIDE_M = 0.6
_NEAREST_M = 0.9  # to the camera
_CLEARANCE_M = 4.7  # under a gantry, for lorries


def occluder_distance(probe: OcclusionProbe, kind: str, frame: int) -> float:
    """Return the distance [m] from the camera of an occluder that hides in a frame.

    Beside the road, or on it very near to the camera, as on the rail of a bridge that
    carries the camera; a gantry where lorries fit under it.

    Raises
    ------
    ScenarioError
        If no line of sight is high enough for a gantry, or the camera is straight
        above the target.
    """
    stage = probe.stage
    target = stage.trajectories.target
    eye = stage.cameras[frame].position
    body = stage.trajectories.positions[frame, target]
    reach = float(np.linalg.norm(body[:2] - eye[:2]))
    if kind == "gantry" and not isinstance(stage.line, RoadLine):
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion.by: a gantry needs a carriageway: "
            "ask for a pole or a sign"
        )
    vehicle = stage.trajectories.vehicles[target]
    if reach - math.hypot(vehicle.length, vehicle.width) / 2.0 < _NEAREST_M + 0.1:
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion: the camera looks at the target "
            "from straight above, where no occluder fits between them: move "
            "camera.position"
        )
    for share in _SHARES:
        point = eye + (body - eye) * share
        along, lateral = stage.line.locate(point[None])[0]
        if kind == "gantry":
            fits = point[2] - stage.line.point(along, lateral)[2] >= _CLEARANCE_M
        else:
            fits = not isinstance(stage.line, RoadLine) or (
                abs(lateral) >= stage.line.edge_m + _BESIDE_M
            )
        if fits:
            break
    if kind == "gantry" and not fits:
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion.by: a gantry hides what a camera "
            f"sees from above: raise camera.position.height_m above {_CLEARANCE_M:g} "
            "m, or ask for a pole or a sign"
        )
    return max(_NEAREST_M, share * reach)
