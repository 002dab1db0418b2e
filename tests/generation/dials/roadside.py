"""Scenario for tests of the dials: a car passes a camera beside the road."""

from __future__ import annotations

from typing import Any

from simbench.scenarios.schema import Scenario
from tests.scenarios.small_scenario import small_scenario

__all__ = ["roadside"]


def roadside(**parts: Any) -> Scenario:
    """Return the scenario, with the given top-level parts in place of its own."""
    content: dict[str, Any] = {
        "frames": 40,
        "target": {"lane": 1, "along_m": 0, "speed_mps": 15},
        "road": {"lanes": 3, "before_m": 100, "sections": [{"length_m": 400}]},
        "camera": {
            "position": {"along_m": 12, "lateral_m": -40, "height_m": 4},
            "look_at": {"along_m": 12, "lateral_m": -5, "height_m": 0.7},
            "fov_rad": 0.75,
        },
        "imaging": {"width_px": 240, "height_px": 120, "noise": 0, "blur_px": 0},
        "light": {"shadows": False},
    }
    return small_scenario(**(content | parts))
