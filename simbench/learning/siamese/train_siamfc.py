"""SiamFC: a network whose response to an exemplar is high where its vehicle is."""

from __future__ import annotations

from typing import Any, Final

from simbench.learning.crops.vehicle_crops import VehicleCrops, prepare_crops
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
from simbench.learning.torch_backend import deterministic_torch, without_autocast
from simbench.learning.training import Arrays, Training
from simbench.runtime.run_jobs import Progress

__all__ = ["TRAINING", "train_siamfc"]


def train_siamfc(
    recipe: SiameseRecipe, crops: VehicleCrops, seed: int, progress: Progress
) -> Arrays:
    """Train the network; return what `simbench.trackers.parts.siamese_network` reads.

    Parameters
    ----------
    recipe : SiameseRecipe
    crops : VehicleCrops
    seed : int
        Of first weights and pairs.
    progress : callable of (done, total, what)

    References
    ----------
    Bertinetto et al., "Fully-convolutional Siamese networks for object tracking", ECCV
    workshops 2016, section 2.2. Chosen here: a smaller network, pictures of 64 and 128
    samples, AdamW in place of gradient descent, augmentation, and responses to the
    other vehicles of a batch as further negative examples.
    """
    torch = deterministic_torch(seed)
    network = make_network(torch, recipe.channels)

    def loss_of(pairs: Pairs) -> Any:
        exemplars = features(torch, network, pairs.exemplars)
        searches = features(torch, network, pairs.searches)
        found = responses(torch, network, exemplars, searches).float()
        labels = response_labels(pairs.offsets, recipe.loss.radius)
        with without_autocast(torch):
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
    )
    return folded_arrays(torch, network.eval())


TRAINING: Final = Training("siamfc", SiameseRecipe, prepare_crops, train_siamfc)
