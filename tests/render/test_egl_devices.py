"""The choice of the OpenGL device: GPUs first, the user's wish, and what fails."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from pathlib import Path

import pytest

from simbench.core.errors import RenderError
from simbench.render.gl import offscreen
from simbench.render.gl.egl_devices import EglDevice, candidates, egl_devices

ROOT = Path(__file__).parents[2]
SOFTWARE_FIRST = [
    EglDevice(0, True, "", None),
    EglDevice(1, False, "NVIDIA H200", None),
    EglDevice(2, False, "", None),
]


def test_gpus_come_before_software_in_the_order_of_egl() -> None:
    assert [d.index for d in candidates(SOFTWARE_FIRST, "")] == [1, 2, 0]


@pytest.mark.parametrize("index", [0, 1, 2])
def test_requested_device_is_the_only_candidate(index: int) -> None:
    assert candidates(SOFTWARE_FIRST, str(index)) == [SOFTWARE_FIRST[index]]


@pytest.mark.parametrize("requested", ["3", "-1", "GPU", "1.0"])
def test_unknown_device_is_refused_with_those_that_exist(requested: str) -> None:
    with pytest.raises(RenderError) as caught:
        candidates(SOFTWARE_FIRST, requested)
    assert str(caught.value) == (
        "EGL_DEVICE_ID: expected the index of a device (0 software, 1 GPU NVIDIA H200, "
        "2 GPU), "
        f"got {requested!r}"
    )


@pytest.mark.gl
def test_device_in_use_is_one_of_those_listed() -> None:
    devices = egl_devices()
    assert [device.index for device in devices] == [*range(len(devices))]
    renderer = offscreen.describe_context()["renderer"]
    line = offscreen.describe_device()
    used = offscreen.opened_device()
    kind = "software" if used.is_software else "GPU"
    assert line.startswith(f"{used.index} {kind} ({renderer}); ")
    others = [device for device in devices if device.index != used.index]
    assert len(others) == len(devices) - 1
    assert all(str(device) in line for device in others)
    assert line.endswith("no other") == (not others)
    if len(devices) == 1 and "llvmpipe" in renderer:  # Mesa without a GPU
        assert used.is_software


@pytest.mark.gl
def test_device_that_opens_no_context_is_passed_over_with_a_warning() -> None:
    # in a process of its own: the end of a second context would end the first one, too
    program = (
        "from tests.render.test_egl_devices import _broken\n"
        "from simbench.render.gl.egl_devices import egl_devices\n"
        "from simbench.render.gl.offscreen import open_first\n"
        "print(open_first([_broken(), *egl_devices()])[0])"
    )
    done = _python(program)
    works = done.stdout.strip()
    assert works in [str(device) for device in egl_devices()]
    assert f"device {works} is used, since others open no context" in done.stderr
    assert "7 GPU: eglInitialize failed with error 0x" in done.stderr


@pytest.mark.gl
def test_failing_requested_device_is_one_line_that_names_it() -> None:
    with pytest.raises(RenderError) as caught:
        offscreen.open_first([_broken()], "7")
    message = str(caught.value)
    assert message.startswith("EGL_DEVICE_ID=7: expected a device that opens")
    assert "\n" not in message


@pytest.mark.gl
def test_failing_devices_name_the_packages_to_install() -> None:
    with pytest.raises(RenderError, match="apt-get install libegl1"):
        offscreen.open_first([_broken()])


class _Full:
    """A handle of a device whose memory is used up."""

    def get_display(self) -> None:
        from OpenGL.error import GLError

        raise GLError(err=0x3003, baseOperation="eglGetPlatformDisplayEXT")


@pytest.mark.gl
def test_gpu_without_memory_is_not_replaced_by_software() -> None:
    full = EglDevice(0, False, "", _Full())
    with pytest.raises(RenderError, match="no memory left on device 0 GPU"):
        offscreen.open_first([full, *egl_devices()])


def _broken() -> EglDevice:
    """Return a device that EGL does not know."""
    from pyrender.platforms import egl

    kind = type(egl.query_devices()[0]._display)
    unknown = ctypes.cast(ctypes.c_void_p(0x10), kind)
    return EglDevice(7, False, "", egl.EGLDevice(unknown))


def _python(program: str, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | variables,
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


@pytest.mark.gl
def test_user_chooses_the_device_by_its_index() -> None:
    program = (
        "from simbench.render.gl import offscreen as o; print(o.describe_device())"
    )
    last = egl_devices()[-1]
    chosen = _python(program, EGL_DEVICE_ID=str(last.index))
    assert chosen.stdout.startswith(f"{last.index} ")
    unknown = _python(program, EGL_DEVICE_ID="99")
    assert unknown.stderr.splitlines()[-1].endswith("got '99'")


@pytest.mark.gl
def test_machine_without_any_device_names_the_packages_to_install() -> None:
    program = "from simbench.render.gl import offscreen as o; o.context()"
    done = _python(program, __EGL_VENDOR_LIBRARY_FILENAMES="")
    assert "EGL offers no device; on Debian: apt-get install" in done.stderr
