"""SiamBox: a head on the features of SiamFC that predicts the vehicle's box."""

from __future__ import annotations

from typing import Any, Final

import simbench.trackers.weights.siamfc
from simbench.learning.crops.vehicle_crops import VehicleCrops, prepare_crops
from simbench.learning.siamese.learn_from_pairs import learn_from_pairs
from simbench.learning.siamese.losses import box_loss, response_labels
from simbench.learning.siamese.network import (
    box_sides,
    features,
    fixed_features,
    folded_box_arrays,
    make_box_head,
)
from simbench.learning.siamese.pairs import Pairs
from simbench.learning.siamese.siamese_recipe import SiamBoxRecipe
from simbench.learning.torch_backend import deterministic_torch, without_autocast
from simbench.learning.training import Arrays, Training
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.weights_file import read_weights, shipped_weights

__all__ = ["TRAINING", "train_siambox"]


def train_siambox(
    recipe: SiamBoxRecipe, crops: VehicleCrops, seed: int, progress: Progress
) -> Arrays:
    """Train the head; return what `simbench.trackers.parts.siamese_box` reads.

    Features and responses are those of the network that ships for siamfc.

    Parameters
    ----------
    recipe : SiamBoxRecipe
    crops : VehicleCrops
    seed : int
        Of first weights and pairs.
    progress : callable of (done, total, what)

    Notes
    -----
    Pairs must show the vehicle larger, smaller and stretched by as much as a tracker's
    box may ever be wrong. Where they do so by 15 % only, the head learns to predict the
    mean size in samples whatever it sees: the box of the tracker then grows by the
    same share in each frame.
    """
    torch = deterministic_torch(seed)
    trained = read_weights(shipped_weights(simbench.trackers.weights.siamfc))
    fixed = fixed_features(torch, trained)
    head = make_box_head(torch, len(trained["biases_4"]), recipe.box.channels)

    def loss_of(pairs: Pairs) -> Any:
        with torch.no_grad():
            exemplars = features(torch, fixed, pairs.exemplars).float()
            searches = features(torch, fixed, pairs.searches).float()
        labels = response_labels(pairs.offsets, recipe.loss.radius)
        with without_autocast(torch):
            sides = box_sides(torch, head, exemplars, searches)
            return box_loss(torch, sides, pairs, labels)

    learn_from_pairs(
        torch,
        head,
        loss_of,
        recipe,
        crops,
        module=__name__,
        seed=seed,
        progress=progress,
    )
    return {**trained, **folded_box_arrays(torch, head.eval())}


TRAINING: Final = Training("siambox", SiamBoxRecipe, prepare_crops, train_siambox)
