"""The base of every part of the scenario file."""

from __future__ import annotations

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, model_validator

__all__ = ["Strict", "kinds_of"]


class Strict(BaseModel):
    """Base of every part: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _numbers_are_numbers(cls, content: Any) -> Any:
        """Refuse ``"4"`` and ``true`` for a number; pydantic would take them."""
        if isinstance(content, dict):
            for key, value in content.items():
                if key in cls.model_fields:
                    _require_number(key, value, cls.model_fields[key].annotation)
        return content


def kinds_of(annotation: Any) -> Iterator[Any]:
    """Return the types that an annotation allows, one by one.

    Examples
    --------
    >>> list(kinds_of(float | None))
    [<class 'float'>, <class 'NoneType'>]
    >>> list(kinds_of(Literal[1, 2]))
    [<class 'int'>]
    """
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        yield from {type(value) for value in inner}
    elif origin is Annotated:
        yield from kinds_of(inner[0])
    elif origin in (Union, UnionType):
        for one in inner:
            yield from kinds_of(one)
    else:
        yield annotation


def _require_number(key: str, value: Any, annotation: Any) -> None:
    kinds = set(kinds_of(annotation))
    if isinstance(value, dict):
        for kind in kinds:
            if get_origin(kind) is dict:
                for part, one in value.items():
                    _require_number(f"{key}.{part}", one, get_args(kind)[1])
    elif isinstance(value, bool | str) and kinds & {int, float}:
        if type(value) not in kinds:
            raise ValueError(f"{key} must be a number, found {value!r}")
