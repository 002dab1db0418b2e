"""MDNet: layers that tell any target from what is around it, learnt from many."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

import simbench.trackers.weights.siamfc
from simbench.learning.crops.vehicle_crops import VehicleCrops, prepare_crops
from simbench.learning.multi_domain.domain_examples import DomainSampler
from simbench.learning.multi_domain.domain_network import (
    domain_scores,
    make_domain_network,
    shared_arrays,
)
from simbench.learning.multi_domain.multi_domain_recipe import MultiDomainRecipe
from simbench.learning.torch_backend import (
    deterministic_torch,
    to_array,
    without_autocast,
)
from simbench.learning.training import Arrays, Training
from simbench.learning.training_loop import checkpoint_path, learn
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.online_classifier import hardest
from simbench.trackers.parts.weights_file import read_weights, shipped_weights

__all__ = ["TRAINING", "train_mdnet"]


def train_mdnet(
    recipe: MultiDomainRecipe, crops: VehicleCrops, seed: int, progress: Progress
) -> Arrays:
    """Train the shared layers.

    The branches of the domains are left behind: a target gets a new one.

    Parameters
    ----------
    recipe : MultiDomainRecipe
    crops : VehicleCrops
    seed : int
        Of first weights and examples.
    progress : callable of (done, total, what)

    Returns
    -------
    mapping from str to array
        What `simbench.trackers.parts.patch_network` reads.

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking" (MDNet), CVPR 2016, section 3.2; hard minibatch mining of section 4.2.
    Chosen here: AdamW in place of gradient descent, augmentation, a smaller network.
    """
    torch = deterministic_torch(seed)
    trained = read_weights(shipped_weights(simbench.trackers.weights.siamfc))
    sampler = DomainSampler(crops, recipe.domains, recipe.photometry, seed)
    network = make_domain_network(
        torch, trained, recipe.channels, recipe.units, recipe.dropout, sampler.count
    )

    def loss_of(iteration: int) -> Any:
        # of dropout too, or a training that goes on would sample other units
        torch.manual_seed(
            int(np.random.default_rng([seed, iteration, 1]).integers(2**63))
        )
        examples = sampler.sample(iteration)
        with torch.no_grad():
            network.eval()
            tried = domain_scores(torch, network, examples.negatives, examples.domain)
            network.train()
        odds = to_array(tried[:, 1] - tried[:, 0])
        hard = hardest(odds, recipe.domains.negatives)
        patches = np.concatenate([examples.positives, examples.negatives[hard]])
        labels = np.repeat([1, 0], [len(examples.positives), len(hard)])
        scores = domain_scores(torch, network, patches, examples.domain)
        with without_autocast(torch):
            return torch.nn.functional.cross_entropy(scores, torch.as_tensor(labels))

    learn(
        torch,
        network,
        loss_of,
        recipe.schedule,
        checkpoint=checkpoint_path(
            torch, recipe, crops.digest, crops.cache, __name__, seed
        ),
        progress=progress,
        factors={
            "trunk": recipe.trunk_factor,
            "third": 1.0,
            "fully": 1.0,
            "branches": recipe.branch_factor,
        },
    )
    return shared_arrays(network)


TRAINING: Final = Training("mdnet", MultiDomainRecipe, prepare_crops, train_mdnet)
