"""Variants: one story told several ways, as changes to the scenario file's own values.

A file may end with::

    variants:
      standard: {}
      extreme: {imaging.keep_every: 5, camera: {fov_rad: 0.3}}

Keys are nested or dotted. A mapping changes the keys it names and leaves the others;
any other value, a list too, takes the place of what stood there.
"""

from __future__ import annotations

import re
from typing import Any

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.samples import is_sample

__all__ = ["KEY", "apply_variant", "variant_names"]

KEY = "variants"
"""Where variants stand in a scenario file."""

_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,63}")
_FIXED = ("name", "tests", "variant", KEY)
"""What makes it the same story: no variant changes these."""


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
            f"{where}: {KEY}: wanted a mapping of names to changes, found "
            f"{type(variants).__name__}"
        )
    for name, changes in variants.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name) or name == "all":
            raise ScenarioError(
                f"{where}: {KEY}: a name must be of a-z, 0-9 and -, and not 'all', "
                f"found {name!r}"
            )
        if not isinstance(changes, dict | None):
            raise ScenarioError(
                f"{where}: {KEY}.{name}: wanted a mapping of keys to values, found "
                f"{type(changes).__name__}"
            )
    return list(variants)


def apply_variant(content: dict[str, Any], variant: str, where: str) -> dict[str, Any]:
    """Return a file's content as one of its variants tells it.

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
        A copy without ``variants``; ``variant`` stands in it where one was asked for.

    Raises
    ------
    ScenarioError
        If there is no such variant, or it changes what it may not.
    """
    names = variant_names(content, where)
    changed = {key: _copied(one) for key, one in content.items() if key != KEY}
    if not variant:
        return changed
    if variant not in names:
        there = f"there are {names}" if names else "it has none"
        raise ScenarioError(f"{where}: unknown variant {variant!r}: {there}")
    place = f"{where}: {KEY}.{variant}"
    changes = _nested(content[KEY][variant] or {}, place)
    for key in _FIXED:
        if key in changes:
            raise ScenarioError(f"{place}: a variant must not change {key}")
    _merge(changed, changes)
    return changed | {"variant": variant}


def _nested(changes: dict[Any, Any], place: str) -> dict[str, Any]:
    """Take dotted keys apart; two keys that say the same thing are an error."""
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
        is_draw_there = is_sample(known) or is_sample(value)  # one value, not a part's
        if isinstance(known, dict) and isinstance(value, dict) and not is_draw_there:
            _merge(known, value)
        else:
            content[key] = _copied(value)


def _copied(value: Any) -> Any:
    """Copy each place by itself: YAML's aliases let two places share one value."""
    if isinstance(value, dict):
        return {key: _copied(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_copied(one) for one in value]
    return value
