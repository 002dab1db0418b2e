"""The Siamese network in PyTorch: features, responses, and what remains to run it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.learning.training import Arrays
from simbench.trackers.parts.siamese_network import KERNELS, LEVEL_MEAN, LEVEL_SPREAD

__all__ = ["features", "folded_arrays", "make_network", "responses"]


def make_network(torch: Any, channels: Sequence[int]) -> Any:
    """Return the network, with random first weights.

    Five convolutions without padding, each but the last with batch normalisation and
    ReLU, the last with batch normalisation only; the first has a stride of 2, and a
    maximum over 3 x 3 with a stride of 2 follows it. Responses have a learnt scale and
    bias.

    Parameters
    ----------
    torch : module
    channels : sequence of 5 int
    """
    nn = torch.nn
    layers: list[Any] = []
    for number, (size, (inputs, outputs)) in enumerate(
        zip(KERNELS, pairwise((3, *channels)), strict=True)
    ):
        convolution = nn.Conv2d(inputs, outputs, size, stride=2 if number == 0 else 1)
        nn.init.kaiming_normal_(convolution.weight, nonlinearity="relu")
        nn.init.zeros_(convolution.bias)
        layers += [convolution, nn.BatchNorm2d(outputs)]
        if number < len(KERNELS) - 1:
            layers.append(nn.ReLU())
        if number == 0:
            layers.append(nn.MaxPool2d(3, 2))
    response = nn.ParameterDict(
        {
            "scale": nn.Parameter(torch.tensor(1.0)),
            "bias": nn.Parameter(torch.tensor(-2.0)),
        }
    )
    network = nn.ModuleDict({"features": nn.Sequential(*layers), "response": response})
    return network.to(memory_format=torch.channels_last)


def features(torch: Any, network: Any, pictures: NDArray[np.float32]) -> Any:
    """Return the features of pictures, (B, C, n, n).

    Parameters
    ----------
    torch : module
    network
        As of `make_network`.
    pictures : (B, S, S, 3) float32, RGB
        In [0, 255].
    """
    levels = (pictures - np.float32(LEVEL_MEAN)) / np.float32(LEVEL_SPREAD)
    inputs = torch.from_numpy(levels).permute(0, 3, 1, 2)
    return network["features"](inputs)


def responses(torch: Any, network: Any, exemplars: Any, searches: Any) -> Any:
    """Return the responses of search regions to exemplars, all pairs.

    Parameters
    ----------
    torch : module
    network
        As of `make_network`.
    exemplars : (B, C, 6, 6)
    searches : (B, C, 22, 22)

    Returns
    -------
    (B, B, 17, 17)
        By search region and exemplar: log odds that the exemplar's vehicle is there.
    """
    count = exemplars[0].numel()
    raw = torch.nn.functional.conv2d(searches, exemplars) / count**0.5
    return network["response"]["scale"] * raw + network["response"]["bias"]


def folded_arrays(torch: Any, network: Any) -> Arrays:
    """Return the arrays of `simbench.trackers.parts.siamese_network`, float16.

    Batch normalisation, which after training is a scale and a bias for each channel,
    goes into the convolution before it.
    """
    layers = list(network["features"])
    found: dict[str, NDArray[np.float16]] = {}
    number = 0
    with torch.no_grad():
        for layer, norm in pairwise(layers):
            if not isinstance(norm, torch.nn.BatchNorm2d):
                continue
            gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
            weights = layer.weight * gain[:, None, None, None]
            biases = (layer.bias - norm.running_mean) * gain + norm.bias
            found[f"weights_{number}"] = weights.contiguous().numpy().astype(np.float16)
            found[f"biases_{number}"] = biases.numpy().astype(np.float16)
            number += 1
        scale, bias = (network["response"][name].item() for name in ("scale", "bias"))
    found["response"] = np.array([scale, bias], np.float16)
    return found
