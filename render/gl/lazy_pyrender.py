"""Makes parts of pyrender importable without the whole package.

``import pyrender.primitive`` executes ``pyrender/__init__.py`` first, which imports
trimesh, SciPy, networkx and a window system: a second of processor time in every
process that renders, for nothing. After this module is imported, it is executed only
when something asks the package itself for a name, such as ``pyrender.Scene``.
"""

from __future__ import annotations

import importlib.util
import sys
from typing import Any

__all__: list[str] = []


def _make_lazy(package: str) -> None:
    """Register a package whose own code runs at the first use of one of its names."""
    if package in sys.modules or (spec := importlib.util.find_spec(package)) is None:
        return
    module, loader = importlib.util.module_from_spec(spec), spec.loader

    def load(name: str) -> Any:
        if name.startswith("__") or loader is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        del module.__dict__["__getattr__"]
        loader.exec_module(module)
        return getattr(module, name)

    module.__dict__["__getattr__"] = load
    sys.modules[package] = module


_make_lazy("pyrender")
