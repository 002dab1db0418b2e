"""Textures on the graphics device: grain, light maps and the shadow map's format."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl import offscreen  # noqa: F401  # before OpenGL: sets the platform

# isort: split
from OpenGL import GL

__all__ = ["MapTexture", "grain_texture", "make_texture"]

_GRAIN_TEXELS = 256


def make_texture(
    internal: Any,
    form: Any,
    size: tuple[int, int],
    pixels: NDArray[Any] | None,
    **parameters: Any,
) -> int:
    """Make and bind a 2D texture with linear filtering; return its number.

    Parameters
    ----------
    internal, form : OpenGL enum
        Format on the device, and of ``pixels``: uint8 or float32.
    size : (int, int)
        Columns and rows.
    pixels : array or None
        None leaves the content undefined.
    **parameters : OpenGL enum
        Texture parameters without their prefix, such as ``WRAP_S``.
    """
    texture: int = GL.glGenTextures(1)
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    is_bytes = pixels is not None and pixels.dtype == np.uint8
    kind = GL.GL_UNSIGNED_BYTE if is_bytes else GL.GL_FLOAT
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
    GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, internal, *size, 0, form, kind, pixels)
    linear = {"MIN_FILTER": GL.GL_LINEAR, "MAG_FILTER": GL.GL_LINEAR}
    for name, value in (linear | parameters).items():
        key = getattr(GL, f"GL_TEXTURE_{name}")
        GL.glTexParameteri(GL.GL_TEXTURE_2D, key, value)
    return texture


class MapTexture:
    """An (R, C, 4) float32 array on the device, read with linear interpolation.

    Parameters
    ----------
    texels : (R, C, 4) float32
    unit : int
        Texture unit at which shaders read it.
    edge : bool
        Whether the values at the border continue outside; else they are 0 there.
    """

    def __init__(self, texels: NDArray[np.float32], unit: int, *, edge: bool) -> None:
        self._unit = unit
        self._size = texels.shape[1], texels.shape[0]
        GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
        wrap = GL.GL_CLAMP_TO_EDGE if edge else GL.GL_CLAMP_TO_BORDER
        pixels = np.ascontiguousarray(texels, np.float32)
        self._number = make_texture(
            GL.GL_RGBA32F, GL.GL_RGBA, self._size, pixels, WRAP_S=wrap, WRAP_T=wrap
        )

    def bind(self) -> None:
        """Bind the texture to its unit."""
        GL.glActiveTexture(GL.GL_TEXTURE0 + self._unit)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._number)

    def write(self, texels: NDArray[np.float32]) -> None:
        """Replace the content by an array of the same shape, and bind it."""
        self.bind()
        pixels = np.ascontiguousarray(texels, np.float32)
        form, kind = GL.GL_RGBA, GL.GL_FLOAT
        GL.glTexSubImage2D(GL.GL_TEXTURE_2D, 0, 0, 0, *self._size, form, kind, pixels)

    def delete(self) -> None:
        """Free the texture."""
        GL.glDeleteTextures([self._number])


def grain_texture() -> int:
    """Make the noise texture of asphalt and grass, the same for every scene.

    llvmpipe reads floats faster than bytes.
    """
    size = (_GRAIN_TEXELS, _GRAIN_TEXELS)
    texture = make_texture(
        GL.GL_R32F, GL.GL_RED, size, _grain(), MIN_FILTER=GL.GL_LINEAR_MIPMAP_NEAREST
    )
    GL.glGenerateMipmap(GL.GL_TEXTURE_2D)
    return texture


@cache
def _grain() -> NDArray[np.float32]:
    """Return noise in [0, 1] whose waves are the stronger the longer they are."""
    rng = np.random.default_rng(20)
    frequency = np.fft.fftfreq(_GRAIN_TEXELS)
    radius = np.hypot(frequency[:, None], frequency[None, :])
    spectrum = np.fft.fft2(rng.standard_normal((_GRAIN_TEXELS, _GRAIN_TEXELS)))
    tile = np.fft.ifft2(spectrum / np.maximum(radius, 0.01) ** 0.6).real
    tile = np.clip(0.5 + 0.18 * (tile - tile.mean()) / tile.std(), 0.0, 1.0)
    return np.ascontiguousarray(tile, np.float32)
