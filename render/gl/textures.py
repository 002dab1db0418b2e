"""Maps of numbers that shaders look places up in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl import offscreen  # noqa: F401  # before OpenGL: sets the platform

# isort: split
from OpenGL import GL

__all__ = ["MapTexture"]


class MapTexture:
    """An (R, C, 4) float32 array on the device, read with linear interpolation.

    Parameters
    ----------
    texels : (R, C, 4) float32
    unit : int
        Texture unit where shaders find it.
    edge : bool
        Beyond its border it goes on as at the border; else it is 0 there.
    """

    def __init__(self, texels: NDArray[np.float32], unit: int, *, edge: bool) -> None:
        self._unit = unit
        self._number = GL.glGenTextures(1)
        self._size = texels.shape[1], texels.shape[0]
        self.bind()
        wrap = GL.GL_CLAMP_TO_EDGE if edge else GL.GL_CLAMP_TO_BORDER
        for name, value in [
            (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
            (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
            (GL.GL_TEXTURE_WRAP_S, wrap),
            (GL.GL_TEXTURE_WRAP_T, wrap),
        ]:
            GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
        pixels = np.ascontiguousarray(texels, np.float32)
        form, kind = GL.GL_RGBA, GL.GL_FLOAT
        inside = GL.GL_RGBA32F
        GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, inside, *self._size, 0, form, kind, pixels)

    def bind(self) -> None:
        """Make it readable at its unit."""
        GL.glActiveTexture(GL.GL_TEXTURE0 + self._unit)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._number)

    def write(self, texels: NDArray[np.float32]) -> None:
        """Replace all numbers by an array of the same shape."""
        self.bind()
        pixels = np.ascontiguousarray(texels, np.float32)
        form, kind = GL.GL_RGBA, GL.GL_FLOAT
        GL.glTexSubImage2D(GL.GL_TEXTURE_2D, 0, 0, 0, *self._size, form, kind, pixels)

    def delete(self) -> None:
        """Free it."""
        GL.glDeleteTextures([self._number])
