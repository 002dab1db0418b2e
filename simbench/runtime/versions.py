"""Versions of the libraries and the machine that results were computed with."""

from __future__ import annotations

import os
import platform
import re
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import simbench

__all__ = ["core_count", "host", "versions"]

_DISTRIBUTIONS = {
    "libsumo": ("libsumo",),
    "numpy": ("numpy",),
    "numba": ("numba",),
    "pyarrow": ("pyarrow",),
    "opencv": ("opencv-python-headless", "opencv-contrib-python-headless"),
    "pyrender": ("pyrender", "pyrender-maintained"),
    "PyOpenGL": ("PyOpenGL",),
    "trimesh": ("trimesh",),
    "scipy": ("scipy",),
    "sumo-data": ("sumo-data",),
    "isal": ("isal",),
}
_VECTORS = re.compile(r"(avx|fma|sse4|amx|asimd|sve|neon)\w*")
"""Names of instruction sets for which compilers make code that rounds differently."""


def versions() -> dict[str, str]:
    """Return versions by name: Python, simbench and the libraries that decide results.

    Returns
    -------
    dict from str to str
        Empty for a library that is not installed. ``instructions`` are the processor's
        vector instructions, for which numba and Mesa compile.
    """
    found = {
        "python": platform.python_version(),
        "simbench": simbench.__version__,
        "instructions": _vector_instructions(),
    }
    return found | {name: _version(*of) for name, of in _DISTRIBUTIONS.items()}


def host() -> dict[str, str | int]:
    """Return system, processor and cores; not the machine's name."""
    return {
        "system": platform.platform(),
        "processor": _processor(),
        "cores": core_count(),
    }


def core_count() -> int:
    """Return the cores this process may use."""
    return len(os.sched_getaffinity(0))


def _version(*distributions: str) -> str:
    for name in distributions:
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return ""


def _processor() -> str:
    return _of_processor("model name") or platform.machine()


@cache
def _vector_instructions() -> str:
    flags = f"{_of_processor('flags')} {_of_processor('Features')}".split()
    return " ".join(sorted(filter(_VECTORS.fullmatch, flags)))


def _of_processor(key: str) -> str:
    """Return a line of Linux's description of the first processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return ""
    pairs = (line.partition(":") for line in lines)
    return next((text.strip() for name, _, text in pairs if name.strip() == key), "")
