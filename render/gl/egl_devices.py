"""The devices that EGL offers, and the order in which to try them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from simbench.core.errors import RenderError
from simbench.core.text import printable

__all__ = ["EglDevice", "candidates", "egl_devices"]

_EXTENSIONS = 0x3055
"""``EGL_EXTENSIONS``: what a device supports, as text."""
_RENDERER = 0x335F
"""``EGL_RENDERER_EXT``: the name of a device, where it tells names."""
_TELLS_NAME = "EGL_EXT_device_query_name"
"""The extension of devices that tell their names."""
_SOFTWARE = "EGL_MESA_device_software"
"""The extension by which Mesa marks its device without a GPU."""


@dataclass(frozen=True, slots=True)
class EglDevice:
    """A device of EGL, not opened yet.

    Attributes
    ----------
    index : int
        Its place in the list of ``eglQueryDevicesEXT``: a value of ``EGL_DEVICE_ID``.
    is_software : bool
        Whether the processor computes the pictures, as Mesa's llvmpipe does.
    name : str
        Such as ``NVIDIA H200``; empty where EGL does not tell.
    handle : pyrender.platforms.egl.EGLDevice
    """

    index: int
    is_software: bool
    name: str
    handle: Any  # pyrender is untyped

    def __str__(self) -> str:
        """Return index, kind and, where known, name, such as ``0 GPU NVIDIA H200``."""
        kind = "software" if self.is_software else "GPU"
        return f"{self.index} {kind} {self.name}".rstrip()


def egl_devices() -> list[EglDevice]:
    """Return the devices of ``eglQueryDevicesEXT``; no context is opened.

    The default display stands for all devices where EGL cannot list them.
    """
    from pyrender.platforms import egl

    if egl._eglQueryDevicesEXT is None:
        return [EglDevice(0, False, "", egl.EGLDevice(None))]
    return [_described(*numbered) for numbered in enumerate(egl.query_devices())]


def _described(index: int, handle: Any) -> EglDevice:
    extensions = _text(handle, _EXTENSIONS).split()
    name = _text(handle, _RENDERER) if _TELLS_NAME in extensions else ""
    return EglDevice(index, _SOFTWARE in extensions, name, handle)


def _text(handle: Any, what: int) -> str:
    from pyrender.platforms import egl

    if egl._eglQueryDeviceStringEXT is None:
        return ""
    text: bytes | None = egl._eglQueryDeviceStringEXT(handle._display, what)
    return printable((text or b"").decode(errors="replace"))


def candidates(devices: Sequence[EglDevice], requested: str) -> list[EglDevice]:
    """Return the devices to try, the preferred first.

    Parameters
    ----------
    devices : sequence of EglDevice
        Of this machine.
    requested : str
        The user's ``EGL_DEVICE_ID``: only that device is tried. If empty, all are:
        GPUs first, each kind in the order of EGL.

    Raises
    ------
    RenderError
        If there is no such device.
    """
    if not requested:
        return sorted(devices, key=lambda device: device.is_software)
    found = [device for device in devices if str(device.index) == requested.strip()]
    if not found:
        offered = ", ".join(map(str, devices))
        raise RenderError(
            f"EGL_DEVICE_ID: expected the index of a device ({offered}), "
            f"got {requested!r}"
        )
    return found
