"""The multi-domain network: shared layers, and a branch for each domain."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.learning.siamese.network import trained_layer
from simbench.learning.torch_backend import to_array
from simbench.learning.training import Arrays
from simbench.trackers.parts.patch_network import PATCH_KERNELS
from simbench.trackers.parts.siamese_network import LEVEL_MEAN, LEVEL_SPREAD

__all__ = ["domain_scores", "make_domain_network", "shared_arrays"]

_PLACES = 9  # of the third convolution's values: 3 x 3


def make_domain_network(
    torch: Any, trained: Arrays, channels: int, units: int, dropout: float, domains: int
) -> Any:
    """Return the network; its first two convolutions are trained already.

    Parameters
    ----------
    torch : module
    trained : mapping from str to array
        As of `simbench.learning.siamese.network.folded_arrays`.
    channels : int
        Of the third convolution.
    units : int
        Of each fully connected layer.
    dropout : float, in [0, 1)
    domains : int
        Branches, each with two outputs.

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking" (MDNet), CVPR 2016, section 3.1, figure 1. There the convolutions are
    those of VGG-M, trained on ImageNet; here two are those of the network of siamfc,
    trained on generated films, and the third is new. All branches have the same first
    weights: each sees few iterations, and features learnt for branches that still are
    random, and differ, serve none.
    """
    nn = torch.nn
    first, second = (trained_layer(torch, trained, number) for number in (0, 1))
    third = nn.Conv2d(second.out_channels, channels, PATCH_KERNELS[2])
    nn.init.kaiming_normal_(third.weight, nonlinearity="relu")
    nn.init.zeros_(third.bias)
    fully: list[Any] = []
    for inputs in (_PLACES * channels, units):
        layer = nn.Linear(inputs, units)
        nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
        nn.init.zeros_(layer.bias)
        fully += [layer, nn.ReLU(), nn.Dropout(dropout)]
    branch = nn.Linear(units, 2)
    branches = nn.ModuleList([deepcopy(branch) for _ in range(domains)])
    pool = nn.MaxPool2d(3, 2)
    network = nn.ModuleDict(
        {
            "trunk": nn.Sequential(first, nn.ReLU(), pool, second, nn.ReLU(), pool),
            "third": nn.Sequential(third, nn.ReLU()),
            "fully": nn.Sequential(*fully),
            "branches": branches,
        }
    )
    return network.to(memory_format=torch.channels_last)


def domain_scores(
    torch: Any, network: Any, patches: NDArray[np.uint8], domain: int
) -> Any:
    """Return the scores that a domain's branch gives to patches, (N, 2).

    Of two classes: not the target, target.

    Parameters
    ----------
    torch : module
    network
        As of `make_domain_network`.
    patches : (N, 64, 64, 3) uint8, RGB
    domain : int
    """
    levels = torch.as_tensor(patches).permute(0, 3, 1, 2).float()
    values = network["trunk"]((levels - LEVEL_MEAN) / LEVEL_SPREAD)
    values = network["third"](values).permute(0, 2, 3, 1).flatten(1)
    return network["branches"][domain](network["fully"](values)).float()


def shared_arrays(network: Any) -> Arrays:
    """Return the arrays of `simbench.trackers.parts.patch_network`, float16."""
    trunk, third, fully = (network[name] for name in ("trunk", "third", "fully"))
    found: dict[str, NDArray[np.float16]] = {}
    for number, layer in enumerate((trunk[0], trunk[3], third[0], fully[0], fully[3])):
        weights, biases = layer.weight, layer.bias
        found[f"weights_{number}"] = to_array(weights.contiguous()).astype(np.float16)
        found[f"biases_{number}"] = to_array(biases).astype(np.float16)
    return found
