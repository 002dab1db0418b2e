"""Training on pairs of pictures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from simbench.learning.crops.vehicle_crops import VehicleCrops
from simbench.learning.siamese.pairs import Pairs, PairSampler
from simbench.learning.siamese.siamese_recipe import SiameseRecipe
from simbench.learning.training_loop import checkpoint_path, learn
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.square_crops import EXEMPLAR_SAMPLES

__all__ = ["learn_from_pairs"]


def learn_from_pairs(
    torch: Any,
    network: Any,
    loss_of: Callable[[Pairs], Any],
    recipe: SiameseRecipe,
    crops: VehicleCrops,
    *,
    module: str,
    seed: int,
    progress: Progress,
    exemplar_samples: int = EXEMPLAR_SAMPLES,
) -> None:
    """Train a network on pairs, from its checkpoint beside the crops if there is one.

    Parameters
    ----------
    torch : module
    network
        A module of PyTorch.
    loss_of : callable
        Returns the loss of pairs, of which gradients can be taken.
    recipe : SiameseRecipe
    crops : VehicleCrops
    module : str
        Dotted name of the module that trains.
    seed : int
        Pairs of an iteration depend on it and the iteration's number only.
    progress : callable of (done, total, what)
    exemplar_samples : int
        Rows and columns of an exemplar.
    """
    schedule = recipe.schedule
    sampler = PairSampler(crops, recipe.pairs, recipe.photometry, exemplar_samples)

    def loss_after(done: int) -> Any:
        rng = np.random.default_rng([seed, done])
        return loss_of(sampler.sample(schedule.batch, rng))

    learn(
        torch,
        network,
        loss_after,
        schedule,
        checkpoint=checkpoint_path(
            torch, recipe, crops.digest, crops.cache, module, seed
        ),
        progress=progress,
    )
