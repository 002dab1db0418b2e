"""Base class of every part of a scenario file."""

from __future__ import annotations

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationInfo, field_validator

__all__ = ["StrictModel", "types_in"]


class StrictModel(BaseModel):
    """Immutable model that refuses unknown keys, NaN and infinity."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _numbers_are_numbers(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuse ``"4"`` and ``true`` for a number, which pydantic would convert."""
        allowed = set(types_in(cls.model_fields[str(info.field_name)].annotation))
        is_convertible = isinstance(value, bool | str) and type(value) not in allowed
        if is_convertible and allowed & {int, float}:
            raise ValueError("expected a number")
        return value


def types_in(annotation: Any) -> Iterator[Any]:
    """Return the types that an annotation allows, one by one.

    Examples
    --------
    >>> list(types_in(float | None))
    [<class 'float'>, <class 'NoneType'>]
    >>> list(types_in(Literal[1, 2]))
    [<class 'int'>]
    """
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        yield from {type(value) for value in arguments}
    elif origin is Annotated:
        yield from types_in(arguments[0])
    elif origin in (Union, UnionType):
        for argument in arguments:
            yield from types_in(argument)
    else:
        yield annotation
