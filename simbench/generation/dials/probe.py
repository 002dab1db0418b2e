"""Occlusion probe: how much of the target is hidden, without rendering the frames.

Only a window around the target is rendered, in few samples and without shadows: a
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
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.truth import amodal_boxes
from simbench.render.world.mesh import Mesh, box, merge
from simbench.render.world.occluder_meshes import occluder_mesh
from simbench.render.world.projection import clip_matrix, covering_window
from simbench.render.world.scene import FIRST_VEHICLE_ID, build_scene, vehicle_poses
from simbench.render.world.vehicles import body
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.occluders import PlacedOccluder, place_occluders
from simbench.scenarios.schema import Occluder, Scenario
from simbench.scenarios.stage import Stage

__all__ = ["FrameOcclusion", "OcclusionProbe", "target_boxes", "target_not_visible"]

_WINDOW = 96
"""Samples along each side of the window: a hidden share is exact to about 1 %."""
_CORNERS = np.indices((2, 2, 2)).reshape(3, 8).T
"""Of a box: which end of each axis."""


@dataclass(frozen=True, slots=True)
class FrameOcclusion:
    """The part of the target that the scene hides in one frame.

    Attributes
    ----------
    target : (N, N) bool
        Samples that the unoccluded target covers.
    hidden : (N, N) bool
        Those of them that something hides.
    by_traffic, by_scripted : float, in [0, 1]
        Shares of the target that surrounding traffic and scripted vehicles hide.
    """

    target: NDArray[np.bool_]
    hidden: NDArray[np.bool_]
    by_traffic: float
    by_scripted: float


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


def target_not_visible(scenario: Scenario) -> ScenarioError:
    """Return the error of a scenario whose target is in no frame."""
    return ScenarioError(
        f"{scenario.name}: the camera does not see the target, so that no dial can be "
        "reached: change camera.look_at, camera.fov_rad or target.along_m"
    )


class OcclusionProbe:
    """Measures what hides the target of a stage: its scene, or new occluders.

    The stage's occluders on the line of sight are left out; those on the map stay. Use
    it in a ``with`` statement: it holds resources of the graphics device.

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
            self._unlit, ground=nothing, static_objects=nothing, distant=nothing
        )
        self._scene_camera = SceneRenderer(self._unlit, _WINDOW, _WINDOW, 1)
        self._trial_camera = SceneRenderer(self._bare, _WINDOW, _WINDOW, 1)
        self._frames: dict[int, FrameOcclusion] = {}
        names = [vehicle.name for vehicle in stage.trajectories.vehicles]
        scripted = np.array([name.startswith("stranger.") for name in names])
        self._scripted_ids = scene.ids[scripted]

    def __enter__(self) -> Self:
        """Return the probe itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Free the resources of the graphics device."""
        self._scene_camera.close()
        self._trial_camera.close()

    @property
    def shown(self) -> NDArray[np.intp]:
        """Frames that show the target."""
        return np.flatnonzero(~np.isnan(self.boxes[:, 0]))

    def frame_occlusion(self, frame: int) -> FrameOcclusion:
        """Return what the scene hides in a frame that shows the target."""
        if frame not in self._frames:
            ids = self._ids(self._scene_camera, frame)
            target = self._target_alone(self._scene_camera, frame)
            own = self._unlit.ids[self.stage.trajectories.target]
            hidden = target & (ids != own)
            scripted = np.isin(ids, self._scripted_ids)
            shares = [
                float(np.sum(hidden & by) / max(1, target.sum()))
                for by in ((ids >= FIRST_VEHICLE_ID) & ~scripted, scripted)
            ]
            self._frames[frame] = FrameOcclusion(target, hidden, *shares)
        return self._frames[frame]

    def hidden(
        self, occluders: Sequence[Occluder], frames: Sequence[int], *, first: int = 0
    ) -> NDArray[np.float64]:
        """Return the hidden share of the target, behind new occluders and the scene.

        Parameters
        ----------
        occluders : sequence of Occluder
            On the line of sight.
        frames : sequence of F int
        first : int
            Index of the first occluder among all new ones: each tree has its own shape.

        Returns
        -------
        (F,) float, in [0, 1]
            NaN in frames that do not show the target.
        """
        shares = np.full(len(frames), np.nan)
        meshes = self._bodies(self.placed(occluders), first)
        whole = merge(meshes) if meshes else self._bare.static_objects
        self._trial_camera.replace_static_objects(whole)
        for number, frame in enumerate(frames):
            if np.isnan(self.boxes[frame, 0]):
                continue
            scene = self.frame_occlusion(frame)
            covered = scene.hidden
            if self._may_hide(meshes, frame):
                ids = self._ids(self._trial_camera, frame)
                behind = (ids > 0) & (ids < FIRST_VEHICLE_ID) & scene.target
                covered = scene.hidden | behind
            shares[number] = covered.sum() / max(1, scene.target.sum())
        return shares

    def hidden_by_vehicle(
        self, other: Vehicle, lane: int, ahead_m: NDArray[np.float64], frame: int
    ) -> NDArray[np.float64]:
        """Return the share of the target that another vehicle would hide.

        Parameters
        ----------
        other : Vehicle
        lane : int
            From the right.
        ahead_m : (N,) float, m
            Distance of its middle ahead of the target's, along the road.
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
            simple_bodies=bodies,
            heights=np.array([bodies[0].positions[:, 2].max(), other.height]),
            body_of=np.arange(2),
            paints=np.zeros((2, 3)),
            ids=np.array([FIRST_VEHICLE_ID, 2]),
        )
        view, present = self._view(frame), np.ones(2, np.bool_)
        both = np.stack([poses[target]] * 2)
        shares = np.zeros(len(ahead_m))
        with SceneRenderer(pair, _WINDOW, _WINDOW, 1) as camera:
            alone = camera.silhouette(view, both, np.zeros(1, np.int64))
            for number, ahead in enumerate(ahead_m):
                place = along + float(ahead)
                turn = float(line.heading_at(place))
                cos, sin = math.cos(turn), math.sin(turn)
                both[1, :3, :3] = [[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]
                both[1, :3, 3] = line.point(place, line.lane_lateral(lane))
                covered = alone & (camera.render_ids(view, both, present) == 2)
                shares[number] = covered.sum() / max(1, alone.sum())
        return shares

    def placed(self, occluders: Sequence[Occluder]) -> tuple[PlacedOccluder, ...]:
        """Return occluders with their places on this stage.

        Raises
        ------
        ScenarioError
            If one has no valid place.
        """
        stage = self.stage
        scenario = stage.scenario.model_copy(update={"occluders": tuple(occluders)})
        return place_occluders(scenario, stage.line, stage.trajectories, stage.cameras)

    def _may_hide(self, meshes: Sequence[Mesh], frame: int) -> bool:
        """Whether any of some meshes may cover a sample of the window of a frame."""
        clip = clip_matrix(self._view(frame))
        for mesh in meshes:
            ends = np.stack([mesh.positions.min(axis=0), mesh.positions.max(axis=0)])
            corners = ends.astype(np.float64)[_CORNERS, np.arange(3)]
            left, top, right, bottom = covering_window(clip, corners, _WINDOW, _WINDOW)
            if left < right and top < bottom:
                return True
        return False

    def _bodies(self, placed: Sequence[PlacedOccluder], first: int) -> list[Mesh]:
        stage, bodies = self.stage, []
        season = stage.scenario.surroundings.season
        for number, occluder in enumerate(placed, start=first):
            # as it will be rendered: occluders on the map are numbered first
            index = len(stage.occluders) + number + 1
            rng = stage.scenery_rng(index)
            bodies.append(occluder_mesh(occluder, stage.line, season, rng).with_id(2))
        return bodies

    def _ids(self, camera: SceneRenderer, frame: int) -> NDArray[np.uint16]:
        """Return the ids in the window of a frame that shows the target."""
        poses, present = vehicle_poses(self.stage.trajectories, frame)
        return camera.render_ids(self._view(frame), poses, present)

    def _target_alone(self, camera: SceneRenderer, frame: int) -> NDArray[np.bool_]:
        """Return the samples that the unoccluded target covers in that window."""
        poses, _ = vehicle_poses(self.stage.trajectories, frame)
        target = np.array([self.stage.trajectories.target])
        return camera.silhouette(self._view(frame), poses, target)

    def _view(self, frame: int) -> Camera:
        return _window(self.stage.cameras[frame], self.boxes[frame])


def _window(camera: Camera, around: NDArray[np.float64]) -> Camera:
    """Return a camera that shows one box of the picture, stretched to the window."""
    left, top, width, height = around
    scale = np.array([_WINDOW / width, _WINDOW / height])
    matrix = np.eye(3)
    matrix[[0, 1], [0, 1]] = np.diag(camera.matrix)[:2] * scale
    matrix[:2, 2] = (camera.matrix[:2, 2] - [left, top]) * scale
    return Camera(matrix, camera.rotation, camera.translation, _WINDOW, _WINDOW)
