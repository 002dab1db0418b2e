"""Framebuffers of the renderer: colour, ids, depth and silhouettes; reading them."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError
from simbench.render.gl import (
    offscreen,  # must come before OpenGL: it sets the platform
)
from simbench.render.gl.windows import Window
from simbench.render.world.projection import linear_depth

# isort: split
from OpenGL import GL

__all__ = ["Framebuffers"]


class Framebuffers:
    """Colour, id and depth at every sample, silhouettes, averaged image.

    Parameters
    ----------
    width, height : int, px
    samples : int
        Samples a pixel along each axis.
    """

    def __init__(self, width: int, height: int, samples: int) -> None:
        offscreen.make_current()
        self._fine = (width * samples, height * samples)
        self._step = samples
        self._image = np.empty((height, width, 3), np.uint8)
        self._ids = np.empty(self.shape, np.uint16)
        self._depth: NDArray[np.float32] | None = None
        limit = int(GL.glGetIntegerv(GL.GL_MAX_RENDERBUFFER_SIZE))
        if max(self._fine) > limit:
            raise RenderError(
                f"imaging: expected at most {limit} samples a side with this OpenGL, "
                f"got {width} x {height} px at {samples} samples an axis"
            )
        self._renderbuffers: list[int] = []
        self._fine_fb = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._fine_fb)
        self._attach(GL.GL_COLOR_ATTACHMENT0, GL.GL_RGBA8, self._fine)
        self._attach(GL.GL_COLOR_ATTACHMENT1, GL.GL_R16UI, self._fine)
        self._attach(GL.GL_DEPTH_ATTACHMENT, GL.GL_DEPTH_COMPONENT32F, self._fine)
        _require_complete()
        self._silhouette_fb = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._silhouette_fb)
        self._attach(GL.GL_COLOR_ATTACHMENT1, GL.GL_R8UI, self._fine)
        GL.glDrawBuffers(2, [GL.GL_NONE, GL.GL_COLOR_ATTACHMENT1])
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT1)
        _require_complete()

    def _attach(self, point: Any, form: Any, size: tuple[int, int]) -> None:
        buffer = GL.glGenRenderbuffers(1)
        GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, buffer)
        GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, form, *size)
        GL.glFramebufferRenderbuffer(
            GL.GL_FRAMEBUFFER, point, GL.GL_RENDERBUFFER, buffer
        )
        self._renderbuffers.append(buffer)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of samples."""
        return self._fine[1], self._fine[0]

    def bind_image(self, parts: Sequence[Window]) -> None:
        """Draw to colour, ids and depth, after clearing ids and depth of some parts."""
        self._bind_fine([GL.GL_COLOR_ATTACHMENT0, GL.GL_COLOR_ATTACHMENT1])
        for _ in self.inside(parts):
            self._clear()

    def inside(self, parts: Sequence[Window]) -> Iterator[int]:
        """Confine drawing to each of some parts in turn; yield the part's index."""
        GL.glEnable(GL.GL_SCISSOR_TEST)
        for index, (left, top, right, bottom) in enumerate(parts):
            GL.glScissor(left, top, right - left, bottom - top)
            yield index
        GL.glDisable(GL.GL_SCISSOR_TEST)

    def bind_ids_only(self) -> None:
        """Draw to ids and depth only, after clearing them; the colour is kept."""
        self._bind_fine([GL.GL_NONE, GL.GL_COLOR_ATTACHMENT1])
        self._clear()

    def bind_colour(self) -> None:
        """Draw to colour and depth only, and keep what they have."""
        self._bind_fine([GL.GL_COLOR_ATTACHMENT0, GL.GL_NONE])

    def _bind_fine(self, targets: list[Any]) -> None:
        _bind(self._fine_fb, self._fine)
        GL.glDrawBuffers(2, targets)
        GL.glDisable(GL.GL_BLEND)

    @staticmethod
    def _clear() -> None:
        GL.glClear(GL.GL_DEPTH_BUFFER_BIT)
        GL.glClearBufferuiv(GL.GL_COLOR, 1, np.zeros(4, np.uint32))

    @contextmanager
    def drawing_silhouette(self, window: Window) -> Iterator[None]:
        """Draw to the silhouette without depth, in a window that is cleared first."""
        left, top, right, bottom = window
        _bind(self._silhouette_fb, self._fine)
        GL.glDisable(GL.GL_DEPTH_TEST)
        GL.glEnable(GL.GL_SCISSOR_TEST)
        GL.glScissor(left, top, right - left, bottom - top)
        GL.glClearBufferuiv(GL.GL_COLOR, 1, np.zeros(4, np.uint32))
        try:
            yield
        finally:
            GL.glDisable(GL.GL_SCISSOR_TEST)

    def read_silhouette(self, window: Window) -> NDArray[np.bool_]:
        """Return the silhouette drawn last at every sample; False out of the window."""
        left, top, right, bottom = window
        covered = np.zeros(self.shape, np.bool_)
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._silhouette_fb)
        form, kind = GL.GL_RED_INTEGER, GL.GL_UNSIGNED_BYTE
        part = _read(window, form, kind, np.uint8, 1)[..., 0]
        covered[top:bottom, left:right] = part > 0
        return covered

    def read_ids(self, parts: Sequence[Window]) -> list[Window]:
        """Read the ids of some parts; return windows with all that is empty in these.

        They are as wide as the parts; of parts without a sample of id 0 there is none.
        """
        empty: list[Window] = []
        for part in parts:
            left, top, right, bottom = part
            ids = self._read_ids(part)
            self._ids[top:bottom, left:right] = ids
            rows = np.flatnonzero(ids.min(axis=1) == 0)
            if len(rows):
                empty.append((left, top + int(rows[0]), right, top + int(rows[-1]) + 1))
        return empty

    def read(
        self, parts: Sequence[Window], *, with_depth: bool
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint16], NDArray[np.float32] | None]:
        """Return the averaged image, the ids and, if requested, the depth.

        Only some parts, of whole pixels, are read: the others are those read before.
        The ids are those that `read_ids` has read.
        """
        for part in parts:
            left, top, right, bottom = (side // self._step for side in part)
            self._image[top:bottom, left:right] = self._read_image(part)
        if not with_depth:
            self._depth = None
            return self._image.copy(), self._ids.copy(), None
        if self._depth is None:
            self._depth = np.empty(self._image.shape[:2], np.float32)
            parts = [(0, 0, *self._fine)]
        for part in parts:
            left, top, right, bottom = (side // self._step for side in part)
            self._depth[top:bottom, left:right] = self._read_depth(part)
        return self._image.copy(), self._ids.copy(), self._depth.copy()

    def read_all_ids(self) -> NDArray[np.uint16]:
        """Return the instance ids at every sample, as drawn last."""
        return self._read_ids((0, 0, *self._fine))

    def _read_ids(self, part: Window) -> NDArray[np.uint16]:
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._fine_fb)
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT1)
        form, kind = GL.GL_RED_INTEGER, GL.GL_UNSIGNED_SHORT
        return np.asarray(_read(part, form, kind, np.uint16, 1)[..., 0], np.uint16)

    def _read_depth(self, part: Window) -> NDArray[np.float32]:
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._fine_fb)
        form, kind = GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT
        values = _read(part, form, kind, np.float32, 1)[..., 0]
        middle = slice(self._step // 2, None, self._step)
        return linear_depth(values[middle, middle])

    def _read_image(self, part: Window) -> NDArray[np.uint8]:
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self._fine_fb)
        GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT0)
        # in the buffer's own format, which is only copied; a reduced one would be drawn
        fine = _read(part, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, np.uint8, 4)
        height, width = fine.shape[0] // self._step, fine.shape[1] // self._step
        if self._step > 1:
            fine = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.cvtColor(fine, cv2.COLOR_RGBA2RGB), np.uint8)

    def delete(self) -> None:
        """Free all buffers."""
        GL.glDeleteFramebuffers(2, [self._fine_fb, self._silhouette_fb])
        GL.glDeleteRenderbuffers(len(self._renderbuffers), self._renderbuffers)


def _bind(framebuffer: int, size: tuple[int, int]) -> None:
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)
    GL.glViewport(0, 0, *size)
    GL.glEnable(GL.GL_DEPTH_TEST)
    GL.glDepthMask(GL.GL_TRUE)
    GL.glDepthFunc(GL.GL_LESS)
    GL.glDisable(GL.GL_CULL_FACE)


def _read(
    window: Window, form: Any, kind: Any, dtype: Any, channels: int
) -> NDArray[Any]:
    left, top, right, bottom = window
    pixels = np.empty((bottom - top, right - left, channels), dtype)
    GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
    address = pixels.ctypes.data_as(ctypes.c_void_p)
    GL.glReadPixels(left, top, right - left, bottom - top, form, kind, address)
    return pixels


def _require_complete() -> None:
    status = GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER)
    if status != GL.GL_FRAMEBUFFER_COMPLETE:
        raise RenderError(
            f"OpenGL: expected complete framebuffers, got status {int(status):#x}"
        )
