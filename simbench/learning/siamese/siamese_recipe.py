"""Recipe of a Siamese network: crops, pairs, layers, loss, schedule."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from simbench.learning.crops.crop_recipe import CropRecipe, Share
from simbench.learning.recipe import Schedule
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = [
    "BoxSettings",
    "LossSettings",
    "PairSchedule",
    "PairSettings",
    "SiamBoxRecipe",
    "SiameseRecipe",
]

Channels = Annotated[int, Field(ge=1, le=1024)]


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


class SiameseRecipe(CropRecipe):
    """What a Siamese network is trained on, and how.

    Attributes
    ----------
    pairs : PairSettings
    channels : tuple of 5 int
        Of the layers.
    loss : LossSettings
    schedule : PairSchedule
    """

    pairs: PairSettings = PairSettings()
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
