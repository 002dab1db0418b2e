"""Radial-basis-function network: one layer of Gaussian units and a linear output."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrackerError

__all__ = ["Network", "fit_linear", "fit_rbf"]

Array = NDArray[np.float64]
_PARTS = ("mean", "scale", "centres", "inverse_widths", "weights", "bias")


@dataclass(frozen=True, slots=True)
class Network:
    """A network with Gaussian units; without any, a linear map of its inputs.

    Attributes
    ----------
    mean, scale : (D,) float
        Inputs are taken relative to the mean, in units of the scale.
    centres : (C, D) float
        Of the units, c_i of eqs. 5 and 6; C is 0 for a linear map.
    inverse_widths : (C,) float
        b_i of eqs. 5 and 6.
    weights : (C, O) or, for a linear map, (D, O) float
        w_j of eq. 7, by output.
    bias : (O,) float
        b of eq. 7.

    References
    ----------
    Zhong, Peng, Zhong, "Severe-dynamic tracking problems based on lower particles
    resampling", TELKOMNIKA 12(6), 2014 (NBRF), eqs. 5 to 7:
    ``G_i = exp(-(|g - c_i| b_i)^2)``, output ``sum_j w_j G_j + b``.
    """

    mean: Array
    scale: Array
    centres: Array
    inverse_widths: Array
    weights: Array
    bias: Array

    def predict(self, inputs: Array) -> Array:
        """Return the (O,) output for (D,) inputs."""
        if len(self.centres) == 0:
            return ((inputs - self.mean) / self.scale) @ self.weights + self.bias
        result: Array = _predict(
            inputs,
            self.mean,
            self.scale,
            self.centres,
            self.inverse_widths,
            self.weights,
            self.bias,
        )
        return result

    def to_arrays(self, prefix: str) -> dict[str, NDArray[np.float32]]:
        """Return the parts by name, each after a prefix, to store."""
        return {f"{prefix}.{n}": getattr(self, n).astype(np.float32) for n in _PARTS}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]], prefix: str) -> Network:
        """Return the network of stored parts.

        Raises
        ------
        TrackerError
            If a part is missing, is not finite, or shapes do not fit together.
        """
        try:
            parts = [
                np.ascontiguousarray(arrays[f"{prefix}.{n}"], float) for n in _PARTS
            ]
            network = cls(*parts)
            is_finite = all(np.isfinite(part).all() for part in parts)
            if is_finite and network.predict(network.mean).shape == network.bias.shape:
                return network
        except (KeyError, TypeError, ValueError):
            pass
        raise TrackerError(
            f"weights: expected the parts of a network named {prefix!r} whose shapes "
            "fit together, got others"
        )


def fit_rbf(
    inputs: Array,
    targets: Array,
    *,
    units: int,
    ridge: float,
    rng: np.random.Generator,
) -> Network:
    """Fit a network: centres drawn from the samples, output by regularised squares.

    Parameters
    ----------
    inputs : (S, D) float
    targets : (S, O) float
    units : int
        C, at most S.
    ridge : float
        Penalty on the squared weights, times S.
    rng : numpy.random.Generator
        Draws the centres.

    Returns
    -------
    Network
        All units are as wide as the median distance between two centres.
    """
    mean, scale = _moments(inputs)
    samples = (inputs - mean) / scale
    chosen = np.sort(rng.choice(len(samples), min(units, len(samples)), replace=False))
    centres = samples[chosen]
    gaps = np.sqrt(_square_distances(centres, centres))
    width = float(np.median(gaps[np.triu_indices(len(gaps), 1)])) or 1.0
    activity = np.exp(-_square_distances(samples, centres) / width**2)
    weights, bias = _ridge(activity, targets, ridge)
    inverse = np.full(len(centres), 1.0 / width)
    return Network(mean, scale, centres, inverse, weights, bias)


def fit_linear(inputs: Array, targets: Array, *, ridge: float) -> Network:
    """Fit a linear map, arguments as for `fit_rbf`."""
    mean, scale = _moments(inputs)
    weights, bias = _ridge((inputs - mean) / scale, targets, ridge)
    empty = np.empty((0, inputs.shape[1]))
    return Network(mean, scale, empty, np.empty(0), weights, bias)


def _moments(inputs: Array) -> tuple[Array, Array]:
    """Return mean and standard deviation of the columns; 1 where one is constant."""
    deviation = inputs.std(axis=0)
    return inputs.mean(axis=0), np.where(deviation > 1e-9, deviation, 1.0)


def _square_distances(first: Array, second: Array) -> Array:
    """Return (N, M) squared distances of (N, D) and (M, D) points."""
    squares = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1)
    return np.asarray(np.maximum(squares - 2.0 * first @ second.T, 0.0))


def _ridge(activity: Array, targets: Array, ridge: float) -> tuple[Array, Array]:
    """Return weights and bias of least squares with a penalty on the weights."""
    middle, level = activity.mean(axis=0), targets.mean(axis=0)
    centred = activity - middle
    gram = centred.T @ centred + ridge * len(activity) * np.eye(activity.shape[1])
    weights = np.linalg.solve(gram, centred.T @ (targets - level))
    return weights, np.asarray(level - middle @ weights)


@numba.njit(cache=True)
def _predict(  # type: ignore[no-untyped-def]  # numba infers the types
    inputs, mean, scale, centres, inverse_widths, weights, bias
):
    result = bias.copy()
    point = (inputs - mean) / scale
    for i in range(centres.shape[0]):
        square = 0.0
        for k in range(point.shape[0]):
            square += (point[k] - centres[i, k]) ** 2
        unit = np.exp(-square * inverse_widths[i] ** 2)
        for j in range(result.shape[0]):
            result[j] += weights[i, j] * unit
    return result
