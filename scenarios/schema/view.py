"""How it is filmed: the camera, and what becomes of its pictures."""

from __future__ import annotations

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.road import Place
from simbench.scenarios.schema.strict import Strict

__all__ = ["CameraSettings", "Imaging"]


class CameraSettings(Strict):
    """Where the camera stands or how it moves, and where it looks."""

    mount: Literal["overpass", "mast", "drone", "car"] = "mast"
    motion: Literal["still", "follow", "pan", "drive"] = Field(
        default="still",
        description="follow: position and look_at are relative to the target's place; "
        "pan: stands still and turns, look_at is relative to the target's place; "
        "drive: moves along the road at speed_mps, whatever the target does.",
    )
    speed_mps: float | None = Field(
        default=None, ge=-70, le=70, description="Of a driving camera, and of no other."
    )
    position: Place = Place(along_m=0, lateral_m=-12, height_m=8)
    look_at: Place = Place(along_m=60, lateral_m=-6, height_m=1)
    fov_rad: float = Field(
        default=0.6, gt=0.005, lt=math.pi * 0.9, description="Horizontal."
    )
    sway_m: float = Field(
        default=0, ge=0, le=100, description="A follower's gap breathes by this much."
    )
    sway_period_s: float = Field(default=15, gt=0.5, le=600)
    wander_px: float = Field(
        default=0,
        ge=0,
        le=2000,
        description="An aim that strays circles by this much to each side.",
    )
    wander_shape: float = Field(
        default=0.5, ge=0, le=2, description="Height of its ellipse over the width."
    )
    wander_period_s: float = Field(default=4, gt=0.1, le=600)
    vibration_px: float = Field(
        default=0, ge=0, le=50, description="Standard deviation of the picture's shake."
    )
    vibration_hz: float = Field(default=6, gt=0.1, le=60)

    @model_validator(mode="after")
    def _only_a_driver_has_speed(self) -> Self:
        if (self.speed_mps is not None) != (self.motion == "drive"):
            raise ValueError(
                f"speed_mps belongs to motion: drive, and only there; motion is "
                f"{self.motion}, speed_mps is {self.speed_mps}"
            )
        return self


class Imaging(Strict):
    """From light to file: size, rate and the sensor's faults."""

    width_px: int = Field(default=480, ge=64, le=3840)
    height_px: int = Field(default=320, ge=48, le=2160)
    frame_rate_hz: float = Field(default=25, gt=0.5, le=100)
    keep_every: int = Field(default=1, ge=1, le=100, description="Drop the others.")
    drop_share: float = Field(
        default=0.0, ge=0, le=0.9, description="Share of frames lost at random."
    )
    samples: Literal[1, 2, 3, 4] = Field(
        default=2, description="Samples a pixel along each axis."
    )
    exposure: float = Field(default=1.0, gt=0.01, le=20, description="Gain.")
    auto_exposure_s: float | None = Field(
        default=None,
        ge=0.05,
        le=60,
        description="Time constant in which the gain follows the light; null: fixed.",
    )
    contrast: float = Field(
        default=1.0,
        ge=0,
        le=4,
        description="Deviations from the picture's mean level, times this.",
    )
    noise: float = Field(
        default=0.012, ge=0, le=0.5, description="Noise at full scale, of full scale."
    )
    blur_px: float = Field(default=0.45, ge=0, le=20, description="Gaussian sigma.")
    downscale: float = Field(
        default=1.0, ge=1, le=16, description="Detail lost: resized down and up again."
    )
    jpeg_quality: int | None = Field(default=None, ge=1, le=100)

    @property
    def interval_s(self) -> float:
        """Time between kept frames in seconds."""
        return self.keep_every / self.frame_rate_hz
