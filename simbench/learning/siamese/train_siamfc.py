"""SiamFC: a network whose response to an exemplar is high where its vehicle is."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.learning.siamese.checkpoint import load_checkpoint, save_checkpoint
from simbench.learning.siamese.network import (
    features,
    folded_arrays,
    make_network,
    responses,
)
from simbench.learning.siamese.pairs import Pairs, PairSampler
from simbench.learning.siamese.siamese_recipe import Schedule, SiameseRecipe
from simbench.learning.siamese.vehicle_crops import VehicleCrops, cached_crops
from simbench.learning.torch_backend import deterministic_torch
from simbench.learning.training import Arrays, Training
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.siamese_network import RESPONSE_SIDE, STRIDE

__all__ = ["TRAINING", "learning_rate", "response_labels", "train_siamfc"]

_REPORT_EVERY = 10  # iterations
_SHOWN_LOSSES = 50
_LAST_RATE = 0.02  # of the highest step size
_LONGEST_GRADIENT = 5.0


def train_siamfc(
    recipe: SiameseRecipe, crops: VehicleCrops, seed: int, progress: Progress
) -> Arrays:
    """Train the network; return what `simbench.trackers.parts.siamese_network` reads.

    The pairs of an iteration depend on the seed and its number only, so that a
    training that goes on from a checkpoint ends with the same bytes.

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
    schedule = recipe.schedule
    network = make_network(torch, recipe.channels)
    optimiser = torch.optim.AdamW(
        network.parameters(), lr=schedule.rate, weight_decay=schedule.decay
    )
    decides = (recipe.model_dump(mode="json"), crops.digest, seed)
    key = digest_of(code_digest(__name__), torch.__version__, *decides)[:16]
    checkpoint = crops.cache / f".siamfc-{key}.pt"
    sampler = PairSampler(crops, recipe.pairs, recipe.photometry)
    network.train()
    first = load_checkpoint(torch, checkpoint, network, optimiser)
    losses: deque[float] = deque(maxlen=_SHOWN_LOSSES)
    for done in range(first, schedule.iterations):
        if done > first and done % schedule.checkpoint == 0:
            save_checkpoint(torch, checkpoint, done, network, optimiser)
        optimiser.param_groups[0]["lr"] = learning_rate(schedule, done)
        pairs = sampler.sample(schedule.batch, np.random.default_rng([seed, done]))
        losses.append(_step(torch, network, optimiser, pairs, recipe))
        if done % _REPORT_EVERY == 0:
            loss = sum(losses) / len(losses)
            progress(done, schedule.iterations, f"loss {loss:.3f}")
    checkpoint.unlink(missing_ok=True)
    return folded_arrays(torch, network.eval())


def learning_rate(schedule: Schedule, done: int) -> float:
    """Return the step size after so many iterations: it rises, then falls slowly."""
    rise = min(1.0, (done + 1) / schedule.warm_up)
    fall = 0.5 * (1.0 + math.cos(math.pi * done / schedule.iterations))
    return schedule.rate * rise * (_LAST_RATE + (1.0 - _LAST_RATE) * fall)


def response_labels(offsets: NDArray[np.float32], radius: float) -> NDArray[np.bool_]:
    """Return which responses are on the vehicle, (B, 17, 17) bool.

    Parameters
    ----------
    offsets : (B, 2) float32
        Of the vehicle from the middle of the search region, right and down, in samples.
    radius : float
        In samples.
    """
    steps = STRIDE * (np.arange(RESPONSE_SIDE) - RESPONSE_SIDE // 2)
    right = steps[None, None, :] - offsets[:, 0, None, None]
    down = steps[None, :, None] - offsets[:, 1, None, None]
    labels: NDArray[np.bool_] = right**2 + down**2 <= radius**2
    return labels


def _step(
    torch: Any, network: Any, optimiser: Any, pairs: Pairs, recipe: SiameseRecipe
) -> float:
    """Make one step of the optimiser, and return the loss before it."""
    labels = torch.from_numpy(response_labels(pairs.offsets, recipe.loss.radius))
    with torch.autocast("cpu", torch.bfloat16, enabled=recipe.schedule.bfloat16):
        exemplars = features(torch, network, pairs.exemplars)
        searches = features(torch, network, pairs.searches)
        found = responses(torch, network, exemplars, searches).float()
    loss = _loss(torch, found, labels, recipe.loss.negatives)
    optimiser.zero_grad()
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), _LONGEST_GRADIENT)
    optimiser.step()
    return float(loss.item())


def _loss(torch: Any, found: Any, labels: Any, negatives: float) -> Any:
    """Return the logistic loss of the responses, (B, B, 17, 17), to all pairs.

    Of a vehicle's own search region, the responses on it and those beside it have the
    same weight in all, as in section 2.2 of the paper.
    """
    softplus = torch.nn.functional.softplus
    count = len(found)
    own = found[range(count), range(count)]
    on = labels.float()
    losses = softplus(torch.where(labels, -own, own))
    on_vehicle = (losses * on).sum((1, 2)) / on.sum((1, 2)).clamp(min=1.0)
    beside = (losses * (1.0 - on)).sum((1, 2)) / (1.0 - on).sum((1, 2)).clamp(min=1.0)
    others = found[~torch.eye(count, dtype=torch.bool)]
    return (0.5 * (on_vehicle + beside)).mean() + negatives * softplus(others).mean()


def _prepare(
    recipe: SiameseRecipe,
    folders: Sequence[Path],
    cache: Path,
    seed: int,
    progress: Progress,
) -> VehicleCrops:
    return cached_crops(folders, cache, recipe.crops, progress)


TRAINING: Final = Training("siamfc", SiameseRecipe, _prepare, train_siamfc)
