"""Reading scenario files, with every mistake said in one line."""

from __future__ import annotations

import difflib
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from simbench.errors import ScenarioError
from simbench.scenarios.schema import Scenario

__all__ = ["library", "load_scenario", "scenario_schema"]


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
        Name of a library scenario (see `library`), or path of a YAML file.

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
    """
    text = str(name_or_path)
    if text in _library():
        path = _library()[text]
    elif text.endswith((".yaml", ".yml")) or "/" in text:
        path = Path(text)
    else:
        near = difflib.get_close_matches(text, library(), n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"there are {library()}"
        raise ScenarioError(f"unknown scenario {text!r}: {hint}")
    return _validated(_read_yaml(path), path)


def scenario_schema() -> dict[str, Any]:
    """Return the JSON Schema of scenario files, for editors that complete YAML."""
    return Scenario.model_json_schema()


class _Loader(yaml.SafeLoader):
    """YAML in which a key may stand only once in a mapping."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        """Refuse what plain YAML would take the last of, silently."""
        keys = [self.construct_object(key, deep=deep) for key, _ in node.value]
        for key, (mark, _) in zip(keys, node.value, strict=True):
            if keys.count(key) > 1:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key!r} stands twice", mark.start_mark
                )
        return super().construct_mapping(node, deep)


def _read_yaml(path: Path) -> Any:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise ScenarioError(f"{path}: cannot be read: {reason}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: must be UTF-8 text: {error}") from error
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        reason = " ".join(str(error).split())
        raise ScenarioError(f"{path}: is not YAML: {reason}") from error
    except (RecursionError, ValueError) as error:
        raise ScenarioError(f"{path}: is not usable YAML: {error}") from error


def _validated(content: Any, path: Path) -> Scenario:
    if not isinstance(content, dict):
        raise ScenarioError(
            f"{path}: wanted a mapping of keys to values, found "
            f"{type(content).__name__}"
        )
    try:
        return Scenario.model_validate(content)
    except ValidationError as error:
        raise ScenarioError(_one_line(path, error)) from error


def _one_line(path: Path, error: ValidationError) -> str:
    """Say the first mistake, and how many more there are."""
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"])
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        message = "unknown key"
    if first["type"] == "missing":
        message = "is required but missing"
    where = f"{path}: {key}" if key else f"{path}"
    value = first["input"]
    shown = "" if isinstance(value, dict | list) else f", found {str(value)[:60]!r}"
    more = error.error_count() - 1
    rest = f" (and {more} more)" if more else ""
    return " ".join(f"{where}: {message}{shown}{rest}".split())
