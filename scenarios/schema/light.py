"""The light it is filmed in."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from simbench.scenarios.schema.strict import Strict

__all__ = ["Light"]


class Light(Strict):
    """Time of day and weather."""

    time: Literal["day", "dusk"] = "day"
    sun_azimuth_rad: float = Field(
        default=2.2, ge=-7, le=7, description="Counter-clockwise from the road's x."
    )
    haze_per_km: float = Field(default=0.25, ge=0, le=50, description="Extinction.")
    shadows: bool = True
