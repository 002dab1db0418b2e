"""The loop of a training on pairs: step sizes, checkpoints, the mean loss."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from simbench.learning.siamese.checkpoint import load_checkpoint, save_checkpoint
from simbench.learning.siamese.pairs import Pairs, PairSampler
from simbench.learning.siamese.siamese_recipe import Schedule, SiameseRecipe
from simbench.learning.siamese.vehicle_crops import VehicleCrops
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.square_crops import EXEMPLAR_SAMPLES

__all__ = ["learn_from_pairs", "learning_rate"]

_REPORT_EVERY = 10  # iterations
_SHOWN_LOSSES = 50
_LAST_RATE = 0.02  # of the highest step size
_LONGEST_GRADIENT = 5.0


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
    """Train a network, from its checkpoint if there is one; it is removed at the end.

    The checkpoint is kept beside the crops; its name is a digest of all that decides
    the training.

    The pairs of an iteration depend on the seed and its number only, so that a
    training that goes on from a checkpoint ends with the same bytes.

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
        Dotted name of the module that trains: its code is part of that digest.
    seed : int
    progress : callable of (done, total, what)
    exemplar_samples : int
        Rows and columns of an exemplar.
    """
    schedule = recipe.schedule
    sampler = PairSampler(crops, recipe.pairs, recipe.photometry, exemplar_samples)
    checkpoint = _checkpoint(torch, recipe, crops, module, seed)
    optimiser = torch.optim.AdamW(
        network.parameters(), lr=schedule.rate, weight_decay=schedule.decay
    )
    network.train()
    first = load_checkpoint(torch, checkpoint, network, optimiser)
    losses: deque[float] = deque(maxlen=_SHOWN_LOSSES)
    for done in range(first, schedule.iterations):
        if done > first and done % schedule.checkpoint == 0:
            save_checkpoint(torch, checkpoint, done, network, optimiser)
        optimiser.param_groups[0]["lr"] = learning_rate(schedule, done)
        pairs = sampler.sample(schedule.batch, np.random.default_rng([seed, done]))
        with torch.autocast("cpu", torch.bfloat16, enabled=schedule.bfloat16):
            loss = loss_of(pairs)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), _LONGEST_GRADIENT)
        optimiser.step()
        losses.append(float(loss.item()))
        if done % _REPORT_EVERY == 0:
            mean = sum(losses) / len(losses)
            progress(done, schedule.iterations, f"loss {mean:.3f}")
    checkpoint.unlink(missing_ok=True)


def _checkpoint(
    torch: Any, recipe: SiameseRecipe, crops: VehicleCrops, module: str, seed: int
) -> Path:
    decides = (recipe.model_dump(mode="json"), crops.digest, seed)
    key = digest_of(code_digest(module), torch.__version__, *decides)[:16]
    return crops.cache / f".{module.rpartition('.')[2]}-{key}.pt"


def learning_rate(schedule: Schedule, done: int) -> float:
    """Return the step size after so many iterations: it rises, then falls slowly."""
    rise = min(1.0, (done + 1) / schedule.warm_up)
    fall = 0.5 * (1.0 + math.cos(math.pi * done / schedule.iterations))
    return schedule.rate * rise * (_LAST_RATE + (1.0 - _LAST_RATE) * fall)
