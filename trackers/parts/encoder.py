"""Encoder of a stacked denoising auto-encoder, run on patches without PyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import simbench.trackers.weights.encoder
from simbench.core.errors import TrackerError
from simbench.trackers.parts.weights_file import load_network

__all__ = ["PATCH_SCALE", "Encoder", "load_encoder"]

PATCH_SCALE: Final = 32.0
"""Factor on patches of norm 1 and 1024 samples: these then have a deviation of 1."""
_LEAST_DEVIATION = 0.01  # of a unit: one that hardly changes tells nothing


class Encoder:
    """Logistic layers from patches to features.

    Parameters
    ----------
    arrays : mapping from str to array
        ``weights_K``, (inputs, units), and ``biases_K``, (units,), of the layers K = 0,
        1, ...; ``mean`` and ``deviation`` of the last layer's units over the patches
        of the training, (units,).

    Attributes
    ----------
    inputs, units : int
        Sizes of a patch and of its features.

    References
    ----------
    Wang and Yeung, "Learning a deep compact image representation for visual tracking",
    NIPS 2013 (DLT), section 3.1.

    Notes
    -----
    With ``sigmoid(x) = (1 + tanh(x / 2)) / 2`` all halves and the scale of the patches
    go into weights and biases, so that a layer is one product and one tanh.
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        try:
            self._layers = _folded(arrays)
            mean = arrays["mean"].astype(np.float32)
            deviation = arrays["deviation"].astype(np.float32)
            self.inputs, self.units = len(self._layers[0][0]), len(mean)
            scale = np.sqrt(self.units) * np.maximum(deviation, _LEAST_DEVIATION)
            self._gain = (0.5 / scale).astype(np.float32)
            self._offset = ((0.5 - mean) / scale).astype(np.float32)
            self.features(np.zeros((1, self.inputs), np.float32))
        except (KeyError, IndexError, ValueError, TypeError) as error:
            raise TrackerError(
                f"weights: expected the layers of an encoder, got others: {error}"
            ) from None

    def features(self, patches: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the features of patches.

        Parameters
        ----------
        patches : (N, inputs) float32
            Grey levels of mean 0 and norm 1.

        Returns
        -------
        (N, units) float32
            Over the patches of the training each has mean 0, and their squares sum up
            to 1 on average.
        """
        values = patches
        for weights, biases in self._layers:
            values = values @ weights
            values += biases
            np.tanh(values, out=values)
        values *= self._gain
        values += self._offset
        return values


def load_encoder(path: str = "") -> Encoder:
    """Return the encoder of a file, see `read_weights`; by default the shipped one.

    Raises
    ------
    TrackerError
        If the file cannot be read, or holds no encoder.
    """
    return load_network(Encoder, path, simbench.trackers.weights.encoder)


def _folded(
    arrays: Mapping[str, NDArray[Any]],
) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Return weights and biases of the layers for tanh in place of the sigmoid."""
    layers = []
    count = sum(name.startswith("weights_") for name in arrays)
    for number in range(count):
        weights = arrays[f"weights_{number}"].astype(np.float32)
        biases = arrays[f"biases_{number}"].astype(np.float32)
        if number == 0:
            weights, biases = 0.5 * PATCH_SCALE * weights, 0.5 * biases
        else:
            biases = 0.5 * biases + 0.25 * weights.sum(axis=0)
            weights = 0.25 * weights
        layers.append((np.ascontiguousarray(weights), biases))
    return layers
