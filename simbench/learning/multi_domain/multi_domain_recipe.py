"""Recipe of a multi-domain network: domains, examples, layers, schedule."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from simbench.learning.crops.crop_recipe import CropRecipe, Share
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["DomainSettings", "MultiDomainRecipe"]

Count = Annotated[int, Field(ge=1, le=100_000)]


class DomainSettings(StrictModel):
    """Which vehicles are domains, and what an iteration shows of one.

    Attributes
    ----------
    domains : int
        Most vehicles, spread evenly over all; each is a domain.
    frames : int
        Crops of the vehicle in an iteration, at most; examples are shared among them.
    positives, negatives : int
        Examples of the vehicle, and of what is not, that are learnt from.
    tried : int
        Negative examples of which those are the hardest, see
        `simbench.trackers.parts.online_classifier.hardest`.
    least_on, most_off : float
        Overlap with the vehicle's box from which an example is positive, and up to
        which it is negative.
    reach : float
        Greatest distance of negative examples along each axis, in mean sides.
    flip : float
        Probability that all crops of an iteration are mirrored.
    """

    domains: Count = 200
    frames: Count = 8
    positives: Count = 32
    negatives: Count = 96
    tried: Count = 192
    least_on: Share = 0.7
    most_off: Share = 0.5
    reach: float = Field(default=1.5, gt=0.0, le=2.0)
    flip: Share = 0.5

    @model_validator(mode="after")
    def _are_as_many(self) -> DomainSettings:
        if self.tried < self.negatives:
            raise ValueError(
                f"tried: expected at least negatives, {self.negatives}, "
                f"got {self.tried}"
            )
        return self


class MultiDomainRecipe(CropRecipe):
    """What a multi-domain network is trained on, and how.

    Attributes
    ----------
    domains : DomainSettings
    channels : int
        Of the third convolution; the first two are those of siamfc's network.
    units : int
        Of each of the two fully connected layers.
    dropout : float
        Share of their values that are left out in a step.
    trunk_factor : float
        On the step size of the two convolutions that are trained already.
    branch_factor : float
        On that of the branches, which see few iterations each.
    schedule : Schedule
        Each iteration shows one domain.
    """

    domains: DomainSettings = DomainSettings()
    channels: int = Field(default=96, ge=1, le=1024)
    units: int = Field(default=128, ge=1, le=4096)
    dropout: float = Field(default=0.5, ge=0.0, lt=1.0)
    trunk_factor: float = Field(default=0.1, ge=0.0, le=10.0)
    branch_factor: float = Field(default=5.0, gt=0.0, le=100.0)
