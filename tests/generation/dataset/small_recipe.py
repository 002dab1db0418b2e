"""A recipe whose sequences take no time: an empty road, two small pictures."""

from __future__ import annotations

from typing import Any

from simbench.scenarios.files.recipe import Recipe
from tests.scenarios.small_scenario import small_scenario


def small_recipe(name: str = "small", **parts: Any) -> Recipe:
    """Return a recipe of two frames; ``parts`` may hold draws."""
    content = small_scenario(name=name, frames=2).model_dump(
        mode="json", exclude_unset=True
    )
    content["imaging"] = {"width_px": 96, "height_px": 64, "samples": 1}
    return Recipe(content | parts, f"{name}.yaml")
