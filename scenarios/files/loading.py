"""Scenario files: finding, reading and validating them, each error in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.locate import locate
from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.files.recipe import Recipe
from simbench.scenarios.files.samples import samples_in, schema_with_samples
from simbench.scenarios.files.variants import KEY, apply_variant, variant_names
from simbench.scenarios.files.yaml_reader import read_yaml
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.draws import Draws
from simbench.scenarios.schema.mistakes import Mistake
from simbench.scenarios.schema.sumo_config import with_absolute_paths

__all__ = [
    "expand_variants",
    "load_recipe",
    "load_recipes",
    "load_scenario",
    "load_variants",
    "read_raw_scenario",
    "scenario_schema",
    "variants_of",
]

_CHECKED_SEEDS = 8  # of which one must give a valid scenario


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Read and validate one scenario.

    Parameters
    ----------
    name_or_path : str or Path
        Name of a library scenario (see `list_scenarios`) or path of a YAML file; after
        an ``@``, one of its variants (see `variants_of`).

    Returns
    -------
    Scenario
        Of a file with samples, that of its first seed with valid values; what is
        generated of it differs by seed, see `Scenario.for_seed`.

    Raises
    ------
    ScenarioError
        With a line for each mistake: file, line, key, what was expected and what came.

    Examples
    --------
    >>> load_scenario("smoke").name
    'smoke'
    >>> load_scenario("car-rear-moving@extreme").variant
    'extreme'
    """
    recipe, scenario, seed = _first_valid(name_or_path)
    if recipe.is_fixed:
        return scenario
    draws = Draws(content=dict(recipe.content), source=recipe.source, seed=seed)
    return scenario.model_copy(update={"draws": draws})


def load_variants(name_or_path: str | Path) -> list[Scenario]:
    """Read one scenario, or for a name that ends with ``@all`` each of its variants.

    Raises
    ------
    ScenarioError
        As `load_scenario` and `expand_variants`.
    """
    return [load_scenario(name) for name in expand_variants(name_or_path)]


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
    return _first_valid(name_or_path)[0]


def _first_valid(name_or_path: str | Path) -> tuple[Recipe, Scenario, int]:
    """Read a file; return it with its first valid scenario and the seed of that."""
    source = str(name_or_path)
    recipe = Recipe(read_raw_scenario(name_or_path), source)
    samples = [key.split(".") for key in samples_in(recipe.content, source)]
    for seed in range(_CHECKED_SEEDS):
        try:
            return recipe, recipe.scenario(seed), seed
        except ScenarioError as error:
            is_last = seed == _CHECKED_SEEDS - 1
            if is_last or _is_independent(error.__cause__, samples):
                raise
    raise AssertionError("the last seed was valid or raised")


def load_recipes(name_or_path: str | Path) -> list[Recipe]:
    """Read one recipe, or for a name that ends with ``@all`` one for each variant."""
    return [load_recipe(name) for name in expand_variants(name_or_path)]


def expand_variants(name_or_path: str | Path) -> list[str]:
    """Return the name itself, or for one that ends with ``@all`` each variant's.

    Raises
    ------
    ScenarioError
        If ``@all`` finds no variant.

    Examples
    --------
    >>> expand_variants("smoke")
    ['smoke']
    """
    base, _, variant = str(name_or_path).rpartition("@")
    if not base or variant not in ("all", "*"):
        return [str(name_or_path)]
    names = variants_of(base)
    if not names:
        raise ScenarioError(f"{base}: has no variants: omit @{variant}")
    return [f"{base}@{name}" for name in names]


def variants_of(name_or_path: str | Path) -> list[str]:
    """Return the names of a scenario's variants, in its file's order.

    Examples
    --------
    >>> variants_of("car-rear-moving")
    ['standard', 'medium', 'extreme']
    """
    path, _ = locate(name_or_path)
    return variant_names(read_yaml(path), str(path))


def read_raw_scenario(name_or_path: str | Path) -> dict[str, Any]:
    """Read a scenario file and apply its variant, without validation.

    Parameters
    ----------
    name_or_path : str or Path
        As for `load_scenario`.

    Returns
    -------
    dict
        A new mapping that the caller may change.

    Raises
    ------
    ScenarioError
        If the file cannot be read, is no mapping, or has no such variant.
    """
    path, variant = locate(name_or_path)
    content = apply_variant(read_yaml(path), variant, str(path))
    if content.pop("draws", None) is not None:
        text = "is filled in when a file is read: put samples in place of values"
        raise scenario_error(path, [Mistake(("draws",), text)])
    if "road" in content:
        try:
            content["road"] = with_absolute_paths(content["road"], path.parent)
        except ValueError as error:
            raise scenario_error(path, [Mistake(("road",), str(error))]) from None
    return content


def scenario_schema() -> dict[str, Any]:
    """Return the JSON Schema of scenario files, for editors that complete YAML."""
    schema = schema_with_samples()
    # filled in, not written; null in the record of a seed
    schema["properties"]["draws"] = {"type": "null"}
    schema["properties"][KEY] = {
        "description": "Variants of the scenario: by name, the keys that change.",
        "type": "object",
        "additionalProperties": {"type": ["object", "null"]},
    }
    return schema


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
