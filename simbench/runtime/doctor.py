"""Check that everything the bench needs is installed and works."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Literal

from simbench import __version__
from simbench.runtime.versions import core_count

__all__ = ["Diagnosis", "examine"]

_LIBRARIES = "libegl1 libgl1 libgl1-mesa-dri libx11-6 libxext6 libxrender1 libatomic1"
_APT = f"apt-get install {_LIBRARIES}"
_INSTALL = "pip install simbench-tracking"
_CONTRIB = (
    "pip uninstall -y opencv-python-headless; "
    "pip install opencv-contrib-python-headless"
)
_TIMEOUT_S = 60.0

# Each runs in its own process: a library that crashes is a result too.
_CHECK_OPENGL = """
from simbench.render.gl.offscreen import describe_context
print(*describe_context().values(), sep=" | ")
"""
_CHECK_DEVICE = """
from simbench.render.gl.offscreen import describe_device
print(describe_device())
"""
_CHECK_SUMO = "import libsumo; print(libsumo.getVersion()[1].removeprefix('SUMO '))"
_CHECK_OPENCV = "import cv2; print(cv2.__version__)"
_CHECK_OPENCV_TRACKERS = """
from simbench.trackers.parts.opencv_build import CONTRIB, WEIGHTS, opencv_tracker_names
found = {name.rpartition(".")[2] for name in opencv_tracker_names()}
parts = [", ".join(sorted(found)) or "none"]
parts += [", ".join(WEIGHTS) + " with weights of yours"]
lacking = [name for name in CONTRIB if name not in found]
parts += ["without " + ", ".join(lacking)] if lacking else []
print("; ".join(parts))
"""
_CHECK_NUMBA = """
import numba
if numba.njit(lambda x: x + 1)(1) != 2:
    raise SystemExit("compiles, but computes 1 + 1 wrongly")
print(numba.__version__)
"""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Result of one check of the installation.

    Attributes
    ----------
    name : str
        What was checked.
    state : {"ok", "missing", "absent"}
        Present; required and missing; optional and missing.
    found : str
        Version or description, or one line about the problem.
    remedy : str
        Command that repairs it; empty where nothing is wrong.
    """

    name: str
    state: Literal["ok", "missing", "absent"]
    found: str
    remedy: str = ""


def examine() -> list[Diagnosis]:
    """Check everything that the bench requires or can use, in a few seconds."""
    return [
        Diagnosis("Python", "ok", f"{platform.python_version()} in {sys.prefix}"),
        Diagnosis("simbench", "ok", __version__),
        _run_check("SUMO", _CHECK_SUMO, _APT),
        *_opengl(),
        _run_check("OpenCV", _CHECK_OPENCV, _INSTALL),
        _opencv_trackers(),
        _run_check("numba", _CHECK_NUMBA, _INSTALL),
        _installed("pyrender", "pyrender", "pyrender-maintained"),
        Diagnosis("cores", "ok", str(core_count())),
        _chromium(shutil.which),
    ]


def _opengl() -> list[Diagnosis]:
    """Check OpenGL and, if it works, tell which device renders."""
    opengl = _run_check("OpenGL, offscreen", _CHECK_OPENGL, _APT)
    if opengl.state == "ok":
        return [opengl, _run_check("OpenGL device", _CHECK_DEVICE, _APT)]
    if "EGL_DEVICE_ID" in opengl.found:
        return [replace(opengl, remedy="unset EGL_DEVICE_ID")]
    return [opengl]


def _opencv_trackers() -> Diagnosis:
    """Tell which trackers of OpenCV are there; those of contrib are optional."""
    found = _run_check("OpenCV's trackers", _CHECK_OPENCV_TRACKERS, _INSTALL)
    if found.state == "ok" and "without" in found.found:
        return replace(found, state="absent", remedy=_CONTRIB)
    return found


def _run_check(name: str, program: str, remedy: str) -> Diagnosis:
    """Run a Python program; the last line that it prints is the result."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Diagnosis(name, "missing", f"no answer in {_TIMEOUT_S:g} s", remedy)
    if done.returncode == 0:
        return Diagnosis(name, "ok", _last_line(done.stdout))
    said = _last_line(done.stderr) or f"exit status {done.returncode}"
    if done.returncode < 0:
        said = f"crashed with signal {-done.returncode}"
    return Diagnosis(name, "missing", said, remedy)


def _installed(name: str, *distributions: str) -> Diagnosis:
    for distribution in distributions:
        try:
            return Diagnosis(name, "ok", version(distribution))
        except PackageNotFoundError:
            continue
    return Diagnosis(name, "missing", "not installed", _INSTALL)


def _chromium(which: Callable[[str], str | None]) -> Diagnosis:
    for program in ("chromium", "chromium-browser", "google-chrome"):
        path = which(program)
        if path is not None:
            return Diagnosis("Chromium", "ok", path)
    note = "not found; only the report's tests need it"
    return Diagnosis("Chromium", "absent", note, "apt-get install chromium")


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""
