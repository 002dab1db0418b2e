"""The Siamese network in PyTorch: features, responses, and what remains to run it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.learning.torch_backend import to_array
from simbench.learning.training import Arrays
from simbench.trackers.parts.siamese_box import MOST_LOG, SIDE_UNIT
from simbench.trackers.parts.siamese_network import KERNELS, LEVEL_MEAN, LEVEL_SPREAD

__all__ = [
    "box_sides",
    "features",
    "fixed_features",
    "folded_arrays",
    "folded_box_arrays",
    "make_box_head",
    "make_network",
    "responses",
]


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


def fixed_features(torch: Any, arrays: Arrays) -> Any:
    """Return the features of a trained network, which stay as they are.

    Parameters
    ----------
    torch : module
    arrays : mapping from str to array
        As of `folded_arrays`.

    Returns
    -------
    module
        What `features` takes as a network.
    """
    nn = torch.nn
    layers: list[Any] = []
    for number in range(len(KERNELS)):
        layers.append(trained_layer(torch, arrays, number))
        if number < len(KERNELS) - 1:
            layers.append(nn.ReLU())
        if number == 0:
            layers.append(nn.MaxPool2d(3, 2))
    network = nn.ModuleDict({"features": nn.Sequential(*layers)}).requires_grad_(False)
    return network.to(memory_format=torch.channels_last)


def trained_layer(torch: Any, arrays: Arrays, number: int) -> Any:
    """Return a convolution with the weights of a trained network.

    Parameters
    ----------
    torch : module
    arrays : mapping from str to array
        As of `folded_arrays`.
    number : int
        Of the layer, from 0.
    """
    weights = torch.as_tensor(arrays[f"weights_{number}"].astype(np.float32))
    biases = torch.as_tensor(arrays[f"biases_{number}"].astype(np.float32))
    outputs, inputs, size, _ = weights.shape
    stride = 2 if number == 0 else 1
    layer = torch.nn.Conv2d(inputs, outputs, size, stride=stride)
    layer.weight.data, layer.bias.data = weights, biases
    return layer


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
    inputs = torch.as_tensor(levels).permute(0, 3, 1, 2)
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


def make_box_head(torch: Any, channels: int, hidden: int) -> Any:
    """Return the head for boxes, with random first weights.

    Parameters
    ----------
    torch : module
    channels : int
        Of the features.
    hidden : int
        Channels between its two layers.
    """
    nn = torch.nn
    sides = nn.Sequential(
        nn.Conv2d(channels, hidden, 1),
        nn.BatchNorm2d(hidden),
        nn.ReLU(),
        nn.Conv2d(hidden, 4, 1),
    )
    nn.init.zeros_(sides[-1].weight)
    nn.init.zeros_(sides[-1].bias)
    own = {
        name: nn.Sequential(nn.Conv2d(channels, channels, 3), nn.BatchNorm2d(channels))
        for name in ("exemplar", "search")
    }
    return nn.ModuleDict({**own, "sides": sides})


def box_sides(torch: Any, head: Any, exemplars: Any, searches: Any) -> Any:
    """Return the sides of the boxes that a head predicts at all places.

    Parameters
    ----------
    torch : module
    head
        As of `make_box_head`.
    exemplars : (B, C, 6, 6)
    searches : (B, C, 22, 22)
        Of the same vehicles.

    Returns
    -------
    (B, 4, 17, 17)
        Distances of left, top, right and bottom from each place, in samples.

    References
    ----------
    Correlation channel by channel, after a layer of its own for each side: Li, Wu,
    Wang, Zhang, Xing, Yan, "SiamRPN++", CVPR 2019, section 3.3. Distances of the sides,
    as exponentials: Tian, Shen, Chen, He, "FCOS", ICCV 2019, section 3.1.
    """
    exemplars, searches = head["exemplar"](exemplars), head["search"](searches)
    count, channels, side = exemplars.shape[:3]
    matches = torch.nn.functional.conv2d(
        searches.reshape(1, count * channels, *searches.shape[2:]),
        exemplars.reshape(count * channels, 1, side, side),
        groups=count * channels,
    )
    matches = matches.reshape(count, channels, *matches.shape[2:]) / side
    return SIDE_UNIT * torch.exp(
        head["sides"](matches).float().clamp(-MOST_LOG, MOST_LOG)
    )


def folded_arrays(torch: Any, network: Any) -> Arrays:
    """Return the arrays of `simbench.trackers.parts.siamese_network`, float16.

    Batch normalisation, which after training is a scale and a bias for each channel,
    goes into the convolution before it.
    """
    found: dict[str, NDArray[np.float16]] = {}
    for number, (weights, biases) in enumerate(_folded(torch, network["features"])):
        found[f"weights_{number}"], found[f"biases_{number}"] = weights, biases
    scale, bias = (network["response"][name].item() for name in ("scale", "bias"))
    found["response"] = np.array([scale, bias], np.float16)
    return found


def folded_box_arrays(torch: Any, head: Any) -> Arrays:
    """Return the arrays of `simbench.trackers.parts.siamese_box`, float16."""
    found: dict[str, NDArray[np.float16]] = {}
    for name in ("exemplar", "search"):
        ((found[f"box_{name}_weights"], found[f"box_{name}_biases"]),) = _folded(
            torch, head[name]
        )
    for number, (weights, biases) in enumerate(_folded(torch, head["sides"])):
        found[f"box_weights_{number}"] = weights[:, :, 0, 0]
        found[f"box_biases_{number}"] = biases
    return found


def _folded(
    torch: Any, layers: Any
) -> Iterator[tuple[NDArray[np.float16], NDArray[np.float16]]]:
    """Yield weights and biases of convolutions, with the normalisation after them."""
    for layer, norm in pairwise([*layers, None]):
        if not isinstance(layer, torch.nn.Conv2d):
            continue
        weights, biases = layer.weight.detach(), layer.bias.detach()
        if isinstance(norm, torch.nn.BatchNorm2d):
            gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
            weights = weights * gain.detach()[:, None, None, None]
            biases = (biases - norm.running_mean) * gain + norm.bias
        yield _half(weights), _half(biases)


def _half(values: Any) -> NDArray[np.float16]:
    return to_array(values.contiguous()).astype(np.float16)
