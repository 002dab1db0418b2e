"""A small scenario for tests, on an empty straight road."""

from __future__ import annotations

from typing import Any

from simbench.scenarios.schema import Scenario

__all__ = ["small_scenario"]


def small_scenario(**parts: Any) -> Scenario:
    """Return a valid scenario, with the given top-level parts in place of its own."""
    content: dict[str, Any] = {
        "name": "story",
        "title": "A story",
        "tests": "One thing at a time.",
        "frames": 3,
        "road": {"lanes": 2, "before_m": 100, "sections": [{"length_m": 400}]},
        "traffic": {"density_per_km_lane": 0, "warm_up_s": 0},
        "target": {"lane": 0, "along_m": 40, "speed_mps": 15},
        "surroundings": {"guard_rails": False, "tree_spacing_m": None},
        "camera": {
            "position": {"along_m": 0, "lateral_m": -7.25, "height_m": 1.5},
            "look_at": {"along_m": 40, "lateral_m": -7.25, "height_m": 1.5},
            "fov_rad": 0.2,
        },
        "imaging": {"width_px": 160, "height_px": 120, "noise": 0, "blur_px": 0},
    }
    return Scenario.model_validate(content | parts)
