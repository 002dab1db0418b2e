"""The offscreen OpenGL context: one for each process, by EGL, without a display.

It sets what must be set before pyrender is imported: modules that import pyrender or
OpenGL import this one first.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence
from functools import cache
from typing import Any

from simbench.core.errors import RenderError, one_line
from simbench.render.gl import lazy_pyrender  # noqa: F401  # before parts of pyrender
from simbench.render.gl.egl_devices import EglDevice, candidates, egl_devices

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

__all__ = [
    "context",
    "describe_context",
    "describe_device",
    "make_current",
    "open_first",
    "opened_device",
]

logger = logging.getLogger(__name__)

_BAD_ALLOC = 0x3003
"""``EGL_BAD_ALLOC``: the device has no memory left."""


def context() -> Any:  # Any: pyrender is untyped
    """Open this process's OpenGL context and make it current.

    By default it is that of the first GPU whose context opens, else of Mesa's software
    renderer; of the device whose index is ``EGL_DEVICE_ID``, if that is set.

    pyrender terminates the shared EGL display when it deletes any context: there is
    only one, kept as long as the process runs.

    Raises
    ------
    RenderError
        If no context can be opened; the message names the packages to install. If
        ``EGL_DEVICE_ID`` is no device's index, or that device opens no context.
    """
    return _opened()[1]


def opened_device() -> EglDevice:
    """Return the device of this process's context, opening that if there is none."""
    return _opened()[0]


@cache
def _opened() -> tuple[EglDevice, Any]:
    requested = os.environ.get("EGL_DEVICE_ID", "")
    try:
        devices = egl_devices()
    except Exception as error:  # EGL raises exceptions of many types
        raise _no_context(one_line(error)) from error
    if not devices:
        raise _no_context("EGL offers no device")
    return open_first(candidates(devices, requested), requested)


def open_first(
    devices: Sequence[EglDevice], requested: str = ""
) -> tuple[EglDevice, Any]:
    """Return the first device that opens a context, and its pyrender platform.

    Parameters
    ----------
    devices : sequence of EglDevice
        In the order in which to try them.
    requested : str
        The user's ``EGL_DEVICE_ID``, for messages.

    Raises
    ------
    RenderError
        If none opens a context, or one has no memory left: its neighbour processes
        render with it, and the frames of two devices must not be mixed.
    """
    refused: list[str] = []
    for device in devices:
        try:
            platform = _open(device)
        except Exception as error:  # EGL raises exceptions of many types
            reason = f"device {device}: {_what_failed(error)}"
            if getattr(error, "err", None) == _BAD_ALLOC:
                raise RenderError(f"EGL: no memory left on {reason}") from error
            refused.append(reason)
            continue
        if refused:
            logger.warning(
                "OpenGL: device %s is used, since others open no context: %s",
                device,
                "; ".join(refused),
            )
        return device, platform
    if requested:
        raise RenderError(
            f"EGL_DEVICE_ID={requested}: expected a device that opens an OpenGL 4.1 "
            f"context, got {refused[0]}"
        )
    raise _no_context("; ".join(refused))


def _open(device: EglDevice) -> Any:
    from pyrender.platforms import egl

    platform = egl.EGLPlatform(64, 64, device=device.handle)
    platform.init_context()
    platform.make_current()
    return platform


def _what_failed(error: Exception) -> str:
    operation, code = (getattr(error, name, None) for name in ("baseOperation", "err"))
    if operation is None or code is None:
        return one_line(error)
    name = getattr(operation, "__name__", str(operation))
    return f"{name} failed with error {int(code):#x}"


def _no_context(reason: str) -> RenderError:
    return RenderError(
        "no offscreen OpenGL context can be opened (expected EGL with OpenGL 4.1): "
        f"{reason[:400]}; on Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri "
        "libx11-6 libxext6 libxrender1"
    )


def make_current() -> None:
    """Make this process's context current, opening it if there is none."""
    context().make_current()


def describe_context() -> dict[str, str]:
    """Return vendor, renderer and version of the OpenGL in use."""
    make_current()
    from OpenGL import GL

    def text(name: Any) -> str:
        value = GL.glGetString(name)
        return value.decode() if isinstance(value, bytes) else str(value)

    return {
        "vendor": text(GL.GL_VENDOR),
        "renderer": text(GL.GL_RENDERER),
        "version": text(GL.GL_VERSION),
    }


def describe_device() -> str:
    """Return one line: which device renders, and which others EGL offers.

    For example ``0 GPU (NVIDIA H200/PCIe/SSE2); others, by EGL_DEVICE_ID: 1 software``.
    """
    renderer = describe_context()["renderer"]
    used = opened_device()
    kind = "software" if used.is_software else "GPU"
    others = [str(device) for device in egl_devices() if device.index != used.index]
    rest = f"others, by EGL_DEVICE_ID: {', '.join(others)}" if others else "no other"
    return f"{used.index} {kind} ({renderer}); {rest}"
