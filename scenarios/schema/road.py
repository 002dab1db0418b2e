"""Where it happens: the road, and places on it."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.strict import Strict

__all__ = ["Place", "Road", "Section"]


class Section(Strict):
    """A stretch of road of one curvature and one slope."""

    length_m: float = Field(gt=0, le=10_000, description="Length along the road.")
    curve_radius_m: float | None = Field(
        default=None, description="Signed radius, left positive; null for straight."
    )
    slope_percent: float = Field(default=0.0, ge=-12, le=12, description="Rise.")

    @model_validator(mode="after")
    def _radius_is_drivable(self) -> Self:
        if self.curve_radius_m is not None and abs(self.curve_radius_m) < 60:
            raise ValueError("curve_radius_m must be at least 60 either way")
        return self


class Road(Strict):
    """A dual carriageway."""

    lanes: int = Field(default=3, ge=1, le=6, description="Lanes a direction.")
    lane_width_m: float = Field(default=3.5, ge=2.5, le=5)
    speed_limit_mps: float = Field(default=33.3, gt=1, le=70)
    median_m: float = Field(default=3.0, ge=0.5, le=30)
    shoulder_m: float = Field(default=2.5, ge=0.5, le=10)
    opposite: bool = Field(default=True, description="Traffic the other way too.")
    before_m: float = Field(
        default=300, ge=50, le=3000, description="Straight road before along_m = 0."
    )
    sections: tuple[Section, ...] = Field(
        default=(Section(length_m=1200),), min_length=1, max_length=50
    )

    @property
    def length_m(self) -> float:
        """Length of the whole road in metres, ``before_m`` included."""
        return self.before_m + sum(section.length_m for section in self.sections)


class Place(Strict):
    """A point in road coordinates."""

    along_m: float = 0.0
    lateral_m: float = 0.0
    height_m: float = Field(default=0.0, ge=0)
