"""Which networks are trained, and where their weights are."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml
from pydantic import ValidationError

from simbench.core.atomic_write import atomic_write
from simbench.learning.recipe import read_recipe, shipped_recipe
from simbench.learning.training import find_training
from simbench.trackers.parts.weights_file import card_path

__all__ = ["ABLATIONS", "NETWORKS", "WHOLE", "Network", "write_recipe"]

ROOT: Final = Path(__file__).parents[2]
NETWORKS: Final = ("siamfc", "siambox", "cfnet", "mdnet")
"""Trackers whose training has the same name."""
WHOLE: Final = "as shipped"

_HIDING: Final = ("trees-dusk", "overtaken-by-truck", "cut-in", "weave")
"""Scenarios of the recipes in which something passes in front of vehicles."""


@dataclass(frozen=True, slots=True)
class Network:
    """One training.

    Attributes
    ----------
    tracker : str
        One of `NETWORKS`.
    variant : str
        `WHOLE`, or a name of `ABLATIONS`.
    seed : int
    """

    tracker: str
    variant: str
    seed: int

    @property
    def label(self) -> str:
        """Name of its files, and of its rows."""
        parts = [self.tracker, str(self.seed)]
        if self.variant != WHOLE:
            parts.insert(1, self.variant.replace(" ", "-"))
        return "-".join(parts)

    def recipe(self) -> dict[str, Any]:
        """Return its recipe, as cards state it."""
        kind = find_training(self.tracker).recipe
        found = read_recipe(shipped_recipe(self.tracker), kind).model_dump(mode="json")
        if self.variant != WHOLE:
            change = ABLATIONS[self.variant]
            found = _half_as_long(found)
            change(found)
        return kind.model_validate(found).model_dump(mode="json")

    def weights(self, folder: Path) -> Path | None:
        """Return the file of its weights: in a folder, or shipped; None if neither.

        What counts is the card: network, seed and recipe are those asked for.
        """
        shipped = ROOT / "trackers" / "weights" / self.tracker / "weights.npz"
        for path in (folder / f"{self.label}.npz", shipped):
            if path.is_file() and self._is_of(card_of(path)):
                return path
        return None

    def _is_of(self, card: Mapping[str, Any]) -> bool:
        if (card["name"], card["seed"]) != (self.tracker, self.seed):
            return False
        kind = find_training(self.tracker).recipe
        try:  # keys that came later have their defaults
            stated = kind.model_validate(card["recipe"]).model_dump(mode="json")
        except ValidationError:
            return False
        return stated == self.recipe()


def card_of(weights: Path) -> dict[str, Any]:
    """Return the card beside a file of weights."""
    found: dict[str, Any] = json.loads(card_path(weights).read_text(encoding="utf-8"))
    return found


def write_recipe(network: Network, folder: Path) -> Path:
    """Write a network's recipe to a folder, and return the file."""
    path = folder / f"{network.label}.yaml"
    with atomic_write(path) as temporary:
        temporary.write_text(yaml.safe_dump(network.recipe()), encoding="utf-8")
    return path


def _half_as_long(recipe: dict[str, Any]) -> dict[str, Any]:
    found = deepcopy(recipe)
    found["schedule"]["iterations"] //= 2
    return found


def _nothing(recipe: dict[str, Any]) -> None:
    """Change nothing: what the other ablations are compared with."""


def _no_photometry(recipe: dict[str, Any]) -> None:
    recipe["photometry"] = None


def _quarter_of_films(recipe: dict[str, Any]) -> None:
    films = recipe["films"]
    films["scenarios"] = films["scenarios"][::2]
    films["seeds"] = films["seeds"][:1]


def _no_occluders(recipe: dict[str, Any]) -> None:
    _without(recipe, lambda name: name in _HIDING)
    recipe["pairs"]["occluder"] = 0.0
    recipe["crops"]["least_visible"] = 0.99


def _no_turning_cameras(recipe: dict[str, Any]) -> None:
    _without(recipe, lambda name: name.endswith("-moving"))


def _without(recipe: dict[str, Any], is_out: Callable[[str], bool]) -> None:
    films = recipe["films"]
    films["scenarios"] = [name for name in films["scenarios"] if not is_out(name)]


ABLATIONS: Final[Mapping[str, Callable[[dict[str, Any]], None]]] = {
    "half as long": _nothing,
    "photometry off": _no_photometry,
    "a quarter of the films": _quarter_of_films,
    "without occluders": _no_occluders,
    "without turning cameras": _no_turning_cameras,
}
"""Changes of the recipe of siamfc by name; all train half as long."""
