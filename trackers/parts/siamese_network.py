"""A Siamese network, run on square crops without PyTorch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.convolution import (
    convolve,
    convolve_3x3,
    kernel_matrix,
    largest_of_3x3,
    winograd_weights,
)
from simbench.trackers.parts.square_crops import EXEMPLAR_SAMPLES

__all__ = [
    "KERNELS",
    "LEVEL_MEAN",
    "LEVEL_SPREAD",
    "RESPONSE_SIDE",
    "STRIDE",
    "SiameseNetwork",
    "level_weights",
    "pooled_first_layer",
]

KERNELS: Final = (7, 3, 3, 3, 3)
"""Sides of the convolutions; the first has a stride of 2 and is pooled by 2."""
STRIDE: Final = 4
"""Samples of a crop from one feature to the next."""
RESPONSE_SIDE: Final = 17
"""Places at which an exemplar is compared with a search region, along each side."""
LEVEL_MEAN, LEVEL_SPREAD = 114.0, 58.0
"""Of the grey levels that the first layer expects with mean 0 and deviation 1."""

Picture = NDArray[np.float32]


class SiameseNetwork:
    """Convolutions from square crops to features, and their correlation.

    Parameters
    ----------
    arrays : mapping from str to array
        ``weights_K``, (outputs, inputs, k, k), and ``biases_K``, (outputs,), of the
        five convolutions, and ``response``, (2,): scale and bias of the responses.

    References
    ----------
    Bertinetto, Valmadre, Henriques, Vedaldi, Torr, "Fully-convolutional Siamese
    networks for object tracking", ECCV workshops 2016, section 2, with fewer channels
    and smaller crops.

    Attributes
    ----------
    exemplar_samples : int
        Rows and columns of the crop that `exemplar` takes.
    """

    exemplar_samples: int = EXEMPLAR_SAMPLES

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        try:
            self._first, *self._others = _folded(arrays)
            self._scale, self._bias = (float(each) for each in arrays["response"])
            self._features(np.zeros((EXEMPLAR_SAMPLES, EXEMPLAR_SAMPLES, 3), np.uint8))
        except (KeyError, ValueError, TypeError) as error:
            raise TrackerError(
                f"weights: expected those of a Siamese network, got others: {error}"
            ) from None

    def exemplar(self, crop: NDArray[np.uint8]) -> Picture:
        """Return what search regions are compared with, (6 * 6, C).

        Parameters
        ----------
        crop : (64, 64, 3) uint8, RGB
            The target, see `simbench.trackers.parts.square_crops`.
        """
        found = self._features(crop)
        channels = found.shape[-1]
        return found.reshape(-1, channels)

    def responses(
        self, exemplar: Picture, crops: NDArray[np.uint8]
    ) -> NDArray[np.float32]:
        """Return the responses of search regions to an exemplar, (K, 17, 17).

        Parameters
        ----------
        exemplar : (6 * 6, C) float32
            As of `exemplar`.
        crops : (K, 128, 128, 3) uint8, RGB

        Returns
        -------
        (K, 17, 17) float32
            Log odds that the target is there; `STRIDE` samples apart, the middle one
            in the middle of the crop.
        """
        return np.stack(
            [self._correlated(exemplar, self._features(crop)) for crop in crops]
        )

    def outer_layers(self, crop: NDArray[np.uint8]) -> tuple[Picture, Picture]:
        """Return the features of the first and of the last layer.

        Parameters
        ----------
        crop : (n, n, 3) uint8, RGB

        Returns
        -------
        first : (m, m, C) float32
            Pooled, after the ReLU; 30 x 30 for a crop of 128.
        last : (m - 8, m - 8, C) float32
            As of `exemplar`.
        """
        first = self._first_layer(crop)
        return first, self._later_layers(first)

    def _correlated(self, exemplar: Picture, found: Picture) -> Picture:
        """Return the response of features, (22, 22, C), to an exemplar, (17, 17)."""
        rows, columns, channels = found.shape
        side = round(len(exemplar) ** 0.5)
        height, width = rows - side + 1, columns - side + 1
        products = (exemplar @ found.reshape(-1, channels).T).reshape(
            side, side, rows, columns
        )
        total = np.zeros((height, width), np.float32)
        for down in range(side):
            for right in range(side):
                total += products[
                    down, right, down : down + height, right : right + width
                ]
        gain = self._scale / math.sqrt(exemplar.size)
        return np.float32(gain) * total + np.float32(self._bias)

    def _features(self, crop: NDArray[np.uint8]) -> Picture:
        """Return the features of a crop, (n, n, C)."""
        return self._later_layers(self._first_layer(crop))

    def _first_layer(self, crop: NDArray[np.uint8]) -> Picture:
        """Return the values of the first layer, pooled."""
        return pooled_first_layer(crop, *self._first)

    def _later_layers(self, values: Picture) -> Picture:
        """Return the values of the last layer, given those of the first."""
        for number, (weights, biases) in enumerate(self._others, 1):
            is_last = number == len(self._others)
            values = convolve_3x3(
                values, weights, biases, -math.inf if is_last else 0.0
            )
        return values


def _folded(
    arrays: Mapping[str, NDArray[Any]],
) -> list[tuple[Picture, Picture]]:
    """Return weights and biases, as of `convolution`; the first takes grey levels."""
    layers = []
    for number in range(len(KERNELS)):
        weights = arrays[f"weights_{number}"].astype(np.float32)
        biases = arrays[f"biases_{number}"].astype(np.float32)
        if number == 0:
            layers.append(level_weights(weights, biases))
        else:
            layers.append((winograd_weights(weights), biases))
    return layers


def level_weights(weights: Picture, biases: Picture) -> tuple[Picture, Picture]:
    """Return the first layer, (K, C, k, k) and (K,), as it takes grey levels.

    The weights as a matrix of `convolve`.
    """
    weights = weights / np.float32(LEVEL_SPREAD)
    biases = biases - np.float32(LEVEL_MEAN) * weights.sum(axis=(1, 2, 3))
    return kernel_matrix(weights), biases


def pooled_first_layer(
    crop: NDArray[np.uint8], weights: Picture, biases: Picture
) -> Picture:
    """Return the values of the first layer, pooled, after the ReLU.

    Parameters
    ----------
    crop : (H, W, 3) uint8, RGB
    weights, biases : array
        As of `level_weights`.
    """
    values = convolve(crop.astype(np.float32), weights, KERNELS[0], 2)
    values = largest_of_3x3(values)
    values += biases  # as if before the maximum, but of fewer values
    return np.maximum(values, 0.0, out=values)
