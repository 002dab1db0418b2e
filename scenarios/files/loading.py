"""Scenario files: finding, reading and validating them, each error in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.locate import locate
from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.files.samples import samples_in, schema_with_samples
from simbench.scenarios.files.variants import KEY, apply_variant, variant_names
from simbench.scenarios.files.yaml_reader import read_yaml
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.mistakes import Mistake, mistakes_in
from simbench.scenarios.schema.sumo_config import with_absolute_paths

__all__ = [
    "expand_variants",
    "load_scenario",
    "load_variants",
    "read_raw_scenario",
    "scenario_schema",
    "variants_of",
]


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
    content = read_raw_scenario(name_or_path)
    samples = samples_in(content, str(name_or_path))
    if samples:
        text = (
            "is sampled for each seed: only generate, show and in Python load_recipe "
            "accept that, expected one value here"
        )
        mistakes = [Mistake(tuple(key.split(".")), text) for key in samples]
        raise scenario_error(name_or_path, mistakes)
    try:
        return Scenario.model_validate(content)
    except ValidationError as error:
        mistakes = mistakes_in(error, Scenario)
        raise scenario_error(name_or_path, mistakes) from error


def load_variants(name_or_path: str | Path) -> list[Scenario]:
    """Read one scenario, or for a name that ends with ``@all`` each of its variants.

    Raises
    ------
    ScenarioError
        As `load_scenario` and `expand_variants`.
    """
    return [load_scenario(name) for name in expand_variants(name_or_path)]


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
    if "road" in content:
        try:
            content["road"] = with_absolute_paths(content["road"], path.parent)
        except ValueError as error:
            raise scenario_error(path, [Mistake(("road",), str(error))]) from None
    return content


def scenario_schema() -> dict[str, Any]:
    """Return the JSON Schema of scenario files, for editors that complete YAML."""
    schema = schema_with_samples()
    schema["properties"][KEY] = {
        "description": "Variants of the scenario: by name, the keys that change.",
        "type": "object",
        "additionalProperties": {"type": ["object", "null"]},
    }
    return schema
