"""Fully connected layers, learnt while tracking, that tell the target from the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.patch_network import FeatureLayers

__all__ = [
    "LearningSettings",
    "OnlineClassifier",
    "hardest",
    "layer_gradients",
    "log_odds",
]

Values = NDArray[np.floating]
Layers = list[tuple[Values, Values]]

FIRST_DEVIATION = 0.01
"""Standard deviation of the first weights of the last layer, of the authors' code."""


@dataclass(frozen=True, slots=True)
class LearningSettings:
    """How the layers are learnt.

    Attributes
    ----------
    rate : float
        Step size of all layers but the last.
    last_factor : float
        How much larger that of the last layer is.
    momentum : float, in [0, 1)
    decay : float
        Of the weights.
    dropout : float, in [0, 1)
        Share of the hidden values that are left out in a step.
    positives, negatives : int
        Examples of a step.
    tried : int
        Negative examples that are tried in a step; the hardest of them are used.
    longest : float
        Length to which longer gradients of a step are cut.
    """

    rate: float
    last_factor: float = 10.0
    momentum: float = 0.9
    decay: float = 5e-4
    dropout: float = 0.5
    positives: int = 32
    negatives: int = 96
    tried: int = 1024
    longest: float = 10.0


class OnlineClassifier:
    """Two trained layers and a new one on top: the domain-specific branch of a target.

    Parameters
    ----------
    layers : FeatureLayers
        First weights of the two layers; they are copied.
    settings : LearningSettings
    rng : numpy.random.Generator
        For the first weights of the last layer, and for all that is sampled later.

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking" (MDNet), CVPR 2016: sections 4.1 (a new branch fc6, learnt online with fc4
    and fc5), 4.2 (hard minibatch mining), 5.1 (sizes of minibatches, momentum, decay).
    """

    def __init__(
        self,
        layers: FeatureLayers,
        settings: LearningSettings,
        rng: np.random.Generator,
    ) -> None:
        shape = (layers[-1][0].shape[1], 2)
        last = (FIRST_DEVIATION * rng.standard_normal(shape)).astype(np.float32)
        self.layers: Layers = [(w.copy(), b.copy()) for w, b in layers]
        self.layers.append((last, np.zeros(2, np.float32)))
        self._settings, self._rng = settings, rng

    def probabilities(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the probability that each of (N, D) features is the target, (N,)."""
        odds = log_odds(self.layers, features)
        return np.asarray(0.5 + 0.5 * np.tanh(0.5 * odds), np.float32)

    def learn(
        self,
        positives: NDArray[np.float32],
        negatives: NDArray[np.float32],
        iterations: int,
        factor: float = 1.0,
    ) -> None:
        """Learn on by stochastic gradient descent.

        Parameters
        ----------
        positives, negatives : (P, D), (N, D) float32
            Features of the target and of what is not, at least one each.
        iterations : int
        factor : float
            On the step size.
        """
        own, rng = self._settings, self._rng
        speeds = [(np.zeros_like(w), np.zeros_like(b)) for w, b in self.layers]
        for _ in range(iterations):
            tried = negatives[_sampled(len(negatives), own.tried, rng)]
            hard = hardest(log_odds(self.layers, tried), own.negatives)
            chosen = positives[_sampled(len(positives), own.positives, rng)]
            features = np.concatenate([chosen, tried[hard]])
            labels = np.repeat([1, 0], [len(chosen), len(hard)])
            kept = self._kept(len(features))
            gradients = layer_gradients(self.layers, features, labels, kept)
            self._descend(gradients, speeds, factor)

    def _descend(self, gradients: Layers, speeds: Layers, factor: float) -> None:
        """Move all values down, with momentum; change the speeds in place."""
        own = self._settings
        squares = sum(float((each**2).sum()) for both in gradients for each in both)
        shrink = min(1.0, own.longest / max(squares**0.5, 1e-12))
        for number, layer in enumerate(self.layers):
            is_last = number == len(self.layers) - 1
            rate = factor * own.rate * (own.last_factor if is_last else 1.0)
            for values, speed, gradient, decay in zip(
                layer, speeds[number], gradients[number], (own.decay, 0.0), strict=True
            ):
                speed *= np.float32(own.momentum)
                speed -= np.float32(rate * shrink) * gradient
                speed -= np.float32(rate * decay) * values
                values += speed

    def _kept(self, count: int) -> list[NDArray[np.float32]]:
        """Return factors, 0 or the same above 1, of the hidden values of examples."""
        share = 1.0 - self._settings.dropout
        return [
            (self._rng.random((count, len(biases)), np.float32) < share).astype(
                np.float32
            )
            / np.float32(share)
            for _, biases in self.layers[:-1]
        ]


def hardest(odds: Values, count: int) -> NDArray[np.int64]:
    """Return the indices of negative examples that look most like the target.

    Parameters
    ----------
    odds : (N,) float
        Log odds that they are the target.
    count : int
        Of N, at most.

    References
    ----------
    MDNet, section 4.2, hard minibatch mining.
    """
    return np.argsort(-odds, kind="stable")[:count]


def log_odds(layers: Layers, features: Values) -> Values:
    """Return the log odds that (N, D) features are the target, (N,)."""
    values = features
    for weights, biases in layers[:-1]:
        values = np.maximum(values @ weights + biases, 0.0)
    weights, biases = layers[-1]
    scores = values @ weights + biases
    return np.asarray(scores[:, 1] - scores[:, 0])


def layer_gradients(
    layers: Layers, features: Values, labels: NDArray[np.int64], kept: list[Values]
) -> Layers:
    """Return the gradient of the mean softmax loss by all weights and biases.

    Parameters
    ----------
    layers : list of (weights, biases)
        ReLU follows each but the last, which has two outputs: not the target, target.
    features : (N, D) float
    labels : (N,) int
        1 for the target, 0 for what is not.
    kept : list of (N, units) float
        Factors on the hidden values of each layer but the last: dropout.

    Returns
    -------
    list of (weights, biases)
        Shaped as ``layers``.

    References
    ----------
    Srivastava, Hinton, Krizhevsky, Sutskever, Salakhutdinov, "Dropout", JMLR 2014,
    section 5.1, with the factor in training in place of in use.
    """
    inputs = [features]
    for (weights, biases), factors in zip(layers[:-1], kept, strict=True):
        inputs.append(np.maximum(inputs[-1] @ weights + biases, 0.0) * factors)
    weights, biases = layers[-1]
    scores = inputs[-1] @ weights + biases
    odds = np.exp(scores - scores.max(axis=1, keepdims=True))
    slope = odds / odds.sum(axis=1, keepdims=True)
    slope[np.arange(len(labels)), labels] -= 1.0
    slope /= len(labels)
    found: Layers = []
    for number in range(len(layers) - 1, -1, -1):
        found.append((inputs[number].T @ slope, slope.sum(axis=0)))
        if number:
            passes = (inputs[number] > 0.0) * kept[number - 1]
            slope = (slope @ layers[number][0].T) * passes
    return found[::-1]


def _sampled(total: int, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return count of total indices, different ones as far as there are enough."""
    return rng.choice(total, count, replace=total < count)
