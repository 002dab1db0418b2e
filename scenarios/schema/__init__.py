"""Schema of scenario files: keys with units, ranges and defaults.

Places are in road coordinates: ``along_m`` is the arc length in the direction of
traffic, 0 at the scenario's origin; ``lateral_m`` is the distance to the left of the
median's middle (so the carriageway of the target, which drives on the right, is
negative); ``height_m`` is above the road surface. On a floor ``along_m`` is 0 at one
end and ``lateral_m`` in the middle; on a SUMO network both follow the target's path,
0 at its place in frame 0, and places may be given in the network's ``x_m``, ``y_m``.
"""

from simbench.scenarios.schema.ball import Ball, Kick
from simbench.scenarios.schema.dials import DIAL_NAMES, Dials, Distractors, Occlusion
from simbench.scenarios.schema.light import Light
from simbench.scenarios.schema.road import (
    Floor,
    FloorPlan,
    Place,
    Road,
    RoadSection,
    SumoRoad,
)
from simbench.scenarios.schema.scenario import Mirror, Scenario, Seeds
from simbench.scenarios.schema.scenery import Occluder, Surroundings, Tunnel
from simbench.scenarios.schema.traffic import (
    LaneChanges,
    Manoeuvre,
    ScriptedVehicle,
    Target,
    TargetRule,
    Traffic,
    scripted_lanes,
)
from simbench.scenarios.schema.view import CameraSettings, Imaging

__all__ = [
    "DIAL_NAMES",
    "Ball",
    "CameraSettings",
    "Dials",
    "Distractors",
    "Floor",
    "FloorPlan",
    "Imaging",
    "Kick",
    "LaneChanges",
    "Light",
    "Manoeuvre",
    "Mirror",
    "Occluder",
    "Occlusion",
    "Place",
    "Road",
    "RoadSection",
    "Scenario",
    "ScriptedVehicle",
    "Seeds",
    "SumoRoad",
    "Surroundings",
    "Target",
    "TargetRule",
    "Traffic",
    "Tunnel",
    "scripted_lanes",
]
