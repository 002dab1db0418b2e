"""Scenarios that differ by seed: the one of a seed, with the changes made since."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.files.recipe import Recipe
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.mistakes import mistakes_in

__all__ = ["drawn"]


def drawn(scenario: Scenario, seed: int) -> Scenario:
    """Return the scenario of a seed, see `Scenario.for_seed`.

    What was changed since the file was read (dials, a variant's name, a part replaced)
    is changed in the same way, whatever the seed samples there.

    Raises
    ------
    ScenarioError
        In one line that names key and value, if the sampled values are invalid
        together.
    """
    draws = scenario.draws
    if draws is None:
        return scenario
    recipe = Recipe(draws.content, draws.source, draws.frames)
    found = recipe.scenario(seed).model_dump()
    read = recipe.scenario(draws.seed).model_dump()
    now = scenario.model_copy(update={"draws": None}).model_dump()
    try:
        return Scenario.model_validate(_with_changes(found, read, now))
    except ValidationError as error:
        raise scenario_error(draws.source, mistakes_in(error, Scenario)) from error


def _with_changes(found: Any, read: Any, now: Any) -> Any:
    """Return a value with what differs between two others."""
    if read == now:
        return found
    parts = found, read, now
    if all(isinstance(part, Mapping) for part in parts):
        if found.keys() == read.keys() == now.keys():
            return {key: _with_changes(*(one[key] for one in parts)) for key in found}
    return now
