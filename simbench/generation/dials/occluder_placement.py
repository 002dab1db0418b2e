"""Where an occluder can stand: on the line of sight, but not on the road."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from simbench.core.errors import ScenarioError
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.geometry.road import RoadLine

__all__ = ["candidate_places"]

_SHARES = (0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1, 0.07, 0.05)
"""Of the way from the camera to the target, in order of preference."""
_BESIDE_M = 0.6
_NEAREST_M = 0.9  # to the camera
_CLEARANCE_M = 4.7  # under a girder, what lorries need


def candidate_places(
    rehearsal: OcclusionProbe, kind: str, frames: Sequence[int]
) -> list[float]:
    """Return how far from the camera an occluder stands, for each of some frames.

    Beside the road, or on it very near to the camera, as on the rail of the bridge
    that the camera stands on; a girder where lorries fit under it.

    Raises
    ------
    ScenarioError
        If a girder is asked for, and no line of sight is high enough.
    """
    return [_distance(rehearsal, kind, frame) for frame in frames]


def _distance(rehearsal: OcclusionProbe, kind: str, frame: int) -> float:
    stage = rehearsal.stage
    eye = stage.cameras[frame].position
    body = stage.trajectories.positions[frame, stage.trajectories.target]
    reach = float(np.linalg.norm(body[:2] - eye[:2]))
    if kind == "gantry" and not isinstance(stage.line, RoadLine):
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion.by: a gantry spans a carriageway: "
            "ask for a pole or a sign"
        )
    vehicle = stage.trajectories.vehicles[stage.trajectories.target]
    before = reach - math.hypot(vehicle.length, vehicle.width) / 2.0
    if before < _NEAREST_M + 0.1:
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion: the camera looks at the target "
            "from straight above, where nothing can stand between them: move "
            "camera.position"
        )
    for share in _SHARES:
        point = eye + (body - eye) * share
        along, lateral = stage.line.locate(point[None])[0]
        ground = float(stage.line.point(along, lateral)[2])
        if kind == "gantry":
            if point[2] - ground >= _CLEARANCE_M:
                return max(_NEAREST_M, share * reach)
        elif not isinstance(stage.line, RoadLine) or (
            abs(lateral) >= stage.line.edge_m + _BESIDE_M
        ):
            return max(_NEAREST_M, share * reach)
    if kind == "gantry":
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion.by: a gantry hides what a camera "
            f"sees from above: raise camera.position.height_m above {_CLEARANCE_M:g} "
            "m, or ask for a pole or a sign"
        )
    return max(_NEAREST_M, _SHARES[-1] * reach)
