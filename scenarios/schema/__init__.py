"""The scenario file: what may stand in the YAML, with units, ranges and defaults.

Places are given in road coordinates: ``along_m`` runs with the traffic, 0 where the
camera's story begins; ``lateral_m`` is the distance to the left of the median's middle
(so the carriageway of the target, which drives on the right, is negative);
``height_m`` is above the road surface there.
"""

from simbench.scenarios.schema.dials import Dials, Occlusion
from simbench.scenarios.schema.light import Light
from simbench.scenarios.schema.road import Place, Road, Section
from simbench.scenarios.schema.scenario import Scenario, Seeds
from simbench.scenarios.schema.scenery import Occluder, Surroundings
from simbench.scenarios.schema.traffic import (
    Manoeuvre,
    Stranger,
    Target,
    Traffic,
    told_lanes,
)
from simbench.scenarios.schema.view import Camera, Imaging

__all__ = [
    "Camera",
    "Dials",
    "Imaging",
    "Light",
    "Manoeuvre",
    "Occluder",
    "Occlusion",
    "Place",
    "Road",
    "Scenario",
    "Section",
    "Seeds",
    "Stranger",
    "Surroundings",
    "Target",
    "Traffic",
    "told_lanes",
]
