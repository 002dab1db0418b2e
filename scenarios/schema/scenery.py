"""Occluders and the surroundings of the road."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["Occluder", "Surroundings", "Tunnel"]


class Occluder(StrictModel):
    """An object that occludes the target.

    Either at a place of the road (``along_m`` and ``lateral_m``), or on the line of
    sight: ``hides_at_s`` and ``distance_m`` from the camera.
    """

    kind: Literal["pole", "sign", "gantry", "tree", "lamp"] = "pole"
    along_m: float | None = Field(default=None, ge=-1e6, le=1e6)
    lateral_m: float | None = Field(default=None, ge=-1e5, le=1e5)
    hides_at_s: float | None = Field(default=None, ge=0, le=600)
    distance_m: float | None = Field(default=None, gt=0.5, le=2000)
    width_m: float = Field(default=0.3, gt=0.002, le=60, description="Occluding part.")
    height_m: float = Field(default=7.0, gt=0.1, le=40)
    panel_m: float | None = Field(
        default=None,
        gt=0.01,
        le=20,
        description="Height of a sign's panel; null: 0.7 width_m.",
    )
    rise_m: float = Field(
        default=0.0,
        ge=-20,
        le=20,
        description="Of a sign's middle above the line of sight.",
    )
    tilt_rad: float = Field(
        default=0.0, ge=-3.2, le=3.2, description="Of a sign's panel."
    )

    @model_validator(mode="after")
    def _has_one_place(self) -> Self:
        on_road = self.along_m is not None and self.lateral_m is not None
        on_sight = self.hides_at_s is not None and self.distance_m is not None
        given = (self.along_m, self.lateral_m, self.hides_at_s, self.distance_m)
        if on_road == on_sight or sum(value is not None for value in given) != 2:
            raise ValueError(
                "give either along_m and lateral_m, or hides_at_s and distance_m"
            )
        if on_road and self.rise_m != 0.0:
            raise ValueError(
                f"rise_m needs hides_at_s and distance_m, got rise_m: {self.rise_m:g} "
                "with along_m"
            )
        return self


class Tunnel(StrictModel):
    """A stretch of the road under a hill, a tube for each direction."""

    from_m: float = Field(ge=-3000, le=12_000, description="Start along the road.")
    to_m: float = Field(ge=-3000, le=12_000, description="End along the road.")

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if not 10 <= self.to_m - self.from_m <= 3000:
            raise ValueError(
                "to_m must be 10 to 3000 m beyond from_m, "
                f"got {self.from_m:g} to {self.to_m:g}"
            )
        return self


class Surroundings(StrictModel):
    """Objects along the road."""

    guard_rails: bool = True
    lamp_spacing_m: float | None = Field(default=None, gt=5, le=500)
    gantry_spacing_m: float | None = Field(default=None, gt=20, le=3000)
    tree_spacing_m: float | None = Field(default=18.0, gt=2, le=500)
    tree_lateral_m: float = Field(
        default=14, ge=0, le=200, description="From the road's edge to the trees."
    )
    season: Literal["summer", "autumn"] = "summer"
    tunnel: Tunnel | None = Field(default=None, description="Over both carriageways.")
