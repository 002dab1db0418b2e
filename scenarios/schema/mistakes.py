"""Mistakes of a scenario file as text: key, what was expected, what came."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, get_args, get_origin

from pydantic import BaseModel, ValidationError

from simbench.core.text import did_you_mean
from simbench.scenarios.schema.strict_model import types_in

__all__ = ["Mistake", "Mistakes", "mistakes_in", "types_at"]

ROAD_TAGS = ("<carriageway>", "<floor>", "<network>")
"""Tags of the kinds of road: part of pydantic's error locations, not of files."""

_EXPECTED = {
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "dict_type": "a mapping of keys to values",
    "finite_number": "a finite number",
    "float_parsing": "a number",
    "float_type": "a number",
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number of fewer digits",
    "int_type": "a whole number",
    "less_than": "less than {lt:g}",
    "less_than_equal": "at most {le:g}",
    "literal_error": "{expected}",
    "model_type": "a mapping of keys to values",
    "string_pattern_mismatch": "text that matches {pattern}",
    "string_too_long": "at most {max_length} characters",
    "string_too_short": "at least {min_length} characters",
    "string_type": "text",
    "too_long": "at most {max_length} items",
    "too_short": "at least {min_length} items",
    "tuple_type": "a list",
}
"""What was expected, by pydantic's type of error, with the values of its context."""
_LONGEST = 60  # characters of a key or a value


class Mistake(NamedTuple):
    """One mistake: the key, by its parts, and one line that says what is wrong."""

    key: tuple[str, ...]
    text: str

    def __str__(self) -> str:
        """Return ``key.path: text``."""
        return ": ".join(filter(None, [_printable(".".join(self.key)), self.text]))


class Mistakes(ValueError):
    """Several mistakes that one validator found.

    Parameters
    ----------
    mistakes : iterable of Mistake
        At least one.
    """

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        self.mistakes = tuple(mistakes)
        super().__init__("; ".join(map(str, self.mistakes)))


def mistakes_in(
    error: ValidationError, model: type[BaseModel], key: Sequence[str] = ()
) -> list[Mistake]:
    """Return the mistakes in a validation error, in its order.

    Parameters
    ----------
    error : pydantic.ValidationError
    model : type
        What was validated.
    key : sequence of str
        Key of what was validated, if it is part of a scenario.
    """
    found: list[Mistake] = []
    for one in error.errors(include_url=False):
        place = tuple(
            str(part) for part in one["loc"] if part not in (*ROAD_TAGS, "[key]")
        )
        context = one.get("ctx", {})
        if one["type"] == "too_short" and len(one["input"]) >= context["min_length"]:
            continue  # long enough, but for the items that are mistakes themselves
        cause = context.get("error")
        if isinstance(cause, Mistakes):
            parts = [((*key, *place, *each.key), each.text) for each in cause.mistakes]
            found += [Mistake(*part) for part in parts]
        else:
            text = _text(one, model, place)
            found.append(Mistake((*key, *place), " ".join(text.split())))
    return found


def types_at(model: type[BaseModel], key: Iterable[str]) -> set[Any]:
    """Return the types that the value at a key of a model may have."""
    allowed: set[Any] = {model}
    for part in key:
        allowed = {inner for outer in allowed for inner in _inner_types(outer, part)}
    return allowed


def _inner_types(outer: Any, part: str) -> Iterator[Any]:
    """Return the types that a part of a value of type ``outer`` may have."""
    if get_origin(outer) is dict:
        yield from types_in(get_args(outer)[1])
    elif get_origin(outer) in (tuple, list):
        for argument in get_args(outer):
            yield from types_in(argument)
    elif isinstance(outer, type) and issubclass(outer, BaseModel):
        if part in outer.model_fields:
            yield from types_in(outer.model_fields[part].annotation)


def _text(one: Any, model: type[BaseModel], place: tuple[str, ...]) -> str:
    kind, value, context = one["type"], one["input"], one.get("ctx", {})
    if kind == "missing":
        return "is required but missing"
    if kind == "extra_forbidden":
        hint = did_you_mean(place[-1], _keys_at(model, place[:-1]))
        return f"unknown key{hint}, got {_shown(value)}"
    if kind not in _EXPECTED:
        message = one["msg"].removeprefix("Value error, ")
        has_value = ", got " in message or isinstance(value, dict | list)
        return message if has_value else f"{message}, got {_shown(value)}"
    expected = _EXPECTED[kind].format_map(context)
    if kind == "literal_error":
        expected += did_you_mean(value, re.findall(r"'([^']*)'", context["expected"]))
    return f"expected {expected}, got {_shown(value)}"


def _keys_at(model: type[BaseModel], key: tuple[str, ...]) -> list[str]:
    kinds = [kind for kind in types_at(model, key) if isinstance(kind, type)]
    return sorted(
        {
            name
            for kind in kinds
            if issubclass(kind, BaseModel)
            for name in kind.model_fields
        }
    )


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return "a mapping" if value else "an empty mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if value is None:
        return "null"
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _printable(key: str) -> str:
    text = "".join(one if one.isprintable() else "?" for one in key)
    return text if len(text) <= 2 * _LONGEST else f"{text[: 2 * _LONGEST]}..."
