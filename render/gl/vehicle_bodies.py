"""The bodies of a scene's vehicles on the graphics device: a draw call each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.gl.batches import InstancedMesh, may_be_visible
from simbench.render.world.detail import DetailLevels
from simbench.render.world.scene import Scene

__all__ = ["VehicleBodies"]


class VehicleBodies:
    """Instanced meshes of all bodies, each in full and with few triangles.

    Parameters
    ----------
    scene : Scene
    reach_m : (V,) float
        Distance from the origin of each vehicle within which all of it is.
    """

    def __init__(self, scene: Scene, reach_m: NDArray[np.float64]) -> None:
        self._scene = scene
        self._reach_m = reach_m
        counts = np.bincount(scene.body_of, minlength=len(scene.bodies)).tolist()
        meshes = scene.bodies + scene.simple_bodies
        self._meshes = [
            InstancedMesh(mesh, count)
            for mesh, count in zip(meshes, 2 * counts, strict=True)
        ]
        self._levels = DetailLevels(scene.heights)

    def delete(self) -> None:
        """Free the meshes on the graphics device."""
        for mesh in self._meshes:
            mesh.delete()

    def start_film(self) -> None:
        """Begin with levels of detail as if nothing had been rendered before."""
        self._levels = DetailLevels(self._scene.heights)

    def choose_levels(
        self, camera: Camera, poses: NDArray[np.float64], present: NDArray[np.bool_]
    ) -> None:
        """Choose the level of detail of each vehicle in the next frame."""
        self._levels.update(camera, poses, present)

    def place(
        self,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        clip: NDArray[np.float64],
    ) -> None:
        """Set the instances of the vehicles that may be visible in a projection."""
        tagged = poses.astype(np.float32)
        tagged[:, 3, :3] = self._scene.paints
        tagged[:, 3, 3] = self._scene.ids
        centre, reach = poses[:, :3, 3], self._reach_m[:, None]
        visible = present & may_be_visible(clip, centre - reach, centre + reach)
        which = np.flatnonzero(visible)
        mesh_of = self._mesh_of[which]
        order = np.argsort(mesh_of, kind="stable")
        tagged = tagged[which[order]]
        ends = np.searchsorted(mesh_of[order], np.arange(len(self._meshes) + 1))
        for mesh, first, last in zip(
            self._meshes, ends[:-1].tolist(), ends[1:].tolist(), strict=True
        ):
            mesh.place(tagged[first:last])

    def draw(self) -> None:
        """Draw the instances that are set, with the program in use."""
        for mesh in self._meshes:
            mesh.draw()

    def draw_only(self, poses: NDArray[np.float64], which: NDArray[np.int64]) -> None:
        """Set and draw some vehicles, (N,) indices, and no others."""
        mesh_of = self._mesh_of[which]
        for number in np.unique(mesh_of).tolist():
            mesh = self._meshes[number]
            mesh.place(poses[which[mesh_of == number]].astype(np.float32))
            mesh.draw()

    @property
    def _mesh_of(self) -> NDArray[np.int64]:
        """Index in ``_meshes`` of each vehicle's mesh, at its level of detail."""
        simple = self._levels.is_simple * len(self._scene.bodies)
        mesh_of: NDArray[np.int64] = self._scene.body_of + simple
        return mesh_of
