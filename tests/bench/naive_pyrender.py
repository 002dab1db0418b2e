"""Reference of the renderer benchmark: the scene drawn as in pyrender's guide."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.gl import (
    offscreen,  # must come before pyrender: it sets the platform
)
from simbench.render.world.mesh import Mesh
from simbench.render.world.scene import Scene

# isort: split
import pyrender

setattr(np, "infty", np.inf)  # noqa: B010  # pyrender 0.1.45 predates NumPy 2

_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # OpenCV's camera axes to OpenGL's


class NaivePyrender:
    """One node for each vehicle; passes for colour, for ids, and for the target alone.

    Parameters
    ----------
    scene : Scene
    camera : Camera
        Of this size and these intrinsics; the pose is set for every frame.
    """

    def __init__(self, scene: Scene, camera: Camera) -> None:
        offscreen.make_current()
        self.renderer = pyrender.OffscreenRenderer(camera.width, camera.height)
        self.scene = pyrender.Scene(ambient_light=[0.4, 0.4, 0.45])
        light = pyrender.DirectionalLight(intensity=4.0)
        self.scene.add(light, pose=_looking_along(-scene.light.to_sun))
        for mesh in (scene.ground, scene.static_objects, scene.distant):
            self.scene.add(_mesh(mesh))
        self.nodes = [
            self.scene.add(_mesh(scene.bodies[kind], paint))
            for kind, paint in zip(scene.body_of, scene.paints, strict=True)
        ]
        fx, fy = camera.matrix[0, 0], camera.matrix[1, 1]
        lens = pyrender.IntrinsicsCamera(
            fx, fy, camera.matrix[0, 2], camera.matrix[1, 2], znear=0.4, zfar=2500.0
        )
        self.lens = self.scene.add(lens)

    def render(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        target: int,
    ) -> tuple[Any, Any, float]:
        """Return colour, ids and the target's visible fraction."""
        pose = np.eye(4)
        pose[:3, :3] = camera.rotation.T
        pose[:3, 3] = camera.position
        self.scene.set_pose(self.lens, pose @ _FLIP)
        for node, place, is_there in zip(self.nodes, poses, present, strict=True):
            node.mesh.is_visible = bool(is_there)
            if is_there:
                self.scene.set_pose(node, place)
        flags = pyrender.RenderFlags.SHADOWS_DIRECTIONAL
        colour, _ = self.renderer.render(self.scene, flags)
        numbers = {
            node: (0, (index + 1) // 256, (index + 1) % 256)
            for index, node in enumerate(self.nodes)
        }
        seg = pyrender.RenderFlags.SEG
        ids, _ = self.renderer.render(self.scene, seg, numbers)
        alone, _ = self.renderer.render(
            self.scene, seg, {self.nodes[target]: (0, 0, 255)}
        )
        covered = alone[..., 2] == 255
        shown = np.all(ids == numbers[self.nodes[target]], axis=-1) & covered
        return colour, ids, float(shown.sum() / max(covered.sum(), 1))


def _mesh(mesh: Mesh, paint: NDArray[np.float64] | None = None) -> Any:
    colours = mesh.colours.copy()
    if paint is not None:
        colours[:, :3] += colours[:, 3:] * (paint - colours[:, :3])
    colours[:, 3] = 1.0
    primitive = pyrender.Primitive(
        positions=mesh.positions,
        normals=mesh.normals,
        color_0=colours,
        material=pyrender.MetallicRoughnessMaterial(
            metallicFactor=0.1, roughnessFactor=0.7
        ),
        mode=4,
    )
    return pyrender.Mesh(primitives=[primitive])


def _looking_along(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a pose whose -z axis is ``direction``."""
    back = -direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    return pose
