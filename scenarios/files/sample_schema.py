"""Where in a scenario file draws may stand, as the schema knows it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.strict import kinds_of

__all__ = ["NEVER_DRAWN", "schema_with_samples", "takes_whole_numbers"]

NEVER_DRAWN = ("name", "variant")
"""What names sequences, and so must not depend on the seed."""

_DRAW_SCHEMA = {
    "description": "A value that each seed draws anew.",
    "oneOf": [
        {
            "type": "object",
            "properties": {
                "range": {
                    "type": "array",
                    "items": {"type": "number"},
                    "minItems": 2,
                    "maxItems": 2,
                },
                "log": {"type": "boolean"},
            },
            "required": ["range"],
            "additionalProperties": False,
        },
        {
            "type": "object",
            "properties": {
                "choice": {"type": "array", "minItems": 1},
                "weights": {"type": "array", "items": {"type": "number", "minimum": 0}},
            },
            "required": ["choice"],
            "additionalProperties": False,
        },
    ],
}


def schema_with_samples(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario file's JSON Schema in which a draw may stand for any value."""
    parts = {name: _or_draw(part) for name, part in schema["$defs"].items()}
    return {**_or_draw(schema), "$defs": parts | {"Draw": _DRAW_SCHEMA}}


def _or_draw(part: Mapping[str, Any]) -> dict[str, Any]:
    changed = dict(part)
    if "properties" in part:
        changed["properties"] = {
            key: value
            if key in NEVER_DRAWN
            else {"anyOf": [value, {"$ref": "#/$defs/Draw"}]}
            | {note: value[note] for note in ("title", "description") if note in value}
            for key, value in part["properties"].items()
        }
    return changed


def takes_whole_numbers(key: tuple[str, ...]) -> bool:
    """Whether the schema has whole numbers, and no others, at a key.

    Examples
    --------
    >>> takes_whole_numbers(("frames",))
    True
    >>> takes_whole_numbers(("road", "sections", "0", "length_m"))
    False
    """
    kinds: set[Any] = {Scenario}
    for part in key:
        kinds = {inner for kind in kinds for inner in _inside(kind, part)}
    return int in kinds and float not in kinds


def _inside(kind: Any, part: str) -> Iterator[Any]:
    """Return the types that ``part`` may have within a value of a type."""
    if get_origin(kind) is dict:
        yield from kinds_of(get_args(kind)[1])
    elif get_origin(kind) in (tuple, list):
        for one in get_args(kind):
            yield from kinds_of(one)
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        field = kind.model_fields.get(part)
        yield from kinds_of(field.annotation) if field is not None else ()
