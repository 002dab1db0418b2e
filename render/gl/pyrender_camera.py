"""The camera: draws a scene through pyrender's buffers and shaders, in one pass.

pyrender's own renderer draws the colour and every segmentation in passes of their own,
with one draw a vehicle and uniforms looked up by name each time. This one keeps its
meshes (`pyrender.Primitive`, instanced), shader programs and EGL platform and replaces
the pass: colour, instance id and depth come out together, a kind of vehicle is one
draw, and the target is drawn once more, alone, for its visible fraction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import RenderError
from simbench.render.gl import (
    offscreen,  # must come before pyrender: it sets the platform
)
from simbench.render.gl.batches import Instances, Terrain, meets_view
from simbench.render.gl.framebuffers import Framebuffers, grain_texture
from simbench.render.gl.lighting import Lighting
from simbench.render.gl.shader_programs import Program
from simbench.render.world.mesh import Mesh
from simbench.render.world.projection import clip_matrix, shadow_matrix
from simbench.render.world.scene import Scene

# isort: split
from OpenGL import GL

__all__ = ["PyrenderCamera", "RenderedFrame"]


@dataclass(frozen=True, slots=True)
class RenderedFrame:
    """What the camera saw in one frame.

    ``S`` is the number of samples a pixel along each axis.

    Attributes
    ----------
    image : (H, W, 3) uint8, RGB
        Mean over the samples of each pixel.
    ids : (S H, S W) uint16
        Instance id at every sample: ids never mix, whatever the smoothing.
    target_alone : (S H, S W) bool
        Samples that the target would cover if nothing else were there.
    depth : (H, W) float32 or None, m
        Distance along the optical axis at the sample nearest each pixel's middle;
        infinite in the sky. None if not asked for.
    """

    image: NDArray[np.uint8]
    ids: NDArray[np.uint16]
    target_alone: NDArray[np.bool_]
    depth: NDArray[np.float32] | None


class PyrenderCamera:
    """Films one scene. Close it, or use it in a ``with`` statement.

    Parameters
    ----------
    scene : Scene
    width, height : int, px
        Size of the pictures.
    samples : int
        Samples a pixel along each axis, 1 to 4.

    Raises
    ------
    RenderError
        If no OpenGL context can be opened.
    """

    def __init__(self, scene: Scene, width: int, height: int, samples: int) -> None:
        offscreen.make_current()
        self._scene = scene
        self._buffers = Framebuffers(width, height, samples)
        self._grain = grain_texture()
        self._lighting = Lighting(scene)
        having = self._lighting.defines
        self._programs = {
            "ground": Program("scene.vert", "scene.frag", "GROUND", *having),
            "standing": Program("scene.vert", "scene.frag", "STANDING", *having),
            "vehicles": Program("scene.vert", "scene.frag", "VEHICLES", *having),
            "sky": Program("sky.vert", "sky.frag"),
            "bare": Program("bare.vert", "bare.frag"),
        }
        self._ground = Terrain(scene.ground)
        self._standing = Terrain(scene.standing)
        self._distant = Terrain(scene.distant)
        counts = np.bincount(scene.body_of, minlength=len(scene.bodies))
        self._bodies = [
            Instances(mesh, int(count))
            for mesh, count in zip(scene.bodies, counts, strict=True)
        ]
        reach = [np.linalg.norm(mesh.positions, axis=1).max() for mesh in scene.bodies]
        self._reach = np.array(reach, dtype=np.float64)[scene.body_of]
        self._sky = GL.glGenVertexArrays(1)

    def __enter__(self) -> PyrenderCamera:
        """Return the camera itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the camera."""
        self.close()

    def close(self) -> None:
        """Free what the camera holds on the graphics device."""
        offscreen.make_current()
        self._ground.delete()
        self._standing.delete()
        self._distant.delete()
        for instances in self._bodies:
            instances.delete()
        for program in self._programs.values():
            program.delete()
        self._lighting.delete()
        self._buffers.delete()
        GL.glDeleteTextures([self._grain])
        GL.glDeleteVertexArrays(1, [self._sky])

    def load_scene(self, standing: Mesh) -> None:
        """Film other things in place of all that stands still in the scene."""
        offscreen.make_current()
        self._standing.delete()
        self._standing = Terrain(standing)

    def shoot(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        target: int,
        *,
        want_depth: bool = False,
        gain: float = 1.0,
    ) -> RenderedFrame:
        """Take one picture.

        Parameters
        ----------
        camera : Camera
            Its size must be the one the camera was made for.
        poses : (V, 4, 4) float
            Vehicle frames to the road frame.
        present : (V,) bool
            Which vehicles are on the road.
        target : int
            Index of the target.
        want_depth : bool
            Read the depth back too.
        gain : float
            Brightens all light, as an exposure does.
        """
        offscreen.make_current()
        clip = clip_matrix(camera)
        focus = poses[target, :3, 3] if present[target] else camera.position
        light_clip = shadow_matrix(
            self._scene.light.to_sun, focus, self._scene.shadow_radius_m
        )
        if self._scene.light.shadows:
            self._place(poses, present, light_clip)
            self._draw_shadows(light_clip)
        self._place(poses, present, clip)
        shared = self._lighting.uniforms(camera, poses, present, gain)
        self._draw_scene(camera, clip, light_clip, shared)
        image, ids, depth = self._buffers.read(want_depth=want_depth)
        shown = np.full(int(present[target]), target)  # none or one
        alone = self._draw_alone(poses, shown, clip)
        _raise_on_error()
        return RenderedFrame(image, ids, alone, depth)

    def outline(
        self, camera: Camera, poses: NDArray[np.float64], which: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Return the samples that some vehicles would cover if nothing else were there.

        Parameters
        ----------
        camera : Camera
        poses : (V, 4, 4) float
        which : (N,) int
            Indices of vehicles that are on the road.

        Returns
        -------
        (S H, S W) bool
            The same places as those of a shot's ids.
        """
        offscreen.make_current()
        covered = self._draw_alone(poses, which, clip_matrix(camera))
        _raise_on_error()
        return covered

    def _place(
        self,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        clip: NDArray[np.float64],
    ) -> None:
        """Set the vehicles that may be seen through a projection."""
        tagged = poses.astype(np.float32)
        tagged[:, 3, :3] = self._scene.paints
        tagged[:, 3, 3] = self._scene.ids
        place, reach = poses[:, :3, 3], self._reach[:, None]
        seen = present & meets_view(clip, place - reach, place + reach)
        for number, instances in enumerate(self._bodies):
            instances.place(tagged[(self._scene.body_of == number) & seen])

    def _draw_shadows(self, light_clip: NDArray[np.float64]) -> None:
        self._buffers.bind_shadow()
        self._programs["bare"].use({"view_projection": light_clip})
        self._standing.draw(light_clip)
        for instances in self._bodies:
            instances.draw()

    def _draw_scene(
        self,
        camera: Camera,
        clip: NDArray[np.float64],
        light_clip: NDArray[np.float64],
        shared: dict[str, Any],
    ) -> None:
        self._buffers.bind_picture()
        drawing = {
            "view_projection": clip,
            "light_projection": light_clip,
            "has_shadows": int(self._scene.light.shadows),
            "shadow_map": 0,
            "grain": 1,
        }
        self._buffers.bind_shadow_texture(0)
        GL.glActiveTexture(GL.GL_TEXTURE1)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._grain)
        # From near to far: what is hidden is not shaded.
        uniforms = shared | drawing
        self._programs["vehicles"].use(uniforms)
        for instances in self._bodies:
            instances.draw()
        self._programs["standing"].use(uniforms)
        self._standing.draw(clip)
        self._programs["ground"].use(uniforms)
        self._ground.draw(clip)
        self._programs["standing"].use(uniforms)
        self._distant.draw(clip)
        self._programs["sky"].use(shared | {"to_world": _unprojection(clip, camera)})
        GL.glDepthFunc(GL.GL_LEQUAL)
        GL.glBindVertexArray(self._sky)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        GL.glDepthFunc(GL.GL_LESS)

    def _draw_alone(
        self,
        poses: NDArray[np.float64],
        which: NDArray[np.int64],
        clip: NDArray[np.float64],
    ) -> NDArray[np.bool_]:
        self._buffers.bind_ids_only()
        self._programs["bare"].use({"view_projection": clip})
        for number in np.unique(self._scene.body_of[which]).tolist():
            body = self._bodies[number]
            mine = which[self._scene.body_of[which] == number]
            body.place(poses[mine].astype(np.float32))
            body.draw()
        return self._buffers.read_ids() > 0


def _unprojection(clip: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Return the map from a clip-space corner at the far plane to a direction."""
    inverse = np.linalg.inv(clip)
    shift = np.eye(4)
    shift[:3, 3] = -camera.position
    # (inverse @ corner) is a point times w; shifting it by the eye times w keeps the
    # first three parts along the ray, and w is positive at the far plane.
    direction: NDArray[np.float64] = shift @ inverse
    return direction


def _raise_on_error() -> None:
    error = GL.glGetError()
    if error != GL.GL_NO_ERROR:
        raise RenderError(f"OpenGL reports error {error:#x} after a frame")
