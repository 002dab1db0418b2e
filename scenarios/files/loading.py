"""Scenario files: finding, reading and validating them, each error in one line."""

from __future__ import annotations

import difflib
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.library import library_files, list_scenarios
from simbench.scenarios.files.samples import samples_in, schema_with_samples
from simbench.scenarios.files.variants import KEY, apply_variant, variant_names
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.strict_model import error_line
from simbench.scenarios.schema.sumo_config import with_absolute_paths

__all__ = [
    "expand_variants",
    "load_scenario",
    "load_variants",
    "read_raw_scenario",
    "scenario_schema",
    "variants_of",
]

_MAX_VALUES = 100_000
_MERGE_TAG = "tag:yaml.org,2002:merge"


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
        With one line that names file and key, what was expected and what was found.

    Examples
    --------
    >>> load_scenario("smoke").name
    'smoke'
    >>> load_scenario("car-rear-moving@extreme").variant
    'extreme'
    """
    path, _ = _located(name_or_path)
    content = read_raw_scenario(name_or_path)
    samples = samples_in(content, str(path))
    if samples:
        raise ScenarioError(
            f"{path}: {next(iter(samples))} is sampled for each seed: only generate, "
            "show and in Python load_recipe accept that, expected one value here"
        )
    try:
        return Scenario.model_validate(content)
    except ValidationError as error:
        raise ScenarioError(error_line(path, error)) from error


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
    path, _ = _located(name_or_path)
    return variant_names(_read_mapping(path), str(path))


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
    path, variant = _located(name_or_path)
    content = apply_variant(_read_mapping(path), variant, str(path))
    if "road" in content:
        try:
            content["road"] = with_absolute_paths(content["road"], path.parent)
        except ValueError as error:
            raise ScenarioError(f"{path}: road: {error}") from None
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


def _located(name_or_path: str | Path) -> tuple[Path, str]:
    """Return the file of a name or path, and the variant after its ``@``."""
    text, variant = str(name_or_path), ""
    if "@" in text and not _is_file(text):
        text, _, variant = text.rpartition("@")
        if not variant:
            raise ScenarioError(f"{text}@: expected a variant's name after the @")
    if text in library_files():
        return library_files()[text], variant
    if text.endswith((".yaml", ".yml")) or "/" in text:
        return Path(text), variant
    near = difflib.get_close_matches(text, list_scenarios(), n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {list_scenarios()}"
    raise ScenarioError(f"unknown scenario {text!r}: {hint}")


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except OSError:  # longer than a name can be
        return False


class _UniqueKeyLoader(yaml.SafeLoader):
    """YAML loader that refuses duplicate keys in a mapping."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Turn PyYAML's own failures on a value unlike its tag into YAML errors."""
        try:
            return super().construct_object(node, deep)
        except (AttributeError, LookupError, ValueError):
            tag = node.tag.rpartition(":")[2]
            raise _yaml_error(f"{str(node.value)[:60]!r} is no {tag}", node) from None

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Merge the mappings that ``<<`` names; the mapping's own keys win."""
        seen = set()
        for key_node, _ in node.value:
            if key_node.tag == _MERGE_TAG:
                continue
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise _yaml_error(f"{key!r} cannot be a key", key_node)
            if key in seen:
                raise _yaml_error(f"duplicate key {key!r}", key_node)
            seen.add(key)
        super().flatten_mapping(node)
        # each key once: merges of merges would grow exponentially
        pairs = {self.construct_object(pair[0], deep=True): pair for pair in node.value}
        node.value = list(pairs.values())


def _yaml_error(message: str, node: yaml.Node) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, message, node.start_mark)


def _read_mapping(path: Path) -> dict[str, Any]:
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: must be UTF-8 text: {error}") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ScenarioError(f"{path}: cannot be read: {reason}") from error
    try:
        content = yaml.load(text, Loader=_UniqueKeyLoader)
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise ScenarioError(f"{path}: is not YAML: {reason}") from error
    if not isinstance(content, dict):
        raise ScenarioError(
            f"{path}: expected a mapping of keys to values, got "
            f"{type(content).__name__}"
        )
    _require_bounded(path, content)
    return content


def _require_bounded(path: Path, content: dict[str, Any]) -> None:
    """Refuse content that aliases repeat endlessly, or too often for a scenario."""
    pending: list[Any] = [content]
    count = 0
    while pending:
        value = pending.pop()
        count += 1
        if count > _MAX_VALUES:
            raise ScenarioError(
                f"{path}: expected at most {_MAX_VALUES} values, got more, or an alias "
                "that contains itself"
            )
        if isinstance(value, dict):
            pending.extend(value.values())
        elif isinstance(value, list):
            pending.extend(value)
