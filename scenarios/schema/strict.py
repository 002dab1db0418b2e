"""The base of every part of the scenario file."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, model_validator

__all__ = ["Strict"]


class Strict(BaseModel):
    """Base of every part: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _numbers_are_numbers(cls, content: Any) -> Any:
        """Refuse ``"4"`` and ``true`` for a number; pydantic would take them."""
        if isinstance(content, dict):
            for key, value in content.items():
                field = cls.model_fields.get(key)
                if field is None or not isinstance(value, bool | str):
                    continue
                wants = {field.annotation, *get_args(field.annotation)}
                if wants & {int, float} and not wants & {type(value)}:
                    raise ValueError(f"{key} must be a number, found {value!r}")
        return content
