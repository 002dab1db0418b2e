"""Rays through the samples of a camera, cast with Embree at the meshes of a scene.

Independent of the renderer: of it only the meshes and the poses are used. Rays follow
from the camera model alone, and Embree shares nothing with OpenGL. A point ``X`` has
the camera coordinates ``R @ X + t``, and the ray of the image position ``(u, v)``, in
continuous pixels from the outer corner of the top-left pixel, the direction
``K^-1 @ (u, v, 1)`` there. Its third part is 1, so that the distance along the ray is
the depth along the optical axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.render.world.scene import Scene

__all__ = ["CastFrame", "RayCaster", "require_embree"]

_NEAREST_M, _FARTHEST_M = 0.4, 2500.0  # what the camera shows at all
_MOST_RAYS: Final = 2**19  # cast together: some 40 bytes each


def require_embree() -> None:
    """Require Embree's Python binding, which only verification uses.

    Raises
    ------
    SimbenchError
        If it is not installed; the message names the extra.
    """
    try:
        import embreex.rtcore_scene  # noqa: F401
    except ImportError:
        raise SimbenchError(
            "ray casting: expected Embree, which is not installed: "
            "pip install 'simbench-tracking[oracle]'"
        ) from None


@dataclass(frozen=True, slots=True)
class CastFrame:
    """What the rays of one frame hit, with ``S`` samples a pixel along each axis.

    Attributes
    ----------
    ids : (S H, S W) uint16
        Instance id at every sample, 0 where there is nothing.
    depth : (S H, S W) float64, m
        Distance along the optical axis; infinite where there is nothing.
    shown, alone : int
        Samples that show the target, and those that it covers without anything else.
    """

    ids: NDArray[np.uint16]
    depth: NDArray[np.float64]
    shown: int
    alone: int

    @property
    def hidden_share(self) -> float:
        """The part of the target that is hidden, in [0, 1]; 1 where it is absent."""
        return 1.0 - self.shown / self.alone if self.alone else 1.0


@dataclass(frozen=True, slots=True)
class _Window:
    """A part of the samples: rows and columns, the ends exclusive."""

    top: int
    bottom: int
    left: int
    right: int


class RayCaster:
    """Casts rays at the full-detail meshes of a scene.

    Parameters
    ----------
    scene : Scene
    target : int
        Index of the target among the vehicles.

    Raises
    ------
    SimbenchError
        If Embree is not installed.
    """

    def __init__(self, scene: Scene, target: int) -> None:
        require_embree()
        self._scene, self._target = scene, target
        static = (scene.ground, scene.static_objects, scene.distant)
        points = np.concatenate([mesh.positions for mesh in static])
        self._static = points.astype(np.float64).reshape(-1, 3, 3)
        ids = np.concatenate([mesh.surface[::3, 0] for mesh in static])
        self._static_ids = ids.astype(np.uint16)

    def cast(
        self, camera: Camera, poses: NDArray[np.float64], samples: int
    ) -> CastFrame:
        """Cast the rays of all samples of a frame.

        Parameters
        ----------
        camera : Camera
        poses : (V, 4, 4) float
            Vehicle frames to the road frame; NaN for vehicles that are not there.
        samples : int
            Samples a pixel along each axis.
        """
        triangles, owners = self._triangles(poses)
        whole = _Window(0, camera.height * samples, 0, camera.width * samples)
        rays = _Rays(camera, samples)
        hit, depth = rays.cast(triangles, whole)
        ids = owners[hit]
        covered, _ = self._target_alone(rays, poses)
        shown, alone = np.count_nonzero(ids == self._target_id), covered.sum()
        return CastFrame(ids, depth, int(shown), int(alone))

    def hidden_share(
        self, camera: Camera, poses: NDArray[np.float64], samples: int
    ) -> float:
        """Return `CastFrame.hidden_share`, with rays around the target only."""
        rays = _Rays(camera, samples)
        covered, window = self._target_alone(rays, poses)
        if not covered.any():
            return 1.0
        triangles, owners = self._triangles(poses)
        hit, _ = rays.cast(triangles, window)
        shown = np.count_nonzero(owners[hit] == self._target_id)
        return 1.0 - float(shown / covered.sum())

    @property
    def _target_id(self) -> int:
        return int(self._scene.ids[self._target])

    def _triangles(
        self, poses: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.uint16]]:
        """Return all triangles, (F, 3, 3) m in the road frame, and their ids (F + 1,).

        The last id, at index -1 too, is that of rays that hit nothing.
        """
        present = np.flatnonzero(~np.isnan(poses[:, 0, 3])).tolist()
        parts = [self._placed(vehicle, poses) for vehicle in present]
        counts = [len(part) for part in parts]
        ids = np.repeat(self._scene.ids[present], counts).astype(np.uint16)
        triangles = np.concatenate([self._static, *parts])
        nothing = np.zeros(1, np.uint16)
        return triangles, np.concatenate([self._static_ids, ids, nothing])

    def _placed(self, vehicle: int, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        mesh = self._scene.bodies[self._scene.body_of[vehicle]]
        turn, shift = poses[vehicle, :3, :3], poses[vehicle, :3, 3]
        points = mesh.positions.astype(np.float64) @ turn.T + shift
        placed: NDArray[np.float64] = points.reshape(-1, 3, 3)
        return placed

    def _target_alone(
        self, rays: _Rays, poses: NDArray[np.float64]
    ) -> tuple[NDArray[np.bool_], _Window]:
        """Return the samples that the target alone covers in a window around it."""
        if np.isnan(poses[self._target, 0, 3]):
            return np.zeros((0, 0), np.bool_), _Window(0, 0, 0, 0)
        triangles = self._placed(self._target, poses)
        window = rays.window_around(triangles.reshape(-1, 3))
        hit, _ = rays.cast(triangles, window)
        return hit >= 0, window


class _Rays:
    """The rays of a camera's samples, in its coordinates."""

    def __init__(self, camera: Camera, samples: int) -> None:
        self._camera, self._samples = camera, samples
        self._shape = camera.height * samples, camera.width * samples

    def cast(
        self, triangles: NDArray[np.float64], window: _Window
    ) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Cast the rays of a window at triangles, (F, 3, 3) m in the road frame.

        Returns
        -------
        hit : (rows, columns) int32
            Index of the triangle that each ray hits first, -1 if none.
        depth : (rows, columns) float64, m
        """
        shape = max(0, window.bottom - window.top), max(0, window.right - window.left)
        hit, depth = np.full(shape, -1, np.int32), np.full(shape, np.inf)
        if 0 in shape or not len(triangles):
            return hit, depth
        scene = _embree_scene(self._in_camera(triangles))
        rows = max(1, _MOST_RAYS // shape[1])
        for first in range(0, shape[0], rows):
            part = slice(first, first + rows)
            last = min(first + rows, shape[0])
            directions = self._directions(window, window.top + first, window.top + last)
            found = scene.run(directions * np.float32(_NEAREST_M), directions, output=1)
            reached = _NEAREST_M + found["tfar"].astype(np.float64)
            seen = (found["primID"] >= 0) & (reached <= _FARTHEST_M)
            hit[part] = np.where(seen, found["primID"], -1).reshape(-1, shape[1])
            depth[part] = np.where(seen, reached, np.inf).reshape(-1, shape[1])
        return hit, depth

    def window_around(self, points: NDArray[np.float64]) -> _Window:
        """Return the samples around the image of points; all if one is too near."""
        local, (height, width) = self._in_camera(points), self._shape
        if local[:, 2].min() <= _NEAREST_M:
            return _Window(0, height, 0, width)
        image = local @ self._camera.matrix.T
        spots = image[:, :2] / image[:, 2:] * self._samples
        (left, top), (right, bottom) = spots.min(axis=0), spots.max(axis=0)
        return _Window(
            *(int(np.clip(end, 0, height)) for end in (top - 1, bottom + 2)),
            *(int(np.clip(end, 0, width)) for end in (left - 1, right + 2)),
        )

    def _in_camera(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        moved: NDArray[np.float64] = points @ self._camera.rotation.T
        return moved + self._camera.translation

    def _directions(
        self, window: _Window, top: int, bottom: int
    ) -> NDArray[np.float32]:
        """Return the directions of some rows of a window, (N, 3)."""
        # a sample is in the middle of its part of the pixel
        across = (np.arange(window.left, window.right) + 0.5) / self._samples
        down = (np.arange(top, bottom) + 0.5) / self._samples
        u, v = np.meshgrid(across, down)
        positions = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3)
        directions = positions @ np.linalg.inv(self._camera.matrix).T
        return directions.astype(np.float32)


def _embree_scene(triangles: NDArray[np.float64]) -> Any:  # Any: embreex is untyped
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)  # no ray slips through a shared edge
    TriangleMesh(scene, np.ascontiguousarray(triangles, np.float32))
    return scene
