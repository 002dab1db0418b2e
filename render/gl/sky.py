"""The sky: a coarse grid over the whole picture, drawn where nothing else is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from simbench.render.gl import offscreen  # noqa: F401  # before pyrender: sets the platform
from simbench.render.gl.framebuffers import Framebuffers
from simbench.render.gl.shader_programs import shared_program
from simbench.render.gl.windows import Window

# isort: split
from OpenGL import GL

__all__ = ["Sky"]

_ROWS: Final = 30
_CORNERS: Final = 2 * (16 + 1)
"""Strips of the grid and corners of each, see ``sky.vert``."""


class Sky:
    """The grid of the sky, for pictures of any size."""

    def __init__(self) -> None:
        self._program = shared_program("sky.vert", "sky.frag")
        self._first_row = self._program.location("first_row")
        self._grid = GL.glGenVertexArrays(1)

    def draw(
        self, uniforms: dict[str, Any], buffers: Framebuffers, windows: Sequence[Window]
    ) -> None:
        """Draw the sky behind all else, in windows that hold all of it.

        Parameters
        ----------
        uniforms : dict
            What ``light.glsl`` reads, and ``to_world``: from corners of the picture to
            directions.
        buffers : Framebuffers
            Everything else is drawn there.
        windows : sequence of (left, top, right, bottom)
        """
        buffers.bind_colour()
        self._program.use(uniforms)
        GL.glDepthFunc(GL.GL_LEQUAL)
        GL.glBindVertexArray(self._grid)
        height = buffers.shape[0]
        for index in buffers.inside(windows):
            _, top, _, bottom = windows[index]
            first, last = top * _ROWS // height, -(-bottom * _ROWS // height)
            GL.glUniform1i(self._first_row, first)
            GL.glDrawArraysInstanced(GL.GL_TRIANGLE_STRIP, 0, _CORNERS, last - first)
        GL.glDepthFunc(GL.GL_LESS)

    def delete(self) -> None:
        """Free the grid."""
        GL.glDeleteVertexArrays(1, [self._grid])
