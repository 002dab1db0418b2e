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
from simbench.scenarios.files.samples import is_sample

__all__ = ["KEY", "apply_variant", "variant_names"]

KEY = "variants"
"""Key of the variants in a scenario file."""

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
        raise ScenarioError(
            f"{where}: {KEY}: expected a mapping of names to changes, got "
            f"{type(variants).__name__}"
        )
    for name, changes in variants.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name) or name == "all":
            raise ScenarioError(
                f"{where}: {KEY}: a name must consist of a-z, 0-9 and -, and not be "
                f"'all', got {name!r}"
            )
        if not isinstance(changes, dict | None):
            raise ScenarioError(
                f"{where}: {KEY}.{name}: expected a mapping of keys to values, got "
                f"{type(changes).__name__}"
            )
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
        raise ScenarioError(f"{where}: unknown variant {variant!r}: {existing}")
    place = f"{where}: {KEY}.{variant}"
    changes = _nested(variants[variant] or {}, place)
    for key in _FIXED_KEYS:
        if key in changes:
            raise ScenarioError(f"{place}: a variant must not change {key}")
    _merge(result, changes)
    return result | {"variant": variant}


def _nested(changes: dict[Any, Any], place: str) -> dict[str, Any]:
    """Split dotted keys into nested mappings; refuse two values for one key."""
    nested: dict[str, Any] = {}
    for key, value in changes.items():
        if isinstance(value, dict):
            value = _nested(value, f"{place}.{key}")
        first, *parts = str(key).split(".")
        for part in reversed(parts):
            value = {part: value}
        _join(nested, {first: value}, place)
    return nested


def _join(known: dict[str, Any], new: dict[str, Any], place: str) -> None:
    for key, value in new.items():
        if key not in known:
            known[key] = value
        elif isinstance(known[key], dict) and isinstance(value, dict):
            _join(known[key], value, f"{place}.{key}")
        else:
            raise ScenarioError(f"{place}.{key}: is given twice")


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
