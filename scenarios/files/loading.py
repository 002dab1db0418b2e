"""Reading scenario files, with every mistake said in one line."""

from __future__ import annotations

import difflib
from collections.abc import Hashable
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.sample_schema import schema_with_samples
from simbench.scenarios.files.samples import samples_in
from simbench.scenarios.files.variants import KEY, apply_variant, variant_names
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.road import SITE_KINDS
from simbench.scenarios.schema.sumo_config import placed

__all__ = [
    "library",
    "load_scenario",
    "load_variants",
    "mistake_line",
    "names_of",
    "read_raw_scenario",
    "scenario_schema",
    "variants_of",
]


@cache
def _library() -> dict[str, Path]:
    folder = Path(str(resources.files("simbench.scenarios"))) / "library"
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def library() -> list[str]:
    """Return the names of the scenarios that ship with simbench, sorted."""
    return list(_library())


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Read and validate one scenario.

    Parameters
    ----------
    name_or_path : str or Path
        Name of a library scenario (see `library`), or path of a YAML file. After an
        ``@``, one of its variants (see `variants_of`).

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        With one line that names file, key, what was wanted and what came.

    Examples
    --------
    >>> load_scenario("smoke").name
    'smoke'
    >>> load_scenario("car-rear-moving@extreme").variant
    'extreme'
    """
    path, _ = _found(str(name_or_path))
    content = read_raw_scenario(name_or_path)
    drawn = next(iter(samples_in(content, str(path))), None)
    if drawn is not None:
        raise ScenarioError(
            f"{path}: {drawn} is drawn anew for each seed: only generate and show take "
            f"such a file (in Python load_recipe), here it must be one value"
        )
    return _validated(content, path)


def load_variants(name_or_path: str | Path) -> list[Scenario]:
    """Read the scenarios that a name stands for: one, or with ``@all`` every variant.

    Raises
    ------
    ScenarioError
        As `load_scenario`; and where ``@all`` finds no variant.
    """
    return [load_scenario(name) for name in names_of(name_or_path)]


def names_of(name_or_path: str | Path) -> list[str]:
    """Return the name itself, or for one that ends with ``@all`` each variant's.

    Raises
    ------
    ScenarioError
        Where ``@all`` finds no variant.

    Examples
    --------
    >>> names_of("smoke")
    ['smoke']
    """
    base, _, variant = str(name_or_path).rpartition("@")
    if not base or variant not in ("all", "*"):
        return [str(name_or_path)]
    names = variants_of(base)
    if not names:
        raise ScenarioError(f"{base}: has no variants: leave @{variant} out")
    return [f"{base}@{name}" for name in names]


def variants_of(name_or_path: str | Path) -> list[str]:
    """Return the names of a scenario's variants, in its file's order.

    Examples
    --------
    >>> variants_of("car-rear-moving")
    ['standard', 'medium', 'extreme']
    """
    path, _ = _found(str(name_or_path))
    return variant_names(_read_mapping(path), str(path))


def read_raw_scenario(name_or_path: str | Path) -> dict[str, Any]:
    """Read a scenario file as it stands, its variant applied, not validated yet.

    Parameters
    ----------
    name_or_path : str or Path
        As for `load_scenario`.

    Returns
    -------
    dict
        A mapping of one's own to change.

    Raises
    ------
    ScenarioError
        If the file cannot be read, is no mapping, or has no such variant.
    """
    path, variant = _found(str(name_or_path))
    content = apply_variant(_read_mapping(path), variant, str(path))
    if "road" in content:
        try:
            content["road"] = placed(content["road"], path.parent)
        except ValueError as error:
            raise ScenarioError(f"{path}: road: {error}") from None
    return content


def scenario_schema() -> dict[str, Any]:
    """Return the JSON Schema of scenario files, for editors that complete YAML."""
    schema = schema_with_samples(Scenario.model_json_schema())
    schema["properties"][KEY] = {
        "description": "The same story told otherwise: by name, the keys that change.",
        "type": "object",
        "additionalProperties": {"type": ["object", "null"]},
    }
    return schema


def _found(text: str) -> tuple[Path, str]:
    """Return the file that a name or path means, and the variant after the ``@``."""
    if "@" in text and not _is_file(text):
        text, _, variant = text.rpartition("@")
        if not variant:
            raise ScenarioError(f"{text}@: wanted a variant's name after the @")
    else:
        variant = ""
    if text in _library():
        return _library()[text], variant
    if text.endswith((".yaml", ".yml")) or "/" in text:
        return Path(text), variant
    near = difflib.get_close_matches(text, library(), n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {library()}"
    raise ScenarioError(f"unknown scenario {text!r}: {hint}")


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except OSError:  # longer than a name can be
        return False


_MOST_VALUES = 100_000
_MERGE = "tag:yaml.org,2002:merge"


class _Loader(yaml.SafeLoader):
    """YAML in which a key may stand only once in a mapping."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Say where a value is not what its tag says: PyYAML only stumbles."""
        try:
            return super().construct_object(node, deep)
        except (AttributeError, LookupError, ValueError):
            kind = node.tag.rpartition(":")[2]
            raise _fault(f"{str(node.value)[:60]!r} is no {kind}", node) from None

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Merge what ``<<`` names; the mapping's own keys win, each standing once."""
        seen = set()
        for mark, _ in node.value:
            if mark.tag == _MERGE:
                continue
            key = self.construct_object(mark, deep=True)
            if not isinstance(key, Hashable):
                raise _fault(f"{key!r} is no key", mark)
            if key in seen:
                raise _fault(f"{key!r} stands twice", mark)
            seen.add(key)
        super().flatten_mapping(node)
        # once each, or merges of merges would grow without end
        pairs = {self.construct_object(pair[0], deep=True): pair for pair in node.value}
        node.value = list(pairs.values())


def _fault(said: str, node: yaml.Node) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, said, node.start_mark)


def _read_yaml(path: Path) -> Any:
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: must be UTF-8 text: {error}") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ScenarioError(f"{path}: cannot be read: {reason}") from error
    try:
        content = yaml.load(text, Loader=_Loader)
    except (yaml.YAMLError, RecursionError, ValueError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise ScenarioError(f"{path}: is not YAML: {reason}") from error
    _require_small(path, content)
    return content


def _require_small(path: Path, content: Any) -> None:
    """Refuse what aliases blow up, without end or to more than a scenario can hold."""
    todo, count = [content], 0
    while todo:
        part = todo.pop()
        count += 1
        if count > _MOST_VALUES:
            raise ScenarioError(
                f"{path}: wanted at most {_MOST_VALUES} values, found more, or an "
                "alias that stands for itself"
            )
        if isinstance(part, dict):
            todo.extend(part.values())
        elif isinstance(part, list):
            todo.extend(part)


def _read_mapping(path: Path) -> dict[str, Any]:
    content = _read_yaml(path)
    if not isinstance(content, dict):
        raise ScenarioError(
            f"{path}: wanted a mapping of keys to values, found "
            f"{type(content).__name__}"
        )
    return content


def _validated(content: dict[str, Any], path: Path) -> Scenario:
    try:
        return Scenario.model_validate(content)
    except ValidationError as error:
        raise ScenarioError(mistake_line(path, error)) from error


def mistake_line(path: str | Path, error: ValidationError) -> str:
    """Say the first mistake in one line, and how many more there are."""
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"] if part not in SITE_KINDS)
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        message = "unknown key"
    if first["type"] == "missing":
        message = "is required but missing"
    if first["type"] in ("model_type", "dict_type"):
        message = "must hold keys and values"
    if first["type"] == "tuple_type":
        message = "must be a list"
    where = f"{path}: {key}" if key else f"{path}"
    value = first["input"]
    shown = "" if isinstance(value, dict | list) else f", found {str(value)[:60]!r}"
    more = error.error_count() - 1
    rest = f" (and {more} more)" if more else ""
    return " ".join(f"{where}: {message}{shown}{rest}".split())
