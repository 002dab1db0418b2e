"""Camera and imaging settings."""

from __future__ import annotations

import math
from typing import Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.mistakes import Mistake, Mistakes
from simbench.scenarios.schema.road import Place
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["Burst", "CameraSettings", "Imaging", "require_renderable"]

_MOST_SAMPLES = 2**26  # of one picture


def require_renderable(width_px: int, height_px: int, samples: int) -> None:
    """Refuse a picture with more samples than fit into a renderer's memory.

    Raises
    ------
    Mistakes
        If it has.
    """
    count = width_px * height_px * samples**2
    if count > _MOST_SAMPLES:
        text = (
            f"expected at most {_MOST_SAMPLES} in a picture, got {count}: {samples} x "
            f"{samples} for each of {width_px} x {height_px} px"
        )
        raise Mistakes([Mistake(("samples",), text)])


class Burst(StrictModel):
    """A stretch of time."""

    at_s: float = Field(ge=0, le=14_400, description="Start.")
    lasts_s: float = Field(gt=0, le=14_400)


class CameraSettings(StrictModel):
    """Position, motion and direction of the camera."""

    mount: Literal["overpass", "mast", "drone", "car"] = "mast"
    motion: Literal["still", "follow", "pan", "drive"] = Field(
        default="still",
        description="follow: along_m of position and look_at is relative to the "
        "target; pan: only of look_at; drive: moves along the road at speed_mps.",
    )
    speed_mps: float | None = Field(
        default=None, ge=-70, le=70, description="Required by motion: drive."
    )
    position: Place = Place(along_m=0, lateral_m=-12, height_m=8)
    look_at: Place = Place(along_m=60, lateral_m=-6, height_m=1)
    fov_rad: float = Field(
        default=0.6, gt=0.005, lt=math.pi * 0.9, description="Horizontal."
    )
    sway_m: float = Field(
        default=0, ge=0, le=100, description="Amplitude of a following camera's gap."
    )
    sway_period_s: float = Field(default=15, gt=0.5, le=600)
    wander_px: float = Field(
        default=0, ge=0, le=2000, description="Half width of the aim's ellipse."
    )
    wander_shape: float = Field(
        default=0.5, ge=0, le=2, description="Height of the ellipse over its width."
    )
    wander_period_s: float = Field(default=4, gt=0.1, le=600)
    vibration_px: float = Field(
        default=0, ge=0, le=50, description="Standard deviation of the displacement."
    )
    vibration_hz: float = Field(default=6, gt=0.1, le=60)
    vibration_bursts: tuple[Burst, ...] = Field(
        default=(), max_length=50, description="When it vibrates; empty: always."
    )

    @model_validator(mode="after")
    def _drive_has_speed(self) -> Self:
        if (self.speed_mps is not None) != (self.motion == "drive"):
            raise ValueError(
                f"motion: drive, and no other, needs speed_mps, got motion: "
                f"{self.motion} and speed_mps: {self.speed_mps}"
            )
        return self


class Imaging(StrictModel):
    """Picture size, frame rate, exposure, sensor noise and compression."""

    width_px: int = Field(default=480, ge=64, le=3840)
    height_px: int = Field(default=320, ge=48, le=2160)
    frame_rate_hz: float = Field(default=25, gt=0.5, le=100)
    keep_every: int = Field(default=1, ge=1, le=100, description="Keep every n-th.")
    drop_share: float = Field(
        default=0.0, ge=0, le=0.9, description="Share of frames lost at random."
    )
    samples: Literal[1, 2, 3, 4] = Field(
        default=2, description="Samples per pixel along each axis."
    )
    exposure: float = Field(default=1.0, gt=0.01, le=20, description="Gain.")
    auto_exposure_s: float | None = Field(
        default=None, ge=0.05, le=60, description="Time constant; null: fixed gain."
    )
    contrast: float = Field(
        default=1.0, ge=0, le=4, description="Factor about the mean level."
    )
    noise: float = Field(
        default=0.012, ge=0, le=0.5, description="At full scale, of full scale."
    )
    blur_px: float = Field(default=0.45, ge=0, le=20, description="Gaussian sigma.")
    downscale: float = Field(
        default=1.0, ge=1, le=16, description="Factor of resizing down and up."
    )
    jpeg_quality: int | None = Field(default=None, ge=1, le=100)

    @model_validator(mode="after")
    def _samples_can_be_rendered(self) -> Self:
        require_renderable(self.width_px, self.height_px, self.samples)
        return self

    @property
    def interval_s(self) -> float:
        """Time between kept frames in seconds."""
        return self.keep_every / self.frame_rate_hz
