"""simbench: a test bench for vehicle trackers.

Traffic is simulated, filmed and scored; see `load_scenario`, `generate`, `track` and
`score`. They are imported when first used, so that a tracker plug-in that only needs
the contract (`simbench.core.tracker`) loads neither SUMO nor OpenGL.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simbench.evaluation.run_tracker import track
    from simbench.evaluation.scores import score
    from simbench.generation.generate import generate
    from simbench.scenarios.files.loading import load_scenario

__all__ = ["__version__", "generate", "load_scenario", "score", "track"]

__version__ = "0.1.0"

_HOMES = {
    "generate": "simbench.generation.generate",
    "load_scenario": "simbench.scenarios.files.loading",
    "score": "simbench.evaluation.scores",
    "track": "simbench.evaluation.run_tracker",
}


def __getattr__(name: str) -> Any:  # Any: the four have four types
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'simbench' has no attribute {name!r}")
