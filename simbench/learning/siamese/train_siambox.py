"""SiamBox: SiamFC with a head that tells the vehicle's box."""

from __future__ import annotations

from typing import Any, Final

from simbench.learning.siamese.losses import box_loss, response_labels, response_loss
from simbench.learning.siamese.network import (
    box_sides,
    features,
    folded_arrays,
    folded_box_arrays,
    make_box_head,
    make_network,
    responses,
)
from simbench.learning.siamese.pairs import Pairs
from simbench.learning.siamese.siamese_recipe import SiamBoxRecipe
from simbench.learning.siamese.train_siamfc import prepare_crops
from simbench.learning.siamese.training_loop import learn_from_pairs
from simbench.learning.siamese.vehicle_crops import VehicleCrops
from simbench.learning.torch_backend import deterministic_torch
from simbench.learning.training import Arrays, Training
from simbench.runtime.run_jobs import Progress

__all__ = ["TRAINING", "train_siambox"]


def train_siambox(
    recipe: SiamBoxRecipe, crops: VehicleCrops, seed: int, progress: Progress
) -> Arrays:
    """Train network and head; return what `simbench.trackers.parts.siamese_box` reads.

    Parameters
    ----------
    recipe : SiamBoxRecipe
    crops : VehicleCrops
    seed : int
        Of first weights and pairs.
    progress : callable of (done, total, what)
    """
    torch = deterministic_torch(seed)
    network = make_network(torch, recipe.channels)
    network["box"] = make_box_head(torch, recipe.channels[-1], recipe.box.channels)

    def loss_of(pairs: Pairs) -> Any:
        exemplars = features(torch, network, pairs.exemplars)
        searches = features(torch, network, pairs.searches)
        found = responses(torch, network, exemplars, searches).float()
        labels = response_labels(pairs.offsets, recipe.loss.radius)
        with torch.autocast("cpu", enabled=False):
            own = (exemplars.float(), searches.float())
            sides = box_sides(torch, network["box"], *own)
            where = response_loss(torch, found, labels, recipe.loss.negatives)
            return where + recipe.box.weight * box_loss(torch, sides, pairs, labels)

    learn_from_pairs(
        torch,
        network,
        loss_of,
        recipe,
        crops,
        module=__name__,
        seed=seed,
        progress=progress,
    )
    network.eval()
    box = folded_box_arrays(torch, network["box"])
    return {**folded_arrays(torch, network), **box}


TRAINING: Final = Training("siambox", SiamBoxRecipe, prepare_crops, train_siambox)
