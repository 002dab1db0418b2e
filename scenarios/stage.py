"""Simulated scenario instance: line, trajectories, occluders and camera path."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simbench.core.camera import Camera
from simbench.core.trajectories import Trajectories
from simbench.scenarios.ball.simulate import simulate_balls
from simbench.scenarios.camera_path import camera_path
from simbench.scenarios.geometry.line import Line
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.highway.simulate import simulate
from simbench.scenarios.network.shapes import Network
from simbench.scenarios.network.simulate import simulate_network
from simbench.scenarios.occluders import PlacedOccluder, place_occluders
from simbench.scenarios.schema import Floor, Scenario, SumoRoad
from simbench.scenarios.schema.seeds import generator

__all__ = ["Stage", "build_stage"]

_PER_FRAME = ("times", "positions", "headings", "pitches", "speeds", "lanes")
"""Arrays of `Trajectories` with one row a frame."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A scenario simulated with one seed, ready to be rendered.

    Attributes
    ----------
    scenario : Scenario
    seed : int
    line : Line
        Reference of the scenario's road coordinates.
    trajectories : Trajectories
        At the T times of the kept frames.
    cameras : tuple of T Camera
        Those of the camera that films.
    occluders : tuple of PlacedOccluder
    network : Network or None
        The SUMO network, in its own coordinates: the origin of the road frame is
        ``line.map_origin``.
    paths : tuple of (tuple of T Camera)
        Those of all cameras of a scenario that has several, the first one first.
    """

    scenario: Scenario
    seed: int
    line: Line
    trajectories: Trajectories
    cameras: tuple[Camera, ...]
    occluders: tuple[PlacedOccluder, ...]
    network: Network | None = None
    paths: tuple[tuple[Camera, ...], ...] = ()

    @property
    def all_paths(self) -> tuple[tuple[Camera, ...], ...]:
        """Cameras of all frames, for each of the scenario's cameras."""
        return self.paths or (self.cameras,)

    def filmed_from(self, camera: int) -> Stage:
        """Return the same stage, filmed by ``camera``, 0 being the first."""
        scenario = self.scenario.filmed_from(camera)
        return replace(self, scenario=scenario, cameras=self.all_paths[camera])

    def scenery_rng(self, number: int = 0) -> np.random.Generator:
        """Return the generator of the roadside, or of one occluder from 1.

        An attempt with new traffic has a new roadside too: a tree that hides the
        target where the track starts does not stay.
        """
        redraws = self.trajectories.traffic_redraws
        more = (number, redraws) if redraws else (number,) if number else ()
        return generator(self.scenario, self.seed, "scenery", *more)

    def with_frames(self, frames: slice | list[int]) -> Stage:
        """Return a copy that has only the given frames."""
        whole = self.trajectories
        rows = {name: getattr(whole, name)[frames] for name in _PER_FRAME}
        indices = (
            range(len(whole.times))[frames] if isinstance(frames, slice) else frames
        )
        paths = tuple(tuple(path[index] for index in indices) for path in self.paths)
        return replace(
            self,
            trajectories=replace(whole, **rows),
            cameras=tuple(self.cameras[index] for index in indices),
            paths=paths,
        )


def build_stage(scenario: Scenario, seed: int, *, skip: int = 0) -> Stage:
    """Simulate the traffic and place cameras and occluders.

    Occluders on the line of sight are on that of the first camera.

    Parameters
    ----------
    scenario : Scenario
        Of one whose file has samples, the one of the seed is simulated.
    seed : int
        Seed of the run, at least 0.
    skip : int
        Traffic attempts to skip because they were rejected later.

    Raises
    ------
    ScenarioError
        If the camera or an occluder cannot be placed.
    TrafficError
        If no plausible traffic was found.
    """
    scenario = scenario.for_seed(seed)
    line, trajectories, network = _simulated(scenario, seed, skip)
    paths = []
    for number in range(1 + len(scenario.cameras)):
        own = scenario.filmed_from(number)
        rng = generator(own, seed, "vibration")
        paths.append(camera_path(own, line, trajectories, rng))
    occluders = place_occluders(scenario, line, trajectories, paths[0])
    return Stage(
        scenario,
        seed,
        line,
        trajectories,
        paths[scenario.filmed_by],
        occluders,
        network,
        tuple(paths),
    )


def _simulated(
    scenario: Scenario, seed: int, skip: int
) -> tuple[Line, Trajectories, Network | None]:
    """Return reference line, trajectories and, if there is one, SUMO network."""
    if isinstance(scenario.road, Floor):
        plan = scenario.road.floor
        reach = plan.length_m + plan.width_m + 1000.0
        return Line.straight(reach), simulate_balls(scenario, seed, skip=skip), None
    if isinstance(scenario.road, SumoRoad):
        drive = simulate_network(scenario, seed, skip=skip)
        return drive.line, drive.trajectories, drive.network
    line = RoadLine.from_road(scenario.carriageway)
    return line, simulate(scenario, line, seed, skip=skip), None
