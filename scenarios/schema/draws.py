"""What a scenario file samples: the record from which each seed is drawn."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["Draws"]


class Draws(StrictModel):
    """The file of a scenario with samples; filled in when the file is read."""

    content: dict[str, Any] = Field(description="The file, its variant applied.")
    source: str = Field(max_length=4096, description="Its name, for messages.")
    seed: int = Field(
        ge=0, le=2**63 - 1, description="For which the scenario's own values are."
    )
    frames: int | None = Field(
        default=None,
        ge=2,
        le=100_000,
        description="Cut after so many frames; null: whole.",
    )
