"""Variants of a scenario: named changes to the values of its file.

A file may end with::

    variants:
      standard: {}
      extreme: {imaging.keep_every: 5, camera: {fov_rad: 0.3}}

Keys are nested or dotted. A mapping changes the keys it names and leaves the others;
any other value, also a list, replaces the value at its key.
"""

from __future__ import annotations

import re
from typing import Any

from simbench.core.errors import ScenarioError
from simbench.core.text import did_you_mean
from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.files.samples import is_sample
from simbench.scenarios.schema.mistakes import Mistake, Mistakes

__all__ = ["KEY", "apply_variant", "variant_names"]

KEY = "variants"
"""Key of the variants in a scenario file."""

Key = tuple[str, ...]

_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,63}")
_FIXED_KEYS = ("name", "tests", "variant", KEY)  # they identify the scenario


def variant_names(content: dict[str, Any], where: str) -> list[str]:
    """Return the names of a file's variants, in its order.

    Parameters
    ----------
    content : dict
        The scenario file's mapping.
    where : str
        The file, for messages.

    Raises
    ------
    ScenarioError
        If ``variants`` is not a mapping of names to mappings.
    """
    variants = content.get(KEY)
    if variants is None:
        return []
    if not isinstance(variants, dict):
        text = f"expected a mapping of names to changes, got {type(variants).__name__}"
        raise scenario_error(where, [Mistake((KEY,), text)])
    mistakes = []
    for name, changes in variants.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name) or name == "all":
            text = (
                "a name must consist of a-z, 0-9 and -, and not be 'all', got "
                f"{name!r:.60}"
            )
            mistakes.append(Mistake((KEY,), text))
        elif not isinstance(changes, dict | None):
            kind = type(changes).__name__
            text = f"expected a mapping of keys to values, got {kind}"
            mistakes.append(Mistake((KEY, name), text))
    if mistakes:
        raise scenario_error(where, mistakes)
    return list(variants)


def apply_variant(content: dict[str, Any], variant: str, where: str) -> dict[str, Any]:
    """Return a file's content with the changes of one of its variants.

    Parameters
    ----------
    content : dict
        The scenario file's mapping; left as it is.
    variant : str
        One of `variant_names`, or empty for the content without changes.
    where : str
        The file, for messages.

    Returns
    -------
    dict
        A copy without ``variants``; with ``variant`` if one was requested.

    Raises
    ------
    ScenarioError
        If there is no such variant, or it changes a fixed key.
    """
    names = variant_names(content, where)
    result: dict[str, Any] = _without_aliases(content)
    variants = result.pop(KEY, None)
    if not variant:
        return result
    if variant not in names:
        existing = f"there are {names}" if names else "it has none"
        hint = did_you_mean(variant, names)
        raise ScenarioError(
            f"{where}: unknown variant {variant[:60]!r}{hint}: {existing}"
        )
    place = KEY, variant
    try:
        changes = _nested(variants[variant] or {}, place)
    except Mistakes as error:
        raise scenario_error(where, error.mistakes) from None
    fixed = [key for key in _FIXED_KEYS if key in changes]
    if fixed:
        mistakes = [Mistake(place, f"a variant must not change {key}") for key in fixed]
        raise scenario_error(where, mistakes)
    _merge(result, changes)
    return result | {"variant": variant}


def _nested(changes: dict[Any, Any], place: Key) -> dict[str, Any]:
    """Split dotted keys into nested mappings; refuse two values for one key."""
    nested: dict[str, Any] = {}
    for key, value in changes.items():
        if isinstance(value, dict):
            value = _nested(value, (*place, str(key)))
        first, *parts = str(key).split(".")
        for part in reversed(parts):
            value = {part: value}
        _join(nested, {first: value}, place)
    return nested


def _join(known: dict[str, Any], new: dict[str, Any], place: Key) -> None:
    for key, value in new.items():
        if key not in known:
            known[key] = value
        elif isinstance(known[key], dict) and isinstance(value, dict):
            _join(known[key], value, (*place, key))
        else:
            raise Mistakes([Mistake((*place, key), "is given twice")])


def _merge(content: dict[str, Any], changes: dict[str, Any]) -> None:
    for key, value in changes.items():
        known = content.get(key)
        both_are_parts = isinstance(known, dict) and isinstance(value, dict)
        if both_are_parts and not is_sample(known) and not is_sample(value):
            _merge(content[key], value)
        else:
            content[key] = value


def _without_aliases(value: Any) -> Any:
    """Copy a value so that no two places share one, as with YAML's aliases."""
    if isinstance(value, dict):
        return {key: _without_aliases(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_aliases(item) for item in value]
    return value
