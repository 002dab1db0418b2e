"""The renderer: draws a scene through pyrender's buffers and shaders, in one pass.

pyrender's own renderer uses a pass for the colour and one for each segmentation, with
one draw call for each vehicle and uniforms looked up by name each time. This one keeps
pyrender's meshes (`pyrender.Primitive`, instanced), shader programs and EGL platform
and replaces the pass: it gives colour, instance id and depth together, uses one draw
call for each vehicle body, and draws the target again, alone, for its visible fraction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import RenderError
from simbench.render.gl import (
    offscreen,  # must come before pyrender: it sets the platform
)
from simbench.render.gl.batches import CellMesh, front_faces_only
from simbench.render.gl.framebuffers import Framebuffers
from simbench.render.gl.lighting import Lighting
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.shader_programs import shared_program
from simbench.render.gl.shadow_fit import FAR_M, ShadowFit, fit_shadow_maps
from simbench.render.gl.shadow_maps import ShadowMaps
from simbench.render.gl.sky import Sky
from simbench.render.gl.still_view import StillView
from simbench.render.gl.textures import grain_texture
from simbench.render.gl.vehicle_bodies import VehicleBodies
from simbench.render.gl.vehicle_bounds import VehicleBounds
from simbench.render.gl.windows import Window
from simbench.render.world.mesh import Mesh, Surface
from simbench.render.world.projection import (
    clip_matrix,
    covering_window,
    part_of,
    sky_directions,
)
from simbench.render.world.scene import Scene
from simbench.render.world.vegetation import thinned

# isort: split
from OpenGL import GL

__all__ = ["SceneRenderer"]


class SceneRenderer:
    """Renders one scene; to be closed, or used in a ``with`` statement.

    Parameters
    ----------
    scene : Scene
    width, height : int, px
        Size of the images.
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
        height_samples, width_samples = self._buffers.shape
        self._whole: Window = (0, 0, width_samples, height_samples)
        self._grain = grain_texture()
        self._lighting = Lighting(scene)
        self._shadows = ShadowMaps() if scene.light.shadows else None
        defines = self._lighting.defines
        if self._shadows is not None:
            defines = *defines, "SHADOWS"
        parts = "GROUND", "FOLIAGE", "STATIC", "VEHICLES", "GROUND FAR", "DISTANT FAR"
        self._programs = {
            part: shared_program("scene.vert", "scene.frag", *part.split(), *defines)
            for part in parts
        }
        self._programs["bare"] = shared_program("bare.vert", "bare.frag")
        self._ground = CellMesh(scene.ground)
        self._set_static_objects(scene.static_objects)
        self._distant = CellMesh(scene.distant)
        self._bounds = VehicleBounds(scene)
        self._bodies = VehicleBodies(scene, self._bounds.reach)
        self._still = StillView(samples)
        self._sky = Sky()

    def __enter__(self) -> SceneRenderer:
        """Return the renderer itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the renderer."""
        self.close()

    def close(self) -> None:
        """Free the renderer's resources on the graphics device."""
        offscreen.make_current()
        still = self._foliage, self._far_foliage, self._static
        for mesh in (self._ground, *still, self._distant):
            mesh.delete()
        self._bodies.delete()
        self._lighting.delete()
        if self._shadows is not None:
            self._shadows.delete()
        self._buffers.delete()
        GL.glDeleteTextures([self._grain])
        self._sky.delete()

    def start_film(self) -> None:
        """Begin another film of the scene, as if none had been rendered before."""
        self._bodies.start_film()
        self.forget_last()

    def replace_static_objects(self, mesh: Mesh) -> None:
        """Render another mesh in place of the scene's static objects."""
        offscreen.make_current()
        for replaced in (self._foliage, self._far_foliage, self._static):
            replaced.delete()
        self._set_static_objects(mesh)
        self.forget_last()

    def _set_static_objects(self, mesh: Mesh) -> None:
        foliage, others = mesh.split(Surface.FOLIAGE, Surface.LEAF)
        self._foliage, self._static = CellMesh(foliage), CellMesh(others)
        self._far_foliage = CellMesh(thinned(foliage))  # only casts shadows

    def forget_last(self) -> None:
        """Draw all of the next frame and of its shadow maps, whatever was before."""
        self._still.forget()
        if self._shadows is not None:
            self._shadows.forget()

    def render(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        target: int,
        *,
        with_depth: bool = False,
        gain: float = 1.0,
    ) -> RenderedFrame:
        """Render one frame.

        Of a camera that stands still, only those parts are rendered in which vehicles
        or their shadows are or were in the frame before.

        Parameters
        ----------
        camera : Camera
            Its size must be that of the renderer.
        poses : (V, 4, 4) float
            Vehicle frames to the road frame.
        present : (V,) bool
            Which vehicles are on the road.
        target : int
            Index of the target.
        with_depth : bool
            Read the depth, too.
        gain : float
            Factor on all light, as of an exposure.
        """
        offscreen.make_current()
        self._bodies.choose_levels(camera, poses, present)
        clip = clip_matrix(camera)
        ground_m = self._bounds.ground_m(camera)
        fit = fit_shadow_maps(camera, self._scene.light.to_sun, ground_m)
        windows, casts = self._bounds.windows_and_casters(
            camera, clip, self._whole[2:], fit, poses, present
        )
        changed = None
        if not self._lighting.moves:
            view = clip.tobytes() + np.float64(gain).tobytes()
            changed = self._still.changed(view, windows, poses, present)
        parts = [self._whole] if changed is None else changed
        self._draw_shadows(fit, poses, casts)
        self._bodies.place(poses, present, clip)
        lighting = self._lighting.uniforms(camera, poses, present, gain)
        self._draw_scene(camera, clip, fit.uniforms | lighting, parts)
        image, ids, depth = self._buffers.read(parts, with_depth=with_depth)
        shown = np.full(int(present[target]), target)  # none or one
        window = self._window(clip, poses, shown)
        silhouette = self.silhouette(camera, poses, shown, window)
        left, top, right, bottom = window
        inside = slice(top, bottom), slice(left, right)
        return RenderedFrame(image, ids, silhouette, inside, depth, changed)

    def render_ids(
        self, camera: Camera, poses: NDArray[np.float64], present: NDArray[np.bool_]
    ) -> NDArray[np.uint16]:
        """Return the ids of a frame, (S H, S W), without its image.

        They are those of `render` with the same camera, poses and vehicles present, at
        the levels of detail of the last frame rendered; before the first, the highest.
        """
        offscreen.make_current()
        clip = clip_matrix(camera)
        self._bodies.place(poses, present, clip)
        self._still.forget()
        self._buffers.bind_ids_only()
        self._draw_objects(clip, {"view_projection": clip}, [self._whole])
        ids = self._buffers.read_all_ids()
        _require_no_error()
        return ids

    def silhouette(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        which: NDArray[np.int64],
        window: Window | None = None,
    ) -> NDArray[np.bool_]:
        """Return the samples that some vehicles would cover without anything else.

        Parameters
        ----------
        camera : Camera
        poses : (V, 4, 4) float
        which : (N,) int
            Indices of vehicles that are on the road.
        window : (left, top, right, bottom), optional
            The only samples to look at; by default those around the vehicles.

        Returns
        -------
        (S H, S W) bool
            At the samples of a frame's ids; False out of the window.
        """
        offscreen.make_current()
        clip = clip_matrix(camera)
        if window is None:
            window = self._window(clip, poses, which)
        left, top, right, bottom = window
        if not len(which) or left >= right or top >= bottom:
            return np.zeros(self._buffers.shape, np.bool_)
        with self._buffers.drawing_silhouette(window):
            self._programs["bare"].use({"view_projection": clip})
            with front_faces_only():
                self._bodies.draw_only(poses, which)
        covered = self._buffers.read_silhouette(window)
        _require_no_error()
        return covered

    def _window(
        self,
        clip: NDArray[np.float64],
        poses: NDArray[np.float64],
        which: NDArray[np.int64],
    ) -> Window:
        """Return a window with all samples that vehicles may cover."""
        placed = self._bounds.corners(poses, which)
        height, width = self._buffers.shape
        return covering_window(clip, placed.reshape(-1, 3), width, height)

    def _draw_shadows(
        self,
        fit: ShadowFit,
        poses: NDArray[np.float64],
        casts: list[NDArray[np.bool_]],
    ) -> None:
        """Draw the shadow maps of a frame, and bind them."""
        if self._shadows is None:
            return

        def draw_static(clip: NDArray[np.float64], number: int) -> None:
            self._programs["bare"].use({"view_projection": clip})
            (self._far_foliage if number else self._foliage).draw(clip)
            self._static.draw(clip)

        def draw_vehicles(clip: NDArray[np.float64], number: int) -> None:
            self._bodies.place(poses, casts[number], clip)
            self._programs["bare"].use({"view_projection": clip})
            self._bodies.draw()

        spheres = np.column_stack([poses[:, :3, 3], self._bounds.reach])
        chosen = [spheres[each] for each in casts]
        self._shadows.update(fit, chosen, draw_static, draw_vehicles)
        self._shadows.bind(0)

    def _draw_scene(
        self,
        camera: Camera,
        clip: NDArray[np.float64],
        lighting: dict[str, Any],
        parts: Sequence[Window],
    ) -> None:
        """Draw parts of the picture; what is drawn beside them was there before."""
        self._buffers.bind_image(parts)
        GL.glActiveTexture(GL.GL_TEXTURE1)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._grain)
        uniforms = lighting | {"view_projection": clip, "shadow_map": 0, "grain": 1}
        self._draw_objects(clip, uniforms, parts)
        empty = self._buffers.read_ids(parts)
        sky = lighting | {"to_world": sky_directions(clip, camera)}
        self._sky.draw(sky, self._buffers, empty)

    def _draw_objects(
        self,
        clip: NDArray[np.float64],
        uniforms: dict[str, Any],
        parts: Sequence[Window],
    ) -> None:
        """Draw all but the sky, from near to far: hidden samples are not shaded."""
        self._programs["VEHICLES"].use(uniforms)
        with front_faces_only():
            self._bodies.draw()
        height, width = self._buffers.shape
        narrow = [part_of(clip, part, width, height) for part in parts]
        for part, mesh, *depths in (
            ("STATIC", self._static),
            ("FOLIAGE", self._foliage),
            ("GROUND", self._ground, -np.inf, FAR_M),
            ("GROUND FAR", self._ground, FAR_M, np.inf),
            ("DISTANT FAR", self._distant),
        ):
            self._programs[part].use(uniforms)
            for index in self._buffers.inside(parts):
                mesh.draw(narrow[index], *depths)


def _require_no_error() -> None:
    error = GL.glGetError()
    if error != GL.GL_NO_ERROR:
        raise RenderError(f"OpenGL: expected no error, got {error:#x}")
