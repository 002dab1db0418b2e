"""Light and weather of a scenario."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["Light"]


class Light(StrictModel):
    """Time of day and weather."""

    time: Literal["day", "dusk", "night"] = "day"
    weather: Literal["clear", "fog", "rain"] = "clear"
    fog_visibility_m: float = Field(
        default=150,
        ge=10,
        le=1000,
        description="In fog: distance at which 5 % of the contrast is left.",
    )
    rain_mm_per_h: float = Field(
        default=12, gt=0, le=150, description="In rain: precipitation rate."
    )
    sun_azimuth_rad: float = Field(
        default=2.2, ge=-7, le=7, description="Counter-clockwise from the road's x."
    )
    sun_elevation_rad: float | None = Field(
        default=None,
        ge=0.05,
        le=1.55,
        description="In clear weather; null: as usual at that time.",
    )
    haze_per_km: float = Field(default=0.25, ge=0, le=50, description="Extinction.")
    shadows: bool = True
    illumination: float = Field(
        default=1.0,
        ge=0.001,
        le=20,
        description="Factor on all light of the scene, before the exposure.",
    )

    @model_validator(mode="after")
    def _weather_has_its_settings(self) -> Self:
        """Refuse a setting of fog or rain in other weather."""
        for key, weather in (("fog_visibility_m", "fog"), ("rain_mm_per_h", "rain")):
            value = getattr(self, key)
            is_set = value != type(self).model_fields[key].default
            if is_set and self.weather != weather:
                raise ValueError(
                    f"{key} needs weather: {weather}, got {key}: {value:g} with "
                    f"weather: {self.weather}"
                )
        return self
