"""The point of a scenario: what every seed of it shows, in numbers."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["Measure", "Point"]


class Measure(StrictModel):
    """Range of a measure, both ends included."""

    least: float | None = Field(default=None, ge=-1e9, le=1e9)
    most: float | None = Field(default=None, ge=-1e9, le=1e9)

    @model_validator(mode="after")
    def _has_an_end(self) -> Self:
        if self.least is None and self.most is None:
            raise ValueError("give least, most or both")
        return self

    def holds(self, value: float) -> bool:
        """Whether a value is in the range; NaN is not."""
        least = self.least is None or value >= self.least
        most = self.most is None or value <= self.most
        return least and most and value == value

    def __str__(self) -> str:
        """Return the range in words."""
        if self.most is None:
            return f"at least {self.least:g}"
        if self.least is None:
            return f"at most {self.most:g}"
        return f"{self.least:g} to {self.most:g}"


class Point(StrictModel):
    """What every seed shows, see ``simbench probe``; null: not stated."""

    displacement_px: Measure | None = Field(
        default=None, description="Median displacement between frames."
    )
    displacement_p05_px: Measure | None = Field(default=None, description="5 %.")
    displacement_p95_px: Measure | None = Field(default=None, description="95 %.")
    target_px: Measure | None = Field(
        default=None, description="Median height of the target's box."
    )
    shrinks: Measure | None = Field(
        default=None, description="Height of the box, last over first."
    )
    hidden: Measure | None = Field(default=None, description="Greatest hidden share.")
    hidden_at_end: Measure | None = Field(
        default=None, description="Hidden share in the last frame."
    )
    occlusions: Measure | None = Field(
        default=None, description="Occlusions of more than half the greatest share."
    )
    gap_px: Measure | None = Field(
        default=None, description="Least gap to a vehicle of its class and colour."
    )
    twins: Measure | None = Field(
        default=None, description="Such vehicles in the picture at some time."
    )
    cut_ins: Measure | None = Field(
        default=None, description="Lane changes of such vehicles into its lane."
    )
    lane_changes: Measure | None = Field(default=None, description="Of the target.")
    rests: Measure | None = Field(
        default=None, description="Times at which it stands for a second or more."
    )
    turn_rad: Measure | None = Field(
        default=None, description="Change of its heading, first to last frame."
    )
    reversals: Measure | None = Field(
        default=None, description="Turns by more than 1.5 rad between frames."
    )
    in_tunnel: Measure | None = Field(
        default=None, description="Share of the frames in a tunnel."
    )
