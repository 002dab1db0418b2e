"""The scenario file: what may stand in the YAML, with units, ranges and defaults.

Places are given in road coordinates: ``along_m`` runs with the traffic, 0 where the
camera's story begins; ``lateral_m`` is the distance to the left of the median's middle
(so the carriageway of the target, which drives on the right, is negative);
``height_m`` is above the road surface there. On a floor ``along_m`` begins at one end
and ``lateral_m`` in the middle; on a SUMO network both follow the target's own way, 0
where it is in frame 0, and places may be told in the network's ``x_m`` and ``y_m``.
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
from simbench.scenarios.schema.scenario import Scenario, Seeds
from simbench.scenarios.schema.scenery import Occluder, Surroundings, Tunnel
from simbench.scenarios.schema.traffic import (
    Choice,
    Manoeuvre,
    Stranger,
    Target,
    Traffic,
    scripted_lanes,
)
from simbench.scenarios.schema.view import CameraSettings, Imaging

__all__ = [
    "DIAL_NAMES",
    "Ball",
    "CameraSettings",
    "Choice",
    "Dials",
    "Distractors",
    "Floor",
    "FloorPlan",
    "Imaging",
    "Kick",
    "Light",
    "Manoeuvre",
    "Occluder",
    "Occlusion",
    "Place",
    "Road",
    "RoadSection",
    "Scenario",
    "Seeds",
    "Stranger",
    "SumoRoad",
    "Surroundings",
    "Target",
    "Traffic",
    "Tunnel",
    "scripted_lanes",
]
