"""Recipe of the encoder: patches, noise, layers and schedule."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field

from simbench.learning.recipe import TrainingRecipe

__all__ = ["EncoderRecipe"]

Units = Annotated[int, Field(ge=1, le=8192)]


class EncoderRecipe(TrainingRecipe):
    """What the encoder is trained on, and how.

    Attributes
    ----------
    patches : int
        In all, spread evenly over the films.
    noise : float
        Standard deviation of the Gaussian noise that a layer's input is corrupted
        with, in those of the input.
    layers : tuple of int
        Units of each layer, after the 1024 samples of a patch.
    layer_iterations : int
        Steps in which each layer is trained on the output of those below it.
    joint_iterations : int
        Steps in which all layers are then trained together.
    batch : int
        Patches of a step.
    rate : float
        Highest step size of Adam; it falls to 0 along a half cosine.
    """

    patches: int = Field(ge=100, le=1_000_000)
    noise: float = Field(ge=0.0, le=10.0)
    layers: tuple[Units, ...] = Field(min_length=1, max_length=8)
    layer_iterations: int = Field(ge=1, le=1_000_000)
    joint_iterations: int = Field(ge=1, le=1_000_000)
    batch: int = Field(ge=1, le=65_536)
    rate: float = Field(gt=0.0, le=1.0)

    def with_iterations(self, iterations: int) -> Self:
        """Return a recipe with so many steps in all, shared among its stages."""
        own = self.layer_iterations * len(self.layers) + self.joint_iterations
        share = iterations / own
        stages = {"layer_iterations": max(1, round(self.layer_iterations * share))}
        stages["joint_iterations"] = max(1, round(self.joint_iterations * share))
        return self.model_copy(update=stages)
