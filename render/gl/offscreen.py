"""The offscreen OpenGL context: one for each process, by EGL, without a display.

It sets what must be set before pyrender is imported: modules that import pyrender or
OpenGL import this one first.
"""

from __future__ import annotations

import os
from functools import cache
from typing import Any

from simbench.core.errors import RenderError

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

__all__ = ["context", "describe_context", "make_current"]


@cache
def context() -> Any:  # Any: pyrender is untyped
    """Open this process's OpenGL context and make it current.

    pyrender terminates the shared EGL display when it deletes any context: there is
    only one, kept as long as the process runs.

    Raises
    ------
    RenderError
        If no context can be opened; the message names the packages to install.
    """
    try:
        from pyrender.platforms import egl

        device = egl.get_device_by_index(int(os.environ.get("EGL_DEVICE_ID", "0")))
        platform = egl.EGLPlatform(64, 64, device=device)
        platform.init_context()
        platform.make_current()
    except Exception as error:  # EGL raises exceptions of many types
        raise RenderError(
            "no offscreen OpenGL context can be opened (expected EGL with OpenGL 3.3): "
            f"{type(error).__name__}: {' '.join(str(error).split())[:200]}; on Debian: "
            "apt-get install libegl1 libgl1 libgl1-mesa-dri"
        ) from error
    return platform


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
