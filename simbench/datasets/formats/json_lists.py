"""JSON objects whose lists are too long to hold: written piece by piece."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

__all__ = ["json_object"]


def json_object(
    parts: Mapping[str, Mapping[str, Any] | Iterable[Any]],
) -> Iterator[str]:
    r"""Yield the text of an object, the items of its lists one at a time.

    Parameters
    ----------
    parts : mapping from str to mapping or iterable
        An iterable becomes a list: it is walked through once, when its place in the
        text has come.

    Yields
    ------
    str
        Joined, they are one JSON object, a line an item.

    Examples
    --------
    >>> "".join(json_object({"a": {"b": 1}, "c": iter([2, 3]), "d": []}))
    '{"a":{"b":1},\n"c":[\n2,\n3],\n"d":[]}\n'
    """
    between = "{"
    for name, part in parts.items():
        yield f"{between}{_text(name)}:"
        yield from [_text(part)] if isinstance(part, Mapping) else _list(part)
        between = ",\n"
    yield "}\n"


def _list(items: Iterable[Any]) -> Iterator[str]:
    between = "[\n"
    for item in items:
        yield between + _text(item)
        between = ",\n"
    yield "[]" if between == "[\n" else "]"


def _text(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)
