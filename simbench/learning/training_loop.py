"""The loop of a training: step sizes, checkpoints, the mean loss."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from simbench.learning.checkpoint import load_checkpoint, save_checkpoint
from simbench.learning.recipe import Schedule, TrainingRecipe
from simbench.learning.torch_backend import device_name
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.run_jobs import Progress

__all__ = ["checkpoint_path", "learn", "learning_rate"]

_REPORT_EVERY = 10  # iterations
_SHOWN_LOSSES = 50
_LAST_RATE = 0.02  # of the highest step size
_LONGEST_GRADIENT = 5.0


def learn(
    torch: Any,
    network: Any,
    loss_of: Callable[[int], Any],
    schedule: Schedule,
    *,
    checkpoint: Path,
    progress: Progress,
    factors: Mapping[str, float] | None = None,
) -> None:
    """Train a network, from its checkpoint if there is one; it is removed at the end.

    What is sampled in an iteration must depend on a seed and its number only, so that a
    training that goes on from a checkpoint ends with the same bytes.

    Parameters
    ----------
    torch : module
    network
        A module of PyTorch.
    loss_of : callable
        Returns the loss of an iteration, by number, of which gradients can be taken.
    schedule : Schedule
    checkpoint : Path
        Where the state is kept, see `checkpoint_path`.
    progress : callable of (done, total, what)
    factors : mapping from str to float, optional
        On the step sizes of children of the network, by name. Without it, all parts
        have the same step size.
    """
    optimiser = torch.optim.AdamW(
        _groups(network, factors), lr=schedule.rate, weight_decay=schedule.decay
    )
    network.train()
    device = torch.get_default_device().type
    first = load_checkpoint(torch, checkpoint, network, optimiser)
    losses: deque[float] = deque(maxlen=_SHOWN_LOSSES)
    for done in range(first, schedule.iterations):
        if done > first and done % schedule.checkpoint == 0:
            save_checkpoint(torch, checkpoint, done, network, optimiser)
        rate = learning_rate(schedule, done)
        for group in optimiser.param_groups:
            group["lr"] = rate * group["factor"]
        with torch.autocast(device, torch.bfloat16, enabled=schedule.bfloat16):
            loss = loss_of(done)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), _LONGEST_GRADIENT)
        optimiser.step()
        losses.append(float(loss.item()))
        if done % _REPORT_EVERY == 0:
            mean = sum(losses) / len(losses)
            progress(done, schedule.iterations, f"loss {mean:.3f}")
    checkpoint.unlink(missing_ok=True)


def checkpoint_path(
    torch: Any,
    recipe: TrainingRecipe,
    data: str,
    cache: Path,
    module: str,
    seed: int,
) -> Path:
    """Return where the state of a training is kept: its name tells all that decides it.

    Parameters
    ----------
    torch : module
    recipe : TrainingRecipe
    data : str
        Digest of the training data.
    cache : Path
        Folder.
    module : str
        Dotted name of the module that trains: its code is part of the name.
    seed : int
    """
    versions = (torch.__version__, device_name(torch))
    decides = (recipe.model_dump(mode="json"), data, seed)
    key = digest_of(code_digest(module), *versions, *decides)[:16]
    return cache / f".{module.rpartition('.')[2]}-{key}.pt"


def learning_rate(schedule: Schedule, done: int) -> float:
    """Return the step size after so many iterations: it rises, then falls slowly."""
    rise = min(1.0, (done + 1) / schedule.warm_up)
    fall = 0.5 * (1.0 + math.cos(math.pi * done / schedule.iterations))
    return schedule.rate * rise * (_LAST_RATE + (1.0 - _LAST_RATE) * fall)


def _groups(network: Any, factors: Mapping[str, float] | None) -> list[dict[str, Any]]:
    """Return the parameters of a network in groups with a factor on the step size."""
    if factors is None:
        return [{"params": [*network.parameters()], "factor": 1.0}]
    return [
        {"params": [*network[name].parameters()], "factor": factor}
        for name, factor in factors.items()
    ]
