"""How it is filmed: the camera, and what becomes of its pictures."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from simbench.scenarios.schema.road import Place
from simbench.scenarios.schema.strict import Strict

__all__ = ["Camera", "Imaging"]


class Camera(Strict):
    """Where the camera stands or how it moves, and where it looks."""

    mount: Literal["overpass", "mast", "drone", "car"] = "mast"
    motion: Literal["still", "follow"] = Field(
        default="still",
        description="follow: position and look_at are relative to the target's place.",
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
    vibration_px: float = Field(
        default=0, ge=0, le=50, description="Standard deviation of the picture's shake."
    )
    vibration_hz: float = Field(default=6, gt=0.1, le=60)


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
