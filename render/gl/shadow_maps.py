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
from simbench.render.gl.windows import Window, merged_windows

# isort: split
from OpenGL import GL

__all__ = ["ShadowMaps"]

_WHOLE: Window = (0, 0, TEXELS, TEXELS)
_PART_TEXELS = 50_000
"""Texels that take as long to copy as one more part takes to begin."""


class ShadowMaps:
    """Depth from the sun: of static objects, and of these with the vehicles.

    Static objects are drawn only where a map has moved. What vehicles covered in the
    last frame is copied from their maps. A map that moves in every frame has nothing
    to copy: static objects are drawn into it directly.
    """

    def __init__(self) -> None:
        self._static, self._static_fb = _depth_texture()
        self._all, self._all_fb = _depth_texture()
        self._covered: list[list[Window]] = [[]] * MAPS
        self.forget()

    def update(
        self,
        fit: ShadowFit,
        spheres: Sequence[NDArray[np.float64]],
        draw_static: Callable[[NDArray[np.float64], int], None],
        draw_vehicles: Callable[[NDArray[np.float64], int], None],
    ) -> None:
        """Draw the maps of one frame.

        Parameters
        ----------
        fit : ShadowFit
        spheres : sequence of K (N, 4) float, m
            Middle and radius around each vehicle that each map needs, road frame.
        draw_static : callable of (4, 4) float and int
            Draws the depth of all static objects in the clip space of the map of a
            number.
        draw_vehicles : callable of (4, 4) float and int
            Draws that of the vehicles.
        """
        for number, needed in enumerate(spheres):
            clip = fit.clip(number)
            self._prepare(number, clip, draw_static)
            self._covered[number] = _covered(clip, needed)
            if self._covered[number]:
                with _drawing(self._all_fb, number):
                    draw_vehicles(clip, number)

    def _prepare(
        self,
        number: int,
        clip: NDArray[np.float64],
        draw_static: Callable[[NDArray[np.float64], int], None],
    ) -> None:
        """Set a map to the depth of the static objects at its present place."""
        place = clip.tobytes()
        moves = self._all_at[number] != place
        if moves and self._moves[number]:
            self._clear(self._all, self._all_fb, number)
            with _drawing(self._all_fb, number):
                draw_static(clip, number)
        else:
            if self._static_at[number] != place:
                self._clear(self._static, self._static_fb, number)
                with _drawing(self._static_fb, number):
                    draw_static(clip, number)
                self._static_at[number] = place
            if moves:
                self._covered[number] = [_WHOLE]
            self._restore(number)
        self._all_at[number], self._moves[number] = place, moves

    def _restore(self, number: int) -> None:
        """Copy the static objects' depth over that of the last frame's vehicles."""
        if not self._covered[number]:
            return
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._static_fb)
        GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._all_fb)
        kind, nearest, x = GL.GL_DEPTH_BUFFER_BIT, GL.GL_NEAREST, number * TEXELS
        for left, low, right, high in self._covered[number]:
            part = x + left, low, x + right, high
            GL.glBlitFramebuffer(*part, *part, kind, nearest)

    @staticmethod
    def _clear(texture: int, framebuffer: int, number: int) -> None:
        """Set a map to the farthest depth."""
        corner, size = (number * TEXELS, 0), (TEXELS, TEXELS)
        if GL.glClearTexSubImage:  # glClear draws a part of a texture, slowly
            what = GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT, np.ones(1, np.float32)
            GL.glClearTexSubImage(texture, 0, *corner, 0, *size, 1, *what)
            return
        with _drawing(framebuffer, number):  # OpenGL before 4.4
            GL.glScissor(*corner, *size)
            GL.glClear(GL.GL_DEPTH_BUFFER_BIT)

    def forget(self) -> None:
        """Draw all static objects again for the next frame: they have changed."""
        self._static_at: list[bytes | None] = [None] * MAPS
        self._all_at: list[bytes | None] = [None] * MAPS
        self._moves = [False] * MAPS

    def bind(self, unit: int) -> None:
        """Bind the maps to a texture unit."""
        GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._all)

    def delete(self) -> None:
        """Free the maps."""
        GL.glDeleteFramebuffers(2, [self._static_fb, self._all_fb])
        GL.glDeleteTextures([self._static, self._all])


def _covered(clip: NDArray[np.float64], spheres: NDArray[np.float64]) -> list[Window]:
    """Return parts of a map with all texels that spheres may cover."""
    middle = spheres[:, :3] @ clip[:2, :3].T + clip[:2, 3]
    radius = spheres[:, 3:] * np.linalg.norm(clip[:2, :3], axis=1)
    half = TEXELS / 2.0
    first = np.floor((middle - radius + 1.0) * half) - 1.0
    last = np.ceil((middle + radius + 1.0) * half) + 1.0
    ends = np.clip(np.hstack([first, last]), 0, TEXELS).astype(np.int64)
    is_there = np.all(ends[:, :2] < ends[:, 2:], axis=1)
    return merged_windows(ends[is_there], _PART_TEXELS)


@contextmanager
def _drawing(framebuffer: int, number: int) -> Iterator[None]:
    """Draw to one map, without its border: there is light beyond it."""
    left = number * TEXELS
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)
    GL.glViewport(left, 0, TEXELS, TEXELS)
    GL.glEnable(GL.GL_DEPTH_TEST)
    GL.glDepthMask(GL.GL_TRUE)
    GL.glDepthFunc(GL.GL_LESS)
    GL.glDisable(GL.GL_CULL_FACE)
    GL.glEnable(GL.GL_SCISSOR_TEST)
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
