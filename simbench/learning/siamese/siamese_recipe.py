"""Recipe of a Siamese network: crops, pairs, augmentation, layers, loss, schedule."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from simbench.learning.recipe import Schedule, ScheduledRecipe
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = [
    "BoxSettings",
    "CropChoice",
    "LossSettings",
    "PairSchedule",
    "PairSettings",
    "Photometry",
    "SiamBoxRecipe",
    "SiameseRecipe",
]

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Factor = Annotated[float, Field(gt=0.0, le=10.0)]
Channels = Annotated[int, Field(ge=1, le=1024)]


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


class PairSettings(StrictModel):
    """How an exemplar and a search region are cut from two crops of a vehicle.

    Attributes
    ----------
    shift : float
        Greatest distance of the vehicle from the middle of the search region, in
        samples, along each side.
    growth : float
        Greatest change of the size in the search region, as a share of it.
    stretch : float
        Greatest change of its width against its height, up and down: as logarithms, one
        grows by it and the other shrinks.
    exemplar_shift, exemplar_growth : float
        The same for the exemplar: a tracker's first box is not perfect.
    flip : float
        Probability that both are mirrored.
    occluder : float
        Probability that a piece of another crop is pasted into the search region.
    """

    shift: float = Field(default=20.0, ge=0.0, le=28.0)
    growth: float = Field(default=0.1, ge=0.0, le=0.5)
    stretch: float = Field(default=0.0, ge=0.0, le=0.5)
    exemplar_shift: float = Field(default=1.5, ge=0.0, le=8.0)
    exemplar_growth: float = Field(default=0.05, ge=0.0, le=0.2)
    flip: Share = 0.5
    occluder: Share = 0.12


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
    gamma: tuple[Factor, Factor] = (0.6, 1.5)
    contrast: tuple[Factor, Factor] = (0.6, 1.3)
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


class LossSettings(StrictModel):
    """What the network is asked for.

    Attributes
    ----------
    radius : float
        Responses at most so far from the vehicle count as it, in samples.
    negatives : float
        Weight of the responses to the other vehicles of a batch.
    """

    radius: float = Field(default=8.0, ge=2.0, le=32.0)
    negatives: float = Field(default=0.3, ge=0.0, le=10.0)


class PairSchedule(Schedule):
    """How long and how fast the network learns from pairs.

    Attributes
    ----------
    batch : int
        Pairs of a step, each of another vehicle as far as there are enough.
    """

    batch: int = Field(default=16, ge=2, le=4096)


class SiameseRecipe(ScheduledRecipe):
    """What a Siamese network is trained on, and how.

    Attributes
    ----------
    crops : CropChoice
    pairs : PairSettings
    photometry : Photometry or None
        None leaves pictures as they are.
    channels : tuple of 5 int
        Of the layers.
    loss : LossSettings
    schedule : PairSchedule
    """

    crops: CropChoice = CropChoice()
    pairs: PairSettings = PairSettings()
    photometry: Photometry | None = Photometry()
    channels: tuple[Channels, ...] = Field(
        default=(32, 64, 96, 96, 64), min_length=5, max_length=5
    )
    loss: LossSettings = LossSettings()
    schedule: PairSchedule


class BoxSettings(StrictModel):
    """The head that predicts a vehicle's box.

    Attributes
    ----------
    channels : int
        Of its hidden layer.
    """

    channels: Channels = 64


class SiamBoxRecipe(SiameseRecipe):
    """What a head for boxes is trained on, and how.

    Attributes
    ----------
    box : BoxSettings

    Notes
    -----
    Features are trained before, so ``channels`` and ``loss.negatives`` decide nothing.
    """

    box: BoxSettings = BoxSettings()
