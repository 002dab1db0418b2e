"""The rehearsal: how much of the target is hidden, without filming the whole picture.

Only a window around the target is drawn, in few samples and without shadows: a
hundredth of the work of a frame, and within a hundredth of its hidden share.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import ScenarioError
from simbench.core.trajectories import Vehicle
from simbench.render.gl.pyrender_camera import PyrenderCamera
from simbench.render.truth import amodal_boxes
from simbench.render.world.mesh import Mesh, box, merge
from simbench.render.world.occluders import occluder_body
from simbench.render.world.scene import FIRST_VEHICLE_ID, build_scene, vehicle_poses
from simbench.render.world.vehicles import body
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.occluders import PlacedOccluder, place_occluders
from simbench.scenarios.schema import Occluder, Scenario
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = ["OcclusionProbe", "TargetCover", "target_boxes", "unseen"]

_WINDOW = 96
"""Samples along each side of the window: a hidden share is exact to about 1 %."""


@dataclass(frozen=True, slots=True)
class TargetCover:
    """What of the target is hidden in one frame.

    Attributes
    ----------
    alone : (N, N) bool
        Samples that the target would cover.
    hidden : (N, N) bool
        Those of them that something covers.
    by_traffic, by_stranger : float, in [0, 1]
        Shares of the target that vehicles hide: those of the traffic, and those that
        the story places.
    """

    alone: NDArray[np.bool_]
    hidden: NDArray[np.bool_]
    by_traffic: float
    by_stranger: float


def target_boxes(stage: Stage) -> NDArray[np.float64]:
    """Return the target's amodal boxes over a stage, (T, 4) px; NaN where absent."""
    target = stage.trajectories.target
    boxes = np.full((len(stage.cameras), 4), np.nan)
    for index, camera in enumerate(stage.cameras):
        poses, _ = vehicle_poses(stage.trajectories, index)
        only = np.full_like(poses, np.nan)
        only[target] = poses[target]
        boxes[index] = amodal_boxes(camera, stage.trajectories, only)[target]
    return boxes


def unseen(scenario: Scenario) -> ScenarioError:
    """Return what to say of a story whose target no frame shows."""
    return ScenarioError(
        f"{scenario.name}: the camera does not see the target, so that no dial can be "
        "turned: change camera.look_at, camera.fov_rad or target.along_m"
    )


class OcclusionProbe:
    """Tells what hides the target of a stage: the world as it is, or new occluders.

    The stage's occluders on the line of sight are left out; those on the map stay. Use
    it in a ``with`` statement: it holds what it draws with on the graphics device.

    Parameters
    ----------
    stage : Stage
    """

    def __init__(self, stage: Stage) -> None:
        on_map = tuple(o for o in stage.occluders if o.sight_height is None)
        self.stage = replace(stage, occluders=on_map)
        self.boxes = target_boxes(stage)
        scene = build_scene(self.stage)
        nothing = box((0, 0, -500), (0.1, 0.1, -499.9), (0, 0, 0)).with_id(1)
        self._unlit = replace(scene, light=replace(scene.light, shadows=False))
        self._bare = replace(
            self._unlit, ground=nothing, standing=nothing, distant=nothing
        )
        self._world = PyrenderCamera(self._unlit, _WINDOW, _WINDOW, 1)
        self._trial = PyrenderCamera(self._bare, _WINDOW, _WINDOW, 1)
        self._veils: dict[int, TargetCover] = {}
        told = [v.name.startswith("stranger.") for v in stage.trajectories.vehicles]
        self._strangers = scene.ids[np.array(told, dtype=np.bool_)]

    def __enter__(self) -> Self:
        """Return the rehearsal itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Free what it holds on the graphics device."""
        self._world.close()
        self._trial.close()

    def veil(self, frame: int) -> TargetCover:
        """Tell what the world hides in a frame that shows the target."""
        found = self._veils.get(frame)
        if found is None:
            alone, ids = self._shot(self._world, frame)
            own = self._unlit.ids[self.stage.trajectories.target]
            hidden = alone & (ids != own)
            ours = np.isin(ids, self._strangers)
            shares = [
                float(np.sum(hidden & who) / max(1, alone.sum()))
                for who in ((ids >= FIRST_VEHICLE_ID) & ~ours, ours)
            ]
            found = self._veils[frame] = TargetCover(alone, hidden, *shares)
        return found

    def hidden(
        self, occluders: Sequence[Occluder], frames: Sequence[int], *, first: int = 0
    ) -> NDArray[np.float64]:
        """Return the hidden share of the target, behind new occluders and the world.

        Parameters
        ----------
        occluders : sequence of Occluder
            On the line of sight.
        frames : sequence of F int
            NaN comes back for those that do not show the target.
        first : int
            How many new occluders of the story come before these: each tree has a
            shape of its own.
        """
        shares = np.full(len(frames), np.nan)
        self._trial.load_scene(self._bodies(self.placed(occluders), first))
        for number, frame in enumerate(frames):
            if np.isnan(self.boxes[frame, 0]):
                continue
            world = self.veil(frame)
            _, ids = self._shot(self._trial, frame)
            behind = (ids > 0) & (ids < FIRST_VEHICLE_ID) & world.alone
            covered = np.sum(world.hidden | behind)
            shares[number] = covered / max(1, world.alone.sum())
        return shares

    def hidden_beside(
        self, other: Vehicle, lane: int, ahead_m: NDArray[np.float64], frame: int
    ) -> NDArray[np.float64]:
        """Return the share of the target that another vehicle would hide.

        Parameters
        ----------
        other : Vehicle
        lane : int
            Where it drives, from the right.
        ahead_m : (N,) float, m
            How far its middle is ahead of the target's, along the road.
        frame : int

        Returns
        -------
        (N,) float, in [0, 1]
        """
        stage, target = self.stage, self.stage.trajectories.target
        line = stage.line
        if not isinstance(line, RoadLine):
            raise TypeError("only a carriageway has lanes beside the target")
        poses, _ = vehicle_poses(stage.trajectories, frame)
        along = float(line.locate(poses[target : target + 1, :3, 3])[0, 0])
        bodies = body(stage.trajectories.vehicles[target]), body(other)
        pair = replace(
            self._bare,
            bodies=bodies,
            body_of=np.arange(2),
            paints=np.zeros((2, 3)),
            ids=np.array([FIRST_VEHICLE_ID, 2]),
        )
        window = _window(stage.cameras[frame], self.boxes[frame])
        both = np.stack([poses[target]] * 2)
        shares = np.zeros(len(ahead_m))
        with PyrenderCamera(pair, _WINDOW, _WINDOW, 1) as camera:
            for number, ahead in enumerate(ahead_m):
                there = along + float(ahead)
                turn = float(line.heading_at(there))
                cos, sin = math.cos(turn), math.sin(turn)
                both[1, :3, :3] = [[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]
                both[1, :3, 3] = line.point(there, line.lane_lateral(lane))
                shot = camera.shoot(window, both, np.ones(2, np.bool_), 0)
                covered = shot.target_alone & (shot.ids == 2)
                shares[number] = covered.sum() / max(1, shot.target_alone.sum())
        return shares

    def placed(self, occluders: Sequence[Occluder]) -> tuple[PlacedOccluder, ...]:
        """Return where occluders stand on this stage.

        Raises
        ------
        ScenarioError
            If one cannot stand where it is asked to.
        """
        stage = self.stage
        told = stage.scenario.model_copy(update={"occluders": tuple(occluders)})
        return place_occluders(told, stage.line, stage.trajectories, stage.cameras)

    def _bodies(self, placed: Sequence[PlacedOccluder], first: int) -> Mesh:
        stage, bodies = self.stage, []
        season = stage.scenario.surroundings.season
        for number, occluder in enumerate(placed, start=first):
            # as it will be filmed: occluders on the map are numbered first
            place = len(stage.occluders) + number + 1
            rng = generator(stage.scenario, stage.seed, "scenery", place)
            bodies.append(occluder_body(occluder, stage.line, season, rng).with_id(2))
        return merge(bodies) if bodies else self._bare.standing

    def _shot(
        self, camera: PyrenderCamera, frame: int
    ) -> tuple[NDArray[np.bool_], NDArray[np.uint16]]:
        poses, present = vehicle_poses(self.stage.trajectories, frame)
        window = _window(self.stage.cameras[frame], self.boxes[frame])
        shot = camera.shoot(window, poses, present, self.stage.trajectories.target)
        return shot.target_alone, shot.ids


def _window(camera: Camera, around: NDArray[np.float64]) -> Camera:
    """Look through the same eye at one box of the picture only, stretched to fit."""
    left, top, width, height = around
    scale = np.array([_WINDOW / width, _WINDOW / height])
    matrix = np.eye(3)
    matrix[[0, 1], [0, 1]] = np.diag(camera.matrix)[:2] * scale
    matrix[:2, 2] = (camera.matrix[:2, 2] - [left, top]) * scale
    return Camera(matrix, camera.rotation, camera.translation, _WINDOW, _WINDOW)
