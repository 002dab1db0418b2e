"""Base class of every part of a scenario file, and one-line validation messages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import (
    BaseModel,
    ConfigDict,
    ValidationError,
    ValidationInfo,
    field_validator,
)

__all__ = ["ROAD_TAGS", "StrictModel", "error_line", "types_in"]

ROAD_TAGS = ("<carriageway>", "<floor>", "<network>")
"""Tags of the kinds of road: part of pydantic's error locations, not of files."""

_MESSAGES = {
    "extra_forbidden": "unknown key",
    "missing": "is required but missing",
    "model_type": "must be a mapping of keys to values",
    "dict_type": "must be a mapping of keys to values",
    "tuple_type": "must be a list",
}


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
            raise ValueError("must be a number")
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


def error_line(
    where: str | Path, error: ValidationError, key: tuple[str, ...] = ()
) -> str:
    """Return the first validation error in one line, and how many more there are.

    Parameters
    ----------
    where : str or Path
        File or scenario, at the start of the line.
    error : pydantic.ValidationError
    key : tuple of str
        Key of what was validated, if it is part of a scenario.
    """
    first = error.errors()[0]
    location = [*key, *(str(part) for part in first["loc"] if part not in ROAD_TAGS)]
    default = first["msg"].removeprefix("Value error, ")
    message = _MESSAGES.get(first["type"], default)
    value = first["input"]
    shown = "" if isinstance(value, dict | list) else f", got {value!r:.62}"
    more = error.error_count() - 1
    rest = f" (and {more} more)" if more else ""
    place = ": ".join(filter(None, [str(where), ".".join(location)]))
    return " ".join(f"{place}: {message}{shown}{rest}".split())
