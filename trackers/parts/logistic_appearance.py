"""Encoder with a logistic layer: DLT's confidence that a state contains the target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp
from simbench.trackers.parts.appearance import Appearance
from simbench.trackers.parts.encoder import Encoder
from simbench.trackers.parts.logistic import LogisticLayer
from simbench.trackers.parts.patches import grey_patches

__all__ = ["LogisticAppearance"]

SIDE = 32  # px (DLT, section 3.1)
POSITIVES, NEGATIVES = 10, 100
KEPT = 10  # frames whose patches are positive samples
ON, ON_SIZE = 0.03, 0.02  # boxes and log size: deviations of positive samples
NEAREST, FARTHEST = 0.25, 2.0  # boxes: distances of negative samples
RIDGE = 1e-3


class LogisticAppearance(Appearance):
    """Logistic layer on the features of grey patches, learnt while tracking.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        First frame.
    state : (2, 3) float, px
        The target there: maps the unit square [-0.5, 0.5]^2 to the image.
    encoder : Encoder
    rng : numpy.random.Generator
        Source of the places of the samples.

    References
    ----------
    Wang and Yeung, "Learning a deep compact image representation for visual tracking",
    NIPS 2013 (DLT), section 3.2.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        state: NDArray[np.float64],
        *,
        encoder: Encoder,
        rng: np.random.Generator,
    ) -> None:
        super().__init__(SIDE)
        self._rng = rng
        self._encoder = encoder
        self._layer = LogisticLayer(encoder.units, ridge=RIDGE)
        self.look_at(image, state)
        near = np.zeros((POSITIVES, 6))
        near[1:, 4:] = ON * rng.standard_normal((POSITIVES - 1, 2))
        near[1:, 0] = ON_SIZE * rng.standard_normal(POSITIVES - 1)
        self._first = self._features(compose(state, exp(near)))
        self._kept: list[NDArray[np.float32]] = []
        self._negatives = self._features(self._around(state))
        self.learn(state)

    def confidences(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N,) confidences in [0, 1] of (N, 2, 3) states, and count them."""
        self.evaluations += len(states)
        return self._layer.predict(self._features(states))

    def keep(self, state: NDArray[np.float64]) -> None:
        """Keep the target of a frame as a positive sample of later learning."""
        self._kept = [*self._kept[1 - KEPT :], self._features(state[None])]

    def learn(self, state: NDArray[np.float64]) -> None:
        """Fit the layer to the kept targets and to what surrounds a state."""
        around = self._features(self._around(state))
        positives = np.concatenate([self._first, *self._kept])
        negatives = np.concatenate([self._negatives, around])
        self._negatives = around
        labels = np.repeat([1.0, 0.0], [len(positives), len(negatives)])
        self._layer.fit(np.concatenate([positives, negatives]), labels)

    def learn_background(self, state: NDArray[np.float64]) -> None:
        """Learn nothing: the layer learns both at once."""

    def _around(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return negative samples around a state: beside it, or of another size."""
        angles = self._rng.uniform(-np.pi, np.pi, NEGATIVES)
        ratio = FARTHEST / NEAREST
        distances = NEAREST * ratio ** self._rng.random(NEGATIVES)
        offsets = np.zeros((NEGATIVES, 6))
        offsets[:, 4] = distances * np.cos(angles)
        offsets[:, 5] = distances * np.sin(angles)
        offsets[:, 0] = 0.1 * self._rng.standard_normal(NEGATIVES)
        return compose(state, exp(offsets))

    def _features(self, states: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the (N, units) features of the patches at (N, 2, 3) states."""
        patches = grey_patches(self._covering(states), states, self._side)
        return self._encoder.features(patches)
