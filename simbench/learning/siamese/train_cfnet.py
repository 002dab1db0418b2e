"""CFNet: a Siamese network, trained through the filter it learns from a target."""

from __future__ import annotations

from typing import Any, Final

from simbench.learning.crops.vehicle_crops import VehicleCrops, prepare_crops
from simbench.learning.siamese.filter_layer import filters_of, make_filter_layer
from simbench.learning.siamese.learn_from_pairs import learn_from_pairs
from simbench.learning.siamese.losses import response_labels, response_loss
from simbench.learning.siamese.network import (
    features,
    folded_arrays,
    make_network,
    responses,
)
from simbench.learning.siamese.pairs import Pairs
from simbench.learning.siamese.siamese_recipe import SiameseRecipe
from simbench.learning.torch_backend import (
    deterministic_torch,
    to_array,
    without_autocast,
)
from simbench.learning.training import Arrays, Training
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.square_crops import SEARCH_SAMPLES

__all__ = ["TRAINING", "train_cfnet"]


def train_cfnet(
    recipe: SiameseRecipe, crops: VehicleCrops, seed: int, progress: Progress
) -> Arrays:
    """Train the network; return what `simbench.trackers.parts.siamese_filter` reads.

    As for SiamFC, but what search regions are compared with is the filter of another
    region with the vehicle in its middle, and gradients go through its closed form.

    Parameters
    ----------
    recipe : SiameseRecipe
    crops : VehicleCrops
    seed : int
        Of first weights and pairs.
    progress : callable of (done, total, what)

    References
    ----------
    Valmadre, Bertinetto, Henriques, Vedaldi, Torr, "End-to-end representation learning
    for correlation filter based tracking", CVPR 2017, section 3. Chosen here: network,
    samples and augmentation of our SiamFC, and a ridge that is learnt.
    """
    torch = deterministic_torch(seed)
    network = make_network(torch, recipe.channels)
    network["filter"] = make_filter_layer(torch)

    def loss_of(pairs: Pairs) -> Any:
        regions = features(torch, network, pairs.exemplars)
        searches = features(torch, network, pairs.searches).float()
        labels = response_labels(pairs.offsets, recipe.loss.radius)
        with without_autocast(torch):
            filters = filters_of(torch, network["filter"], regions.float())
            found = responses(torch, network, filters, searches)
            return response_loss(torch, found, labels, recipe.loss.negatives)

    learn_from_pairs(
        torch,
        network,
        loss_of,
        recipe,
        crops,
        module=__name__,
        seed=seed,
        progress=progress,
        exemplar_samples=SEARCH_SAMPLES,
    )
    ridge = to_array(network["filter"]["ridge"])
    return {**folded_arrays(torch, network.eval()), "ridge": ridge.astype("f2")}


TRAINING: Final = Training("cfnet", SiameseRecipe, prepare_crops, train_cfnet)
