"""simbench: a test bench for vehicle trackers.

Traffic is simulated, filmed and scored; see `load_scenario`, `generate`, `track` and
`score`. They are imported when first used, so that a tracker plug-in that only needs
the contracts (`simbench.tracker`, `simbench.box`) loads neither SUMO nor OpenGL.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simbench.generation import generate
    from simbench.scenarios.loading import load_scenario
    from simbench.scores import score
    from simbench.tracking import track

__all__ = ["__version__", "generate", "load_scenario", "score", "track"]

__version__ = "0.1.0"

_HOMES = {
    "generate": "simbench.generation",
    "load_scenario": "simbench.scenarios.loading",
    "score": "simbench.scores",
    "track": "simbench.tracking",
}


def __getattr__(name: str) -> Any:  # Any: the four have four types
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'simbench' has no attribute {name!r}")
