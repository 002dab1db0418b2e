"""The light it is filmed in."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.strict import Strict

__all__ = ["Light"]


class Light(Strict):
    """Time of day and weather."""

    time: Literal["day", "dusk", "night"] = "day"
    weather: Literal["clear", "fog", "rain"] = "clear"
    fog_visibility_m: float = Field(
        default=150,
        ge=10,
        le=1000,
        description="In fog: where 5 % of the contrast is left.",
    )
    rain_mm_per_h: float = Field(
        default=12, gt=0, le=150, description="In rain: how much falls."
    )
    sun_azimuth_rad: float = Field(
        default=2.2, ge=-7, le=7, description="Counter-clockwise from the road's x."
    )
    haze_per_km: float = Field(default=0.25, ge=0, le=50, description="Extinction.")
    shadows: bool = True
    illumination: float = Field(
        default=1.0,
        ge=0.001,
        le=20,
        description="All light of the scene, times this, before the exposure.",
    )

    @model_validator(mode="after")
    def _weather_is_there(self) -> Self:
        """Refuse to be told how thick a fog is that is not there."""
        for key, weather in (("fog_visibility_m", "fog"), ("rain_mm_per_h", "rain")):
            told = getattr(self, key)
            is_told = told != type(self).model_fields[key].default
            if is_told and self.weather != weather:
                raise ValueError(
                    f"{key} belongs to weather: {weather}; weather is {self.weather}, "
                    f"{key} is {told:g}"
                )
        return self
