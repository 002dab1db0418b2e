"""Facts about the dials, read from their schema, for lists of them."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from simbench.scenarios.schema.dials import Dials
from simbench.scenarios.schema.strict_model import types_in

__all__ = ["DialFacts", "dial_facts"]

_UNITS = {"px": "px", "hz": "Hz"}  # by the ending of a name


class DialFacts(NamedTuple):
    """What a dial is.

    Attributes
    ----------
    name : str
        Dotted, as in `simbench.scenarios.schema.dials.DIAL_NAMES`.
    unit : str
        Empty for shares, factors and counts.
    range : str
        Its values in words.
    description : str
        One line.
    """

    name: str
    unit: str
    range: str
    description: str


def dial_facts() -> list[DialFacts]:
    """Return the facts of every dial, those of a group after its name.

    Examples
    --------
    >>> dial_facts()[0][:2]
    ('displacement_px', 'px')
    """
    return list(_facts_of(Dials, ""))


def _facts_of(model: type[BaseModel], prefix: str) -> list[DialFacts]:
    facts = []
    for name, field in model.model_fields.items():
        group = next(
            (kind for kind in types_in(field.annotation) if _is_model(kind)), None
        )
        if group is not None:
            facts.extend(_facts_of(group, f"{name}."))
        else:
            unit = _unit(name, field)
            text = field.description or ""
            facts.append(DialFacts(f"{prefix}{name}", unit, _range(field), text))
    return facts


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _unit(name: str, field: FieldInfo) -> str:
    extra = field.json_schema_extra
    if isinstance(extra, dict) and "unit" in extra:
        return str(extra["unit"])
    return _UNITS.get(name.rpartition("_")[2], "")


def _range(field: FieldInfo) -> str:
    """Return the allowed values in words."""
    choices = _choices(field.annotation)
    if choices:
        return f"{', '.join(choices[:-1])} or {choices[-1]}"
    limits = {
        key: f"{getattr(part, key):g}"
        for part in field.metadata
        for key in ("ge", "gt", "le")
        if hasattr(part, key)
    }
    low, high = limits.get("ge", limits.get("gt")), limits.get("le")
    if "gt" in limits:
        words = f"above {low}" + (f", up to {high}" if high is not None else "")
    else:
        words = f"at least {low}" if high is None else f"{low} to {high}"
    is_whole = int in types_in(field.annotation)
    return f"{words}, whole" if is_whole else words


def _choices(annotation: Any) -> tuple[str, ...]:
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    found = (_choices(part) for part in get_args(annotation))
    return next((choices for choices in found if choices), ())
