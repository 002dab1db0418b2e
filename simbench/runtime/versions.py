"""Versions of the libraries and the machine that results were computed with."""

from __future__ import annotations

import os
import platform
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
}


def versions() -> dict[str, str]:
    """Return versions by name: Python, simbench and the libraries that decide results.

    Returns
    -------
    dict from str to str
        Empty for a library that is not installed.
    """
    found = {"python": platform.python_version(), "simbench": simbench.__version__}
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
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if "model name" in line)
    return next(named, platform.machine())
