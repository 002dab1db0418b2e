"""The camera: draws a scene through pyrender's buffers and shaders, in one pass.

pyrender's own renderer draws the colour and every segmentation in passes of their own,
with one draw a vehicle and uniforms looked up by name each time. This one keeps its
meshes (`pyrender.Primitive`, instanced), shader programs and EGL platform and replaces
the pass: colour, instance id and depth come out together, a kind of vehicle is one
draw, and the target is drawn once more, alone, for its visible fraction.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.camera import Camera
from simbench.errors import RenderError
from simbench.render import offscreen  # must come before pyrender: it sets the platform
from simbench.render.framebuffers import Framebuffers, grain_texture
from simbench.render.mesh import Mesh
from simbench.render.projection import clip_matrix, shadow_matrix
from simbench.render.scene import Scene

# isort: split
from OpenGL import GL
from pyrender import Primitive
from pyrender.shader_program import ShaderProgram

__all__ = ["PyrenderCamera", "Shot"]


@dataclass(frozen=True, slots=True)
class Shot:
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
        self._programs = {
            "ground": _Program("scene.vert", "scene.frag", "GROUND"),
            "standing": _Program("scene.vert", "scene.frag", "STANDING"),
            "vehicles": _Program("scene.vert", "scene.frag", "VEHICLES"),
            "sky": _Program("sky.vert", "sky.frag"),
            "bare": _Program("bare.vert", "bare.frag"),
        }
        self._static = [_Batch(scene.ground, 1), _Batch(scene.standing, 1)]
        for batch in self._static:
            batch.place(np.eye(4, dtype=np.float32)[None] * [[[1], [1], [1], [0]]])
        counts = np.bincount(scene.body_of, minlength=len(scene.bodies))
        self._bodies = [
            _Batch(mesh, int(count))
            for mesh, count in zip(scene.bodies, counts, strict=True)
        ]
        self._alone = [_Batch(mesh, 1) for mesh in scene.bodies]
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
        for batch in [*self._static, *self._bodies, *self._alone]:
            batch.delete()
        for program in self._programs.values():
            program.delete()
        self._buffers.delete()
        GL.glDeleteTextures([self._grain])
        GL.glDeleteVertexArrays(1, [self._sky])

    def shoot(
        self,
        camera: Camera,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        target: int,
        *,
        want_depth: bool = False,
    ) -> Shot:
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
        """
        offscreen.make_current()
        self._place(poses, present)
        clip = clip_matrix(camera)
        focus = poses[target, :3, 3] if present[target] else camera.position
        light_clip = shadow_matrix(self._scene.light.to_sun, focus)
        if self._scene.light.shadows:
            self._draw_shadows(light_clip)
        self._draw_scene(camera, clip, light_clip)
        image, ids, depth = self._buffers.read(want_depth=want_depth)
        self._draw_alone(poses, present, target, clip)
        alone = self._buffers.read_ids() > 0
        _raise_on_error()
        return Shot(image, ids, alone, depth)

    def _place(self, poses: NDArray[np.float64], present: NDArray[np.bool_]) -> None:
        tagged = poses.astype(np.float32)
        tagged[:, 3, :3] = self._scene.paints
        tagged[:, 3, 3] = self._scene.ids
        for number, batch in enumerate(self._bodies):
            batch.place(tagged[(self._scene.body_of == number) & present])

    def _draw_shadows(self, light_clip: NDArray[np.float64]) -> None:
        self._buffers.bind_shadow()
        self._programs["bare"].use({"view_projection": light_clip})
        for batch in [self._static[1], *self._bodies]:
            batch.draw()

    def _draw_scene(
        self, camera: Camera, clip: NDArray[np.float64], light_clip: NDArray[np.float64]
    ) -> None:
        light = self._scene.light
        self._buffers.bind_picture()
        shared = {
            "eye": camera.position,
            "to_sun": light.to_sun,
            "sun": light.sun,
            "ambient": light.ambient,
            "ground": light.ground,
            "zenith": light.zenith,
            "horizon": light.horizon,
            "glow": light.glow,
            "haze": light.haze_per_m,
            "lamps": light.lamps,
        }
        drawing = {
            "view_projection": clip,
            "light_projection": light_clip,
            "has_shadows": int(light.shadows),
            "shadow_map": 0,
            "grain": 1,
        }
        self._buffers.bind_shadow_texture(0)
        GL.glActiveTexture(GL.GL_TEXTURE1)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._grain)
        # Vehicles and standing things first: what they hide is then not shaded.
        ground, standing = self._static
        for name, batches in (
            ("vehicles", self._bodies),
            ("standing", [standing]),
            ("ground", [ground]),
        ):
            self._programs[name].use(shared | drawing)
            for batch in batches:
                batch.draw()
        self._programs["sky"].use(shared | {"to_world": _unprojection(clip, camera)})
        GL.glDepthFunc(GL.GL_LEQUAL)
        GL.glBindVertexArray(self._sky)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)
        GL.glDepthFunc(GL.GL_LESS)

    def _draw_alone(
        self,
        poses: NDArray[np.float64],
        present: NDArray[np.bool_],
        target: int,
        clip: NDArray[np.float64],
    ) -> None:
        self._buffers.bind_ids_only()
        if present[target]:
            batch = self._alone[int(self._scene.body_of[target])]
            batch.place(poses[target : target + 1].astype(np.float32))
            self._programs["bare"].use({"view_projection": clip})
            batch.draw()


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


class _Program:
    """A shader program with its uniform locations looked up once."""

    def __init__(self, vertex: str, fragment: str, define: str = "PLAIN") -> None:
        with tempfile.TemporaryDirectory(prefix="simbench-shaders-") as folder:
            paths = [
                _complete(name, define, Path(folder)) for name in (vertex, fragment)
            ]
            self._program = ShaderProgram(*paths)
            self._program._add_to_context()
        number = self._program._program_id
        count = GL.glGetProgramiv(number, GL.GL_ACTIVE_UNIFORMS)
        names = [GL.glGetActiveUniform(number, index)[0] for index in range(count)]
        text = [n.decode() if isinstance(n, bytes) else str(n) for n in names]
        self._locations = {name: GL.glGetUniformLocation(number, name) for name in text}

    def use(self, uniforms: dict[str, Any]) -> None:
        """Bind the program and set those of the uniforms that it has."""
        self._program._bind()
        for name, value in uniforms.items():
            if name not in self._locations:
                continue
            place = self._locations[name]
            if isinstance(value, int):
                GL.glUniform1i(place, value)
            elif isinstance(value, float):
                GL.glUniform1f(place, value)
            elif value.ndim == 2:
                matrix = np.ascontiguousarray(value, np.float32)
                GL.glUniformMatrix4fv(place, 1, GL.GL_TRUE, matrix)
            else:
                GL.glUniform3fv(place, 1, np.ascontiguousarray(value, np.float32))

    def delete(self) -> None:
        """Free the program."""
        self._program.delete()


def _complete(name: str, define: str, folder: Path) -> str:
    """Write a shader with its includes and one define in place; return its path."""
    shaders = resources.files("simbench.render") / "shaders"
    text = (shaders / name).read_text(encoding="utf-8")
    common = (shaders / "light.glsl").read_text(encoding="utf-8")
    path = folder / name
    text = text.replace("//include light.glsl", common)
    version, rest = text.split("\n", 1)
    path.write_text(f"{version}\n#define {define}\n{rest}", encoding="utf-8")
    return str(path)


class _Batch:
    """One mesh on the device and the instances of it to draw."""

    def __init__(self, mesh: Mesh, capacity: int) -> None:
        self._count = 0
        self._primitive: Any = None
        if len(mesh.positions) == 0 or capacity == 0:
            return
        rows = np.hstack([mesh.positions, mesh.normals, mesh.surface, mesh.colours])
        unique, index = _weld(rows)
        self._primitive = Primitive(
            positions=unique[:, :3],
            normals=unique[:, 3:6],
            texcoord_0=unique[:, 6:8],
            color_0=unique[:, 8:12],
            indices=index.reshape(-1, 3),
            mode=4,
            poses=np.tile(np.eye(4, dtype=np.float32), (capacity, 1, 1)),
        )
        self._primitive._add_to_context()
        self._corners = len(index)

    def place(self, poses: NDArray[Any]) -> None:
        """Set the instances: (K, 4, 4), K at most the capacity."""
        self._count = len(poses)
        if self._primitive is None or not self._count:
            return
        columns = np.ascontiguousarray(poses.transpose(0, 2, 1), np.float32)
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._primitive._buffers[1])
        GL.glBufferSubData(GL.GL_ARRAY_BUFFER, 0, columns.nbytes, columns)

    def draw(self) -> None:
        """Draw all instances."""
        if self._primitive is None or not self._count:
            return
        GL.glBindVertexArray(self._primitive._vaid)
        GL.glDrawElementsInstanced(
            GL.GL_TRIANGLES, self._corners, GL.GL_UNSIGNED_INT, None, self._count
        )

    def delete(self) -> None:
        """Free the mesh."""
        if self._primitive is not None:
            self._primitive.delete()


def _weld(rows: NDArray[np.float32]) -> tuple[NDArray[Any], NDArray[np.uint32]]:
    """Return the distinct rows and, for every row, which of them it is."""
    packed = np.ascontiguousarray(rows, np.float32)
    keys = packed.view([("", packed.dtype)] * packed.shape[1]).ravel()
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    return packed[first], inverse.astype(np.uint32)
