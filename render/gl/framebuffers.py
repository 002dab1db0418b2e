"""Where the device draws to, and reading it back."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError
from simbench.render.gl import (
    offscreen,  # must come before OpenGL: it sets the platform
)
from simbench.render.world.projection import SHADOW_TEXELS, linear_depth

# isort: split
from OpenGL import GL

__all__ = ["Framebuffers", "grain_texture"]

_GRAIN_TEXELS = 256


class Framebuffers:
    """Colour, id and depth at every sample, the smoothed picture, the shadow map.

    Parameters
    ----------
    width, height : int, px
    samples : int
        Samples a pixel along each axis.
    """

    def __init__(self, width: int, height: int, samples: int) -> None:
        offscreen.make_current()
        self._size = (width, height)
        self._fine = (width * samples, height * samples)
        limit = int(GL.glGetIntegerv(GL.GL_MAX_RENDERBUFFER_SIZE))
        if max(self._fine) > limit:
            raise RenderError(
                f"a picture of {width} x {height} px at {samples} samples an axis is "
                f"too large for this OpenGL, wanted at most {limit} samples a side"
            )
        self._renderbuffers: list[int] = []
        self._fine_fb = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._fine_fb)
        self._attach(GL.GL_COLOR_ATTACHMENT0, GL.GL_RGBA8, self._fine)
        self._attach(GL.GL_COLOR_ATTACHMENT1, GL.GL_R16UI, self._fine)
        self._attach(GL.GL_DEPTH_ATTACHMENT, GL.GL_DEPTH_COMPONENT32F, self._fine)
        _require_complete()
        self._small_fb = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._small_fb)
        self._attach(GL.GL_COLOR_ATTACHMENT0, GL.GL_RGBA8, self._size)
        _require_complete()
        self._shadow_fb, self._shadow_texture = _shadow_map()

    def _attach(self, point: Any, form: Any, size: tuple[int, int]) -> None:
        buffer = GL.glGenRenderbuffers(1)
        GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, buffer)
        GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, form, *size)
        GL.glFramebufferRenderbuffer(
            GL.GL_FRAMEBUFFER, point, GL.GL_RENDERBUFFER, buffer
        )
        self._renderbuffers.append(buffer)

    def bind_picture(self) -> None:
        """Draw colour, id and depth, on a clean sheet."""
        self._bind_fine([GL.GL_COLOR_ATTACHMENT0, GL.GL_COLOR_ATTACHMENT1])

    def bind_ids_only(self) -> None:
        """Draw ids alone, on a clean sheet; the colour stays."""
        self._bind_fine([GL.GL_NONE, GL.GL_COLOR_ATTACHMENT1])

    def _bind_fine(self, targets: list[Any]) -> None:
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._fine_fb)
        GL.glViewport(0, 0, *self._fine)
        GL.glDrawBuffers(2, targets)
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glDepthMask(GL.GL_TRUE)
        GL.glDepthFunc(GL.GL_LESS)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glDisable(GL.GL_BLEND)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)
        GL.glClearBufferuiv(GL.GL_COLOR, 1, np.zeros(4, np.uint32))

    def bind_shadow(self) -> None:
        """Draw depth as the sun sees it."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._shadow_fb)
        GL.glViewport(0, 0, SHADOW_TEXELS, SHADOW_TEXELS)
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glDepthMask(GL.GL_TRUE)
        GL.glDepthFunc(GL.GL_LESS)
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)

    def bind_shadow_texture(self, unit: int) -> None:
        """Make the shadow map readable by shaders."""
        GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self._shadow_texture)

    def read(
        self, *, want_depth: bool
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.float32] | None]:
        """Return the smoothed picture, the ids and, if wanted, the depth."""
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._fine_fb)
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT0)
        GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, self._small_fb)
        corners = (0, 0, *self._fine, 0, 0, *self._size)
        # Halving with linear filtering averages each pixel's samples; other ratios
        # are averaged below, on the processor.
        is_half = self._fine[0] <= 2 * self._size[0]
        if is_half:
            GL.glBlitFramebuffer(*corners, GL.GL_COLOR_BUFFER_BIT, GL.GL_LINEAR)
            GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._small_fb)
            GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT0)
            image = _read(self._size, GL.GL_RGB, GL.GL_UNSIGNED_BYTE, np.uint8, 3)
        else:
            fine = _read(self._fine, GL.GL_RGB, GL.GL_UNSIGNED_BYTE, np.uint8, 3)
            image = _mean_of_blocks(fine, self._fine[0] // self._size[0])
        ids = self.read_ids()
        depth = None
        if want_depth:
            form, kind = GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT
            window = _read(self._fine, form, kind, np.float32, 1)[..., 0]
            step = self._fine[0] // self._size[0]
            depth = linear_depth(window[step // 2 :: step, step // 2 :: step])
        return image, ids, depth

    def read_ids(self) -> NDArray[np.uint16]:
        """Return the instance ids at every sample."""
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._fine_fb)
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT1)
        form, kind = GL.GL_RED_INTEGER, GL.GL_UNSIGNED_SHORT
        ids: NDArray[np.uint16] = _read(self._fine, form, kind, np.uint16, 1)[..., 0]
        return ids

    def delete(self) -> None:
        """Free everything."""
        GL.glDeleteFramebuffers(3, [self._fine_fb, self._small_fb, self._shadow_fb])
        GL.glDeleteRenderbuffers(len(self._renderbuffers), self._renderbuffers)
        GL.glDeleteTextures([self._shadow_texture])


def _read(
    size: tuple[int, int], form: Any, kind: Any, dtype: Any, channels: int
) -> NDArray[Any]:
    pixels = np.empty((size[1], size[0], channels), dtype)
    GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
    address = pixels.ctypes.data_as(ctypes.c_void_p)
    GL.glReadPixels(0, 0, *size, form, kind, address)
    return pixels


def _mean_of_blocks(fine: NDArray[np.uint8], block: int) -> NDArray[np.uint8]:
    height, width = fine.shape[0] // block, fine.shape[1] // block
    blocks = fine.reshape(height, block, width, block, 3).astype(np.uint16)
    total = blocks.sum(axis=(1, 3), dtype=np.uint32)
    mean: NDArray[np.uint8] = np.asarray(
        (total + block * block // 2) // (block * block), np.uint8
    )
    return mean


def _require_complete() -> None:
    status = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
    if status != GL.GL_FRAMEBUFFER_COMPLETE:
        raise RenderError(f"OpenGL refuses the picture's buffers: {int(status):#x}")


def _shadow_map() -> tuple[int, int]:
    texture = GL.glGenTextures(1)
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    form, kind = GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT
    size = (SHADOW_TEXELS, SHADOW_TEXELS)
    GL.glTexImage2D(
        GL.GL_TEXTURE_2D, 0, GL.GL_DEPTH_COMPONENT32F, *size, 0, form, kind, None
    )
    settings = {
        GL.GL_TEXTURE_MIN_FILTER: GL.GL_LINEAR,
        GL.GL_TEXTURE_MAG_FILTER: GL.GL_LINEAR,
        GL.GL_TEXTURE_WRAP_S: GL.GL_CLAMP_TO_EDGE,
        GL.GL_TEXTURE_WRAP_T: GL.GL_CLAMP_TO_EDGE,
        GL.GL_TEXTURE_COMPARE_MODE: GL.GL_COMPARE_REF_TO_TEXTURE,
        GL.GL_TEXTURE_COMPARE_FUNC: GL.GL_LEQUAL,
    }
    for name, value in settings.items():
        GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
    framebuffer = GL.glGenFramebuffers(1)
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)
    GL.glFramebufferTexture2D(
        GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, GL.GL_TEXTURE_2D, texture, 0
    )
    GL.glDrawBuffer(GL.GL_NONE)
    GL.glReadBuffer(GL.GL_NONE)
    _require_complete()
    return framebuffer, texture


def grain_texture() -> int:
    """Make the tile of noise that gives asphalt and grass their grain.

    The same tile for every scene: it belongs to the material, not to the run.
    """
    rng = np.random.default_rng(20)
    tile = np.zeros((_GRAIN_TEXELS, _GRAIN_TEXELS))
    frequency = np.fft.fftfreq(_GRAIN_TEXELS)
    radius = np.hypot(frequency[:, None], frequency[None, :])
    spectrum = np.fft.fft2(rng.standard_normal(tile.shape))
    tile = np.fft.ifft2(spectrum / np.maximum(radius, 0.01) ** 0.6).real
    tile = np.clip(0.5 + 0.18 * (tile - tile.mean()) / tile.std(), 0.0, 1.0)
    texture = GL.glGenTextures(1)
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    pixels = np.ascontiguousarray(tile * 255.0).astype(np.uint8)
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
    form, kind = GL.GL_RED, GL.GL_UNSIGNED_BYTE
    size = (_GRAIN_TEXELS, _GRAIN_TEXELS)
    GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, GL.GL_R8, *size, 0, form, kind, pixels)
    GL.glTexParameteri(
        GL.GL_TEXTURE_2D, GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR_MIPMAP_NEAREST
    )
    GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR)
    GL.glGenerateMipmap(GL.GL_TEXTURE_2D)
    number: int = texture
    return number
