"""Shadow maps: what stands still is drawn once, and vehicles into a copy of that."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError
from simbench.render.gl import offscreen  # noqa: F401  # before OpenGL: sets the platform
from simbench.render.gl.shadow_fit import MAPS, TEXELS, ShadowFit
from simbench.render.gl.textures import make_texture

# isort: split
from OpenGL import GL

__all__ = ["ShadowMaps"]

_Rectangle = tuple[int, int, int, int]
_WHOLE: _Rectangle = (0, 0, TEXELS, TEXELS)


class ShadowMaps:
    """Depth from the sun: of static objects, and of these with the vehicles.

    Static objects are drawn only where a map has moved. What vehicles covered in the
    last frame is copied from their maps.
    """

    def __init__(self) -> None:
        self._static, self._static_fb = _depth_texture()
        self._all, self._all_fb = _depth_texture()
        self._places: list[bytes | None] = [None] * MAPS
        self._covered: list[_Rectangle] = [(0, 0, 0, 0)] * MAPS

    def update(
        self,
        fit: ShadowFit,
        spheres: Sequence[NDArray[np.float64]],
        draw_static: Callable[[NDArray[np.float64]], None],
        draw_vehicles: Callable[[NDArray[np.float64], int], None],
    ) -> None:
        """Draw the maps of one frame.

        Parameters
        ----------
        fit : ShadowFit
        spheres : sequence of K (N, 4) float, m
            Middle and radius around each vehicle that each map needs, road frame.
        draw_static : callable of (4, 4) float
            Draws the depth of all static objects in a map's clip space.
        draw_vehicles : callable of (4, 4) float and int
            Draws that of the vehicles, given the number of the map, too.
        """
        for number, needed in enumerate(spheres):
            clip = fit.clip(number)
            place = clip.tobytes()
            if self._places[number] != place:
                with _drawing(self._static_fb, number, clear=True):
                    draw_static(clip)
                self._places[number], self._covered[number] = place, _WHOLE
            self._restore(number)
            self._covered[number] = covered = _covered(clip, needed)
            if covered[0] < covered[2] and covered[1] < covered[3]:
                with _drawing(self._all_fb, number, clear=False):
                    draw_vehicles(clip, number)

    def _restore(self, number: int) -> None:
        """Copy the static objects' depth over that of the last frame's vehicles."""
        left, low, right, high = self._covered[number]
        if left >= right or low >= high:
            return
        x = number * TEXELS
        part = x + left, low, x + right, high
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._static_fb)
        GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._all_fb)
        kind, nearest = GL.GL_DEPTH_BUFFER_BIT, GL.GL_NEAREST
        GL.glBlitFramebuffer(*part, *part, kind, nearest)

    def forget(self) -> None:
        """Draw all static objects again for the next frame: they have changed."""
        self._places = [None] * MAPS

    def bind(self, unit: int) -> None:
        """Bind the maps to a texture unit."""
        GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._all)

    def delete(self) -> None:
        """Free the maps."""
        GL.glDeleteFramebuffers(2, [self._static_fb, self._all_fb])
        GL.glDeleteTextures([self._static, self._all])


def _covered(clip: NDArray[np.float64], spheres: NDArray[np.float64]) -> _Rectangle:
    """Return the texels that spheres may cover; empty where there are none."""
    middle = spheres[:, :3] @ clip[:2, :3].T + clip[:2, 3]
    radius = spheres[:, 3:] * np.linalg.norm(clip[:2, :3], axis=1)
    low, high = middle - radius, middle + radius
    seen = np.all((low < 1.0) & (high > -1.0), axis=1)
    if not seen.any():
        return 0, 0, 0, 0
    half = TEXELS / 2.0
    first = np.floor((low[seen].min(axis=0) + 1.0) * half) - 1.0
    last = np.ceil((high[seen].max(axis=0) + 1.0) * half) + 1.0
    left, bottom = np.clip(first, 0, TEXELS).astype(int).tolist()
    right, top = np.clip(last, 0, TEXELS).astype(int).tolist()
    return left, bottom, right, top


@contextmanager
def _drawing(framebuffer: int, number: int, *, clear: bool) -> Iterator[None]:
    """Draw to one map, without its border: there is light beyond it."""
    left = number * TEXELS
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)
    GL.glViewport(left, 0, TEXELS, TEXELS)
    GL.glEnable(GL.GL_DEPTH_TEST)
    GL.glDepthMask(GL.GL_TRUE)
    GL.glDepthFunc(GL.GL_LESS)
    GL.glDisable(GL.GL_CULL_FACE)
    GL.glEnable(GL.GL_SCISSOR_TEST)
    if clear:
        GL.glScissor(left, 0, TEXELS, TEXELS)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)
    GL.glScissor(left + 2, 2, TEXELS - 4, TEXELS - 4)
    try:
        yield
    finally:
        GL.glDisable(GL.GL_SCISSOR_TEST)


def _depth_texture() -> tuple[int, int]:
    """Return a depth texture with room for all maps, and its framebuffer."""
    edge = GL.GL_CLAMP_TO_EDGE
    texture = make_texture(
        GL.GL_DEPTH_COMPONENT32F,
        GL.GL_DEPTH_COMPONENT,
        (MAPS * TEXELS, TEXELS),
        None,
        WRAP_S=edge,
        WRAP_T=edge,
        COMPARE_MODE=GL.GL_COMPARE_REF_TO_TEXTURE,
        COMPARE_FUNC=GL.GL_LEQUAL,
    )
    framebuffer = GL.glGenFramebuffers(1)
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)
    point, kind = GL.GL_DEPTH_ATTACHMENT, GL.GL_TEXTURE_2D
    GL.glFramebufferTexture2D(GL.GL_FRAMEBUFFER, point, kind, texture, 0)
    GL.glDrawBuffer(GL.GL_NONE)
    GL.glReadBuffer(GL.GL_NONE)
    status = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
    if status != GL.GL_FRAMEBUFFER_COMPLETE:
        raise RenderError(
            f"OpenGL: expected complete shadow maps, got status {int(status):#x}"
        )
    return texture, int(framebuffer)
