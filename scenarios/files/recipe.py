"""Recipes: scenario files with random samples, which give one scenario per seed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.loading import expand_variants, read_raw_scenario
from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.files.samples import resolve_samples, samples_in
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.mistakes import mistakes_in
from simbench.scenarios.schema.sumo_config import with_file_digests

__all__ = ["Recipe", "load_recipe", "load_recipes"]

_MAX_SHOWN = 4  # sampled values in a message
_CHECKED_SEEDS = 8  # of which one must give a valid scenario


@dataclass(frozen=True)
class Recipe:
    """A scenario file that gives a scenario for each seed, different if it has samples.

    Attributes
    ----------
    content : mapping
        The file's mapping, its variant applied; see `simbench.scenarios.files.samples`.
    source : str
        Name or path that was loaded, for messages.
    most_frames : int or None
        Maximum number of frames of its scenarios.
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
        """Name and, if there is one, variant: the stem of its sequences' names."""
        variant = self.content.get("variant", "")
        return f"{self.name}-{variant}" if variant else self.name

    @property
    def is_fixed(self) -> bool:
        """Whether it gives the same scenario for every seed."""
        return not samples_in(self.content, self.source)

    @property
    def digest(self) -> str:
        """SHA-256 over content and frame limit, as hex; of files by their content."""
        content = {**self.content, "road": with_file_digests(self.content.get("road"))}
        text = json.dumps([content, self.most_frames], sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()

    def shortened(self, frames: int | None) -> Recipe:
        """Return the recipe of the same scenarios, cut after ``frames`` frames."""
        return replace(self, most_frames=frames)

    def scenario(self, seed: int) -> Scenario:
        """Return the scenario of a seed: the same for the same seed.

        Raises
        ------
        ScenarioError
            With one line that names key and value, if the sampled values are invalid
            together.
        """
        content, values = resolve_samples(self.content, self.name, seed, self.source)
        try:
            scenario = Scenario.model_validate(content)
        except ValidationError as error:
            raise scenario_error(
                self.source,
                mistakes_in(error, Scenario),
                lambda line: _sampled(line, values, seed),
            ) from error
        if self.most_frames is None:
            return scenario
        return scenario.shortened(self.most_frames)


def load_recipe(name_or_path: str | Path) -> Recipe:
    """Read a scenario file that may contain random samples.

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
        With one line, if the file cannot be read, a sample is invalid, or the file is
        invalid whatever is sampled. Mistakes that only some sampled values make are
        found by `Recipe.scenario`.

    Examples
    --------
    >>> recipe = load_recipe("smoke")
    >>> recipe.is_fixed, recipe.scenario(7).name
    (True, 'smoke')
    """
    source = str(name_or_path)
    recipe = Recipe(read_raw_scenario(name_or_path), source)
    samples = [key.split(".") for key in samples_in(recipe.content, source)]
    for seed in range(_CHECKED_SEEDS):
        try:
            recipe.scenario(seed)
        except ScenarioError as error:
            is_last = seed == _CHECKED_SEEDS - 1
            if is_last or _is_independent(error.__cause__, samples):
                raise
        else:
            break
    return recipe


def load_recipes(name_or_path: str | Path) -> list[Recipe]:
    """Read one recipe, or for a name that ends with ``@all`` one for each variant."""
    return [load_recipe(name) for name in expand_variants(name_or_path)]


def _is_independent(cause: BaseException | None, samples: list[list[str]]) -> bool:
    """Whether one of the mistakes occurs whatever is sampled."""
    if not isinstance(cause, ValidationError):
        return True
    places = [[str(part) for part in one["loc"]] for one in cause.errors()]
    return not all(any(_overlap(place, key) for key in samples) for place in places)


def _overlap(place: list[str], sample: list[str]) -> bool:
    """Whether a mistake is at a sample, within it, or in a part that contains it."""
    if len(place) < len(sample):
        return sample[: len(place)] == place
    parts = iter(place)  # pydantic inserts the tags of union members
    return all(part in parts for part in sample)


def _sampled(line: str, values: Mapping[str, Any], seed: int) -> str:
    """Return the sampled values that a message names, or if it names none, all."""
    named = {key: value for key, value in values.items() if key in line} or values
    shown = [f"{key} = {value}" for key, value in named.items()][:_MAX_SHOWN]
    return f" (seed {seed} sampled {', '.join(shown)})" if shown else ""
