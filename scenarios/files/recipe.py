"""Recipes: scenario files in which values may be drawn, a scenario for every seed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.loading import mistake_line, names_of, read_raw_scenario
from simbench.scenarios.files.samples import drawn, samples_in
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.sumo_config import by_content

__all__ = ["Recipe", "load_recipe", "load_recipes"]

_SHOWN = 4  # drawn values in a message
_TRIES = 8  # seeds of which one must give a scenario


@dataclass(frozen=True)
class Recipe:
    """A scenario file that tells another scenario by seed where it holds draws.

    Attributes
    ----------
    content : mapping
        The file's mapping, its variant applied; see `simbench.scenarios.files.samples`.
    source : str
        What it was asked for as, for messages.
    most_frames : int or None
        Where the story is cut.
    """

    content: Mapping[str, Any]
    source: str
    most_frames: int | None = None

    @property
    def name(self) -> str:
        """Name of its scenarios."""
        return str(self.content.get("name", ""))

    @property
    def label(self) -> str:
        """Name and, where there is one, variant: what sequences are named after."""
        variant = self.content.get("variant", "")
        return f"{self.name}-{variant}" if variant else self.name

    @property
    def is_fixed(self) -> bool:
        """Whether it tells the same scenario for every seed."""
        return not samples_in(self.content, self.source)

    @property
    def digest(self) -> str:
        """SHA-256 over content and cut, as hex; of files by what they hold."""
        told = {**self.content, "road": by_content(self.content.get("road"))}
        text = json.dumps([told, self.most_frames], sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()

    def shortened(self, frames: int | None) -> Recipe:
        """Return the recipe of the same stories cut after ``frames`` frames."""
        return replace(self, most_frames=frames)

    def scenario(self, seed: int) -> Scenario:
        """Return the scenario that a seed draws: the same for the same seed.

        Raises
        ------
        ScenarioError
            With one line that names key and value, if what was drawn does not go
            together.
        """
        content, values = drawn(self.content, self.name, seed, self.source)
        try:
            scenario = Scenario.model_validate(content)
        except ValidationError as error:
            line = mistake_line(self.source, error)
            raise ScenarioError(line + _blamed(line, values, seed)) from error
        if self.most_frames is None:
            return scenario
        return scenario.shortened(self.most_frames)


def load_recipe(name_or_path: str | Path) -> Recipe:
    """Read a scenario file that may hold draws.

    Parameters
    ----------
    name_or_path : str or Path
        As for `simbench.load_scenario`.

    Returns
    -------
    Recipe

    Raises
    ------
    ScenarioError
        With one line, if the file cannot be read, a draw cannot be drawn from, or
        something is wrong whatever is drawn. Values that only some draws make wrong
        show when they are drawn.

    Examples
    --------
    >>> recipe = load_recipe("smoke")
    >>> recipe.is_fixed, recipe.scenario(7).name
    (True, 'smoke')
    """
    source = str(name_or_path)
    recipe = Recipe(read_raw_scenario(name_or_path), source)
    draws = [key.split(".") for key in samples_in(recipe.content, source)]
    mistakes = []
    for seed in range(_TRIES):
        try:
            recipe.scenario(seed)
        except ScenarioError as error:
            mistakes.append(error)
            if _is_certain(error.__cause__, draws):
                break
        else:
            return recipe
    raise mistakes[-1]


def load_recipes(name_or_path: str | Path) -> list[Recipe]:
    """Read the recipes that a name stands for: one, or with ``@all`` every variant."""
    return [load_recipe(name) for name in names_of(name_or_path)]


def _is_certain(cause: BaseException | None, draws: list[list[str]]) -> bool:
    """Whether one of the mistakes is there whatever is drawn."""
    if not isinstance(cause, ValidationError):
        return True
    places = [[str(part) for part in one["loc"]] for one in cause.errors()]
    return not all(any(_touch(place, draw) for draw in draws) for place in places)


def _touch(place: list[str], draw: list[str]) -> bool:
    """Whether a mistake is at a draw, in it, or in what the draw is part of."""
    if len(place) < len(draw):
        return draw[: len(place)] == place
    parts = iter(place)  # pydantic puts the names of a union's members in between
    return all(part in parts for part in draw)


def _blamed(line: str, values: Mapping[str, Any], seed: int) -> str:
    """Return which drawn values a message is about, all of them if it names none."""
    named = {key: value for key, value in values.items() if key in line} or values
    shown = [f"{key} = {value}" for key, value in named.items()][:_SHOWN]
    return f" (seed {seed} drew {', '.join(shown)})" if shown else ""
