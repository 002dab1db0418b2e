"""The part of a recipe that says which crops of vehicles are made, and changed how."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from simbench.learning.recipe import ScheduledRecipe
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["CropChoice", "CropRecipe", "Photometry", "Share"]

Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Factor = Annotated[float, Field(gt=0.0, le=10.0)]


class CropChoice(StrictModel):
    """Which vehicles of a film are cropped, and in how many frames.

    Attributes
    ----------
    vehicles : int
        Most of a film: those that are seen in most frames.
    frames : int
        Most of a vehicle, spread evenly over those in which it is seen.
    least_visible : float
        Share of its area that is not occluded.
    least_inside : float
        Share of its box that is in the picture.
    least_side_px : float
        Longer side of its box; the shorter one is at least half of it.
    least_contrast : float
        Standard deviation of the grey levels of a crop: a blank one teaches nothing.
    """

    vehicles: int = Field(default=7, ge=1, le=1000)
    frames: int = Field(default=8, ge=2, le=1000)
    least_visible: Share = 0.45
    least_inside: Share = 0.75
    least_side_px: float = Field(default=16.0, ge=4.0, le=1000.0)
    least_contrast: float = Field(default=6.0, ge=0.0, le=100.0)


class Photometry(StrictModel):
    """Changes of colour, light and sharpness: what makes films stand for real clips.

    The first five are sampled once for a pair, and then a little changed for each of
    its pictures; the others are sampled for each picture.

    Attributes
    ----------
    channel_mix, grey : float
        Probabilities that channels are mixed, or all show the luminance.
    gamma, contrast : (float, float)
        Ranges.
    brightness : float
        Greatest change, in grey levels.
    light : float
        Probability of a ramp of light, or a shadow's edge.
    blur, motion_blur, shrink, noise, jpeg : float
        Probabilities of a Gaussian blur, a blur along a line, fewer samples, Gaussian
        noise, and compression.
    """

    channel_mix: Share = 0.5
    grey: Share = 0.35
    gamma: tuple[_Factor, _Factor] = (0.6, 1.5)
    contrast: tuple[_Factor, _Factor] = (0.6, 1.3)
    brightness: float = Field(default=35.0, ge=0.0, le=128.0)
    light: Share = 0.3
    blur: Share = 0.3
    motion_blur: Share = 0.15
    shrink: Share = 0.2
    noise: Share = 0.5
    jpeg: Share = 0.25

    @model_validator(mode="after")
    def _ranges_rise(self) -> Photometry:
        for name in ("gamma", "contrast"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: expected [low, high], got [{low}, {high}]")
        return self


class CropRecipe(ScheduledRecipe):
    """What the recipe of a network has that learns from crops of vehicles.

    Attributes
    ----------
    crops : CropChoice
    photometry : Photometry or None
        None leaves pictures as they are.
    """

    crops: CropChoice = CropChoice()
    photometry: Photometry | None = Photometry()
