"""Extreme learning machine on patches or their features: confidence of the swarm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp
from simbench.trackers.parts.appearance import Appearance
from simbench.trackers.parts.encoder import Encoder
from simbench.trackers.parts.extreme_learning import ExtremeLearningMachine
from simbench.trackers.parts.patches import grey_patches

__all__ = ["MachineAppearance"]

MACHINE_SIDE = 32  # px (DSP, section 3.3)
LABEL_SD = 0.25  # boxes: fall-off of the label, wide enough to give a gradient
FIRST_PATCHES, LATER_PATCHES = 1000, 100
RIDGE, MEMORY = 10.0, 0.9  # a smaller ridge sees the target in far places too


class MachineAppearance(Appearance):
    """Extreme learning machine on normalised grey patches, or on features of them.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        First frame.
    state : (2, 3) float, px
        The target there: maps the unit square [-0.5, 0.5]^2 to the image.
    encoder : Encoder, optional
        What the machine reads the features of; by default it reads the patches.
    hidden : int
        Hidden units of the machine.
    rng : numpy.random.Generator
        Source of the hidden layer and of the training offsets.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 3.3: a stacked denoising auto-encoder with an
    extreme learning machine on top.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        state: NDArray[np.float64],
        *,
        encoder: Encoder | None = None,
        hidden: int,
        rng: np.random.Generator,
    ) -> None:
        super().__init__(MACHINE_SIDE)
        self._rng = rng
        self._encoder = encoder
        inputs = MACHINE_SIDE**2 if encoder is None else encoder.units
        self._machine = ExtremeLearningMachine(
            inputs, hidden=hidden, ridge=RIDGE, memory=MEMORY, rng=rng
        )
        self.look_at(image, state)
        self._train(state, FIRST_PATCHES)

    def confidences(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N,) confidences in [0, 1] of (N, 2, 3) states, and count them."""
        self.evaluations += len(states)
        outputs = self._machine.predict(self._inputs(states))
        return np.asarray(np.clip(outputs, 0.0, 1.0))

    def learn(self, state: NDArray[np.float64]) -> None:
        """Train the machine on patches at, around and away from a reliable state."""
        self._train(state, LATER_PATCHES)

    def learn_background(self, state: NDArray[np.float64]) -> None:
        """Learn nothing: the paper's machine learns both at once."""

    def _train(self, state: NDArray[np.float64], count: int) -> None:
        """Train the machine on patches on, around and away from a state.

        A third each is sampled with a standard deviation of 0.1, 0.5 and 2 boxes; the
        label is a Gaussian of the distance in boxes and in log size.
        """
        spreads = np.resize([0.1, 0.5, 2.0], count)
        offsets = np.zeros((count, 6))
        offsets[:, 4:] = self._rng.standard_normal((count, 2)) * spreads[:, None]
        offsets[:, 0] = self._rng.standard_normal(count) * np.minimum(spreads, 0.3)
        offsets[0] = 0.0
        squared = np.sum(offsets[:, 4:] ** 2, axis=1) + (2.0 * offsets[:, 0]) ** 2
        labels = np.exp(-squared / (2.0 * LABEL_SD**2))
        states = compose(state, exp(offsets))
        self._machine.learn(self._inputs(states), labels)

    def _inputs(self, states: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return what the machine reads of (N, 2, 3) states, (N, inputs)."""
        patches = grey_patches(self._covering(states), states, self._side)
        return patches if self._encoder is None else self._encoder.features(patches)
