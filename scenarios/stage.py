"""Everything the camera needs to film: road, trajectories, occluders, camera path."""

from __future__ import annotations

from dataclasses import dataclass

from simbench.camera import Camera
from simbench.scenarios.occluders import PlacedOccluder, place_occluders
from simbench.scenarios.road import RoadLine
from simbench.scenarios.schema import Scenario
from simbench.scenarios.seeds import generator
from simbench.scenarios.simulation import simulate
from simbench.scenarios.views import camera_path
from simbench.trajectories import Trajectories

__all__ = ["Stage", "set_stage"]


@dataclass(frozen=True, slots=True)
class Stage:
    """A scenario brought to life with one seed, ready to be filmed.

    Attributes
    ----------
    scenario : Scenario
    seed : int
    line : RoadLine
    trajectories : Trajectories
        At the T times of the kept frames.
    cameras : tuple of T Camera
    occluders : tuple of PlacedOccluder
    """

    scenario: Scenario
    seed: int
    line: RoadLine
    trajectories: Trajectories
    cameras: tuple[Camera, ...]
    occluders: tuple[PlacedOccluder, ...]


def set_stage(scenario: Scenario, seed: int, *, skip: int = 0) -> Stage:
    """Simulate the traffic and place camera and occluders.

    Parameters
    ----------
    scenario : Scenario
    seed : int
        Seed of the run, at least 0.
    skip : int
        Draws of the traffic to pass over because they were found unfit later.

    Raises
    ------
    ScenarioError
        If the camera or an occluder cannot be placed.
    TrafficError
        If no plausible traffic was found.
    """
    line = RoadLine.from_road(scenario.road)
    trajectories = simulate(scenario, line, seed, skip=skip)
    rng = generator(scenario, seed, "vibration")
    cameras = camera_path(scenario, line, trajectories, rng)
    occluders = place_occluders(scenario, line, trajectories, cameras)
    return Stage(scenario, seed, line, trajectories, cameras, occluders)
