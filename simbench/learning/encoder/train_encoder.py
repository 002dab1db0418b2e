"""Stacked denoising auto-encoder: layers trained one by one, then together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.learning.encoder.encoder_recipe import EncoderRecipe
from simbench.learning.encoder.film_patches import cached_patches
from simbench.learning.torch_backend import deterministic_torch, to_array
from simbench.learning.training import Arrays, Training
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.encoder import PATCH_SCALE

__all__ = ["TRAINING", "train_encoder"]

_REPORT_EVERY = 20  # iterations
_STATISTICS_PATCHES = 8192


def train_encoder(
    recipe: EncoderRecipe,
    patches: NDArray[np.float16],
    seed: int,
    progress: Progress,
) -> Arrays:
    """Train the encoder and return its arrays, see `simbench.trackers.parts.encoder`.

    Each layer is first trained alone: from the corrupted output of those below it, it
    and a decoder of its own restore the output that was not corrupted. All layers and
    decoders are then stacked and trained together to restore a patch from a corrupted
    one. Units are logistic; the last decoder is linear, since patches have mean 0.

    Parameters
    ----------
    recipe : EncoderRecipe
    patches : (N, 1024) float16
    seed : int
        Of first weights, corruption and batches.
    progress : callable of (done, total, what)

    References
    ----------
    Vincent et al., "Stacked denoising autoencoders", J. Machine Learning Research 11
    (2010), section 3; Wang and Yeung, "Learning a deep compact image representation
    for visual tracking", NIPS 2013 (DLT), section 3.1, without its penalties on
    weights and activity, and with smaller layers.
    """
    torch = deterministic_torch(seed)
    data = torch.as_tensor(patches.astype(np.float32)) * PATCH_SCALE
    sizes = [data.shape[1], *recipe.layers]
    total = recipe.layer_iterations * len(recipe.layers) + recipe.joint_iterations
    encoders: list[Any] = []
    decoders: list[Any] = []
    done, inputs = 0, data
    for number, (wide, narrow) in enumerate(pairwise(sizes), 1):
        encoder, decoder = torch.nn.Linear(wide, narrow), torch.nn.Linear(narrow, wide)
        what = f"layer {number} of {len(recipe.layers)}"
        outputs = torch.sigmoid if number > 1 else lambda values: values
        for step in _fit(
            torch,
            recipe,
            recipe.layer_iterations,
            inputs,
            [encoder],
            [decoder],
            outputs,
        ):
            progress(done + step, total, what)
        done += recipe.layer_iterations
        encoders.append(encoder)
        decoders.insert(0, decoder)
        with torch.no_grad():
            inputs = torch.sigmoid(encoder(inputs))
    for step in _fit(
        torch, recipe, recipe.joint_iterations, data, encoders, decoders, lambda x: x
    ):
        progress(done + step, total, "all layers")
    return _arrays(torch, encoders, data[:_STATISTICS_PATCHES])


def _fit(
    torch: Any,
    recipe: EncoderRecipe,
    iterations: int,
    data: Any,
    encoders: Sequence[Any],
    decoders: Sequence[Any],
    outputs: Any,
) -> Iterator[int]:
    """Train encoders and decoders to restore data; yield the steps now and then."""
    parameters = [p for layer in (*encoders, *decoders) for p in layer.parameters()]
    optimiser = torch.optim.Adam(parameters, lr=recipe.rate)
    noise = recipe.noise * data.std()
    for step in range(iterations):
        if step % _REPORT_EVERY == 0:
            yield step
        rate = 0.5 * recipe.rate * (1.0 + math.cos(math.pi * step / iterations))
        optimiser.param_groups[0]["lr"] = rate
        clean = data[torch.randint(len(data), (recipe.batch,))]
        values = clean + noise * torch.randn_like(clean)
        for encoder in encoders:
            values = torch.sigmoid(encoder(values))
        for decoder in decoders[:-1]:
            values = torch.sigmoid(decoder(values))
        loss = torch.mean((outputs(decoders[-1](values)) - clean) ** 2)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()


def _arrays(torch: Any, encoders: Sequence[Any], data: Any) -> Arrays:
    """Return weights and biases of the layers, and the statistics of the output."""
    arrays: dict[str, NDArray[np.float16]] = {}
    with torch.no_grad():
        values = data
        for number, encoder in enumerate(encoders):
            arrays[f"weights_{number}"] = to_array(encoder.weight.T).astype(np.float16)
            arrays[f"biases_{number}"] = to_array(encoder.bias).astype(np.float16)
            values = torch.sigmoid(encoder(values))
        arrays["mean"] = to_array(values.mean(dim=0)).astype(np.float16)
        arrays["deviation"] = to_array(values.std(dim=0)).astype(np.float16)
    return arrays


def _prepare(
    recipe: EncoderRecipe,
    folders: Sequence[Path],
    cache: Path,
    seed: int,
    progress: Progress,
) -> NDArray[np.float16]:
    return cached_patches(folders, cache, recipe.patches, seed, progress)


TRAINING: Final = Training("encoder", EncoderRecipe, _prepare, train_encoder)
