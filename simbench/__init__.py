"""simbench: a test bench for vehicle trackers.

Traffic is simulated and rendered, trackers run on the frames, and their tracks are
scored against exact ground truth. The names below are imported when first used, so that
a tracker plug-in that needs only the contract (`Tracker`, `Estimate`, `Box`, `Frame`)
loads neither SUMO nor OpenGL.

Examples
--------
>>> import simbench
>>> scenario = simbench.load_scenario("smoke")
>>> sequence = simbench.generate(scenario, seed=0)
>>> track = simbench.track("condensation", sequence)
>>> scores = simbench.score(track, sequence)
>>> scores.runs["tracker"].tolist()
['condensation']
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simbench.core.box import Box
    from simbench.core.frame import Frame
    from simbench.core.sequence import Sequence, Truth
    from simbench.core.tracker import Diagnostics, Estimate, Track, Tracker
    from simbench.datasets.read_clip import read_sequence
    from simbench.evaluation.run_tracker import track
    from simbench.evaluation.score_track import score
    from simbench.evaluation.scores import Scores
    from simbench.evaluation.tracker_checks import check_tracker
    from simbench.experiments.python_api import evaluate, run, sweep
    from simbench.generation.generate import generate
    from simbench.scenarios.files.library import list_scenarios
    from simbench.scenarios.files.loading import load_scenario
    from simbench.scenarios.schema import Scenario
    from simbench.trackers.find_tracker import list_trackers

__version__ = "0.2.0"

__all__ = [
    "Box",
    "Diagnostics",
    "Estimate",
    "Frame",
    "Scenario",
    "Scores",
    "Sequence",
    "Track",
    "Tracker",
    "Truth",
    "__version__",
    "check_tracker",
    "evaluate",
    "generate",
    "list_scenarios",
    "list_trackers",
    "load_scenario",
    "read_sequence",
    "run",
    "score",
    "sweep",
    "track",
]

_HOMES = {
    "Box": "core.box",
    "Diagnostics": "core.tracker",
    "Estimate": "core.tracker",
    "Frame": "core.frame",
    "Scenario": "scenarios.schema",
    "Scores": "evaluation.scores",
    "Sequence": "core.sequence",
    "Track": "core.tracker",
    "Tracker": "core.tracker",
    "Truth": "core.sequence",
    "check_tracker": "evaluation.tracker_checks",
    "evaluate": "experiments.python_api",
    "generate": "generation.generate",
    "list_scenarios": "scenarios.files.library",
    "list_trackers": "trackers.find_tracker",
    "load_scenario": "scenarios.files.loading",
    "read_sequence": "datasets.read_clip",
    "run": "experiments.python_api",
    "score": "evaluation.score_track",
    "sweep": "experiments.python_api",
    "track": "evaluation.run_tracker",
}


def __getattr__(name: str) -> Any:  # Any: the names have different types
    if name not in _HOMES:
        raise AttributeError(f"module 'simbench' has no attribute {name!r}")
    found = getattr(importlib.import_module(f"simbench.{_HOMES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
