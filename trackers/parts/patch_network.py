"""Convolutions from patches to features, run without PyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.box_patches import PATCH_SAMPLES
from simbench.trackers.parts.convolution import (
    convolve_3x3,
    kernel_matrix,
    largest_of_3x3,
    winograd_weights,
)
from simbench.trackers.parts.siamese_network import (
    level_weights,
    pooled_first_layer,
)

__all__ = ["PATCH_KERNELS", "FeatureLayers", "PatchNetwork"]

PATCH_KERNELS: Final = (7, 3, 3)
"""Sides of the convolutions; the first has a stride of 2. A maximum over 3 x 3 with a
stride of 2 follows the first and the second."""
_LAST_SIDE: Final = 3  # rows and columns of the last layer's values

Values = NDArray[np.float32]
FeatureLayers = list[tuple[Values, Values]]
"""Weights, (inputs, outputs), and biases of fully connected layers."""


class PatchNetwork:
    """Three convolutions, and the first weights of two fully connected layers.

    Parameters
    ----------
    arrays : mapping from str to array
        ``weights_K``, (outputs, inputs, k, k), and ``biases_K``, (outputs,), of three
        convolutions (K = 0, 1, 2); ``weights_K``, (outputs, inputs), and ``biases_K``
        of two fully connected layers (K = 3, 4), the first on 3 x 3 places, row by row,
        with the channels of each together.

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking" (MDNet), CVPR 2016, section 3.1: conv1 to conv3, fc4 and fc5. There,
    convolutions have 96, 256 and 512 channels and fully connected layers 512 units; the
    sizes here are smaller for the sake of speed (see the recipe), and there is no
    normalisation of local responses.

    Attributes
    ----------
    fully_connected : FeatureLayers
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        try:
            own = {name: each.astype(np.float32) for name, each in arrays.items()}
            self._first = level_weights(own["weights_0"], own["biases_0"])
            self._second = winograd_weights(own["weights_1"]), own["biases_1"]
            self._third = kernel_matrix(own["weights_2"]), own["biases_2"]
            self.fully_connected: FeatureLayers = [
                (np.ascontiguousarray(own[f"weights_{k}"].T), own[f"biases_{k}"])
                for k in (3, 4)
            ]
            side = PATCH_SAMPLES
            blank = self.features(np.zeros((1, side, side, 3), np.uint8))
            for weights, biases in self.fully_connected:
                blank = blank @ weights + biases
        except (KeyError, ValueError, TypeError) as error:
            raise TrackerError(
                f"weights: expected those of a multi-domain network, got others: "
                f"{error}"
            ) from None

    def features(self, patches: NDArray[np.uint8]) -> Values:
        """Return the features of patches: the values of the last convolution.

        Parameters
        ----------
        patches : (N, 64, 64, 3) uint8, RGB

        Returns
        -------
        (N, 9 * C) float32
            At least 0; of 3 x 3 places, row by row.
        """
        weights, biases = self._third
        pooled = np.stack([self._second_layer(patch) for patch in patches])
        found = _below_3x3(pooled) @ weights
        found += biases
        np.maximum(found, 0.0, out=found)
        return found.reshape(len(patches), -1)

    def _second_layer(self, patch: NDArray[np.uint8]) -> Values:
        """Return the values of the second layer, pooled, (5, 5, C)."""
        values = pooled_first_layer(patch, *self._first)
        return largest_of_3x3(convolve_3x3(values, *self._second, 0.0))


def _below_3x3(values: Values) -> Values:
    """Return the values below a 3 x 3 kernel at each of its places, (9 * N, 9 * C).

    Of N pictures, (N, 5, 5, C), one after the other; of each, row by row.
    """
    count, _, _, channels = values.shape
    picture, down, right, channel = values.strides
    side = _LAST_SIDE
    below = as_strided(
        values,
        (count, side, side, 3, 3 * channels),
        (picture, down, right, down, channel),
        writeable=False,
    )
    return below.reshape(count * side**2, -1)
