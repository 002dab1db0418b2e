"""Appearance model of the swarm: confidence that a state contains the target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp
from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.extreme_learning import ExtremeLearningMachine
from simbench.trackers.parts.patches import PATCH_SIDE, normalised_patches

__all__ = ["Appearance", "ellipses_of"]

LABEL_SD = 0.25  # boxes: fall-off of the label, wide enough to give a gradient
FULL_BLEND = 0.9  # value of a well-placed state some frames after the first
COLOUR_SAMPLES = 256
FIRST_PATCHES, LATER_PATCHES = 400, 60
COLOUR_SHARE = 0.1
RIDGE, MEMORY = 0.1, 0.9


def ellipses_of(states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ellipses inscribed in affine states.

    Parameters
    ----------
    states : (N, 2, 3) float, px

    Returns
    -------
    (N, 4) float, px
        Centre x, y and half axes: half the lengths of the two sides. Tilt is ignored.
    """
    sides = np.hypot(states[:, 0, :2], states[:, 1, :2])
    return np.concatenate([states[:, :, 2], sides / 2.0], axis=1)


class Appearance:
    """Confidence that affine states contain the target, from structure and colour.

    An extreme learning machine on normalised grey patches measures structure, the
    colour likelihood measures colour. The machine alone has a sharp maximum but false
    maxima far off; colour alone is smooth and recovers a lost target, but does not
    separate it from similar cars beside it. The blend separates them and keeps a
    gradient towards the target.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        First frame.
    state : (2, 3) float, px
        State of the target there: maps the unit square [-0.5, 0.5]^2 to the image.
    hidden : int
        Hidden units of the machine.
    structure : float, in [0, 1]
        Weight of the machine; the remainder is colour.
    surround, background : float
        As for the colour likelihood.
    rng : numpy.random.Generator
        Source of the hidden layer and of the training offsets.

    Attributes
    ----------
    evaluations : int
        States evaluated so far, training patches excluded.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 3.3. Patches go to the machine directly, where
    the paper uses a trained auto-encoder first; the blend with colour is added here.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        state: NDArray[np.float64],
        *,
        hidden: int,
        structure: float,
        surround: float,
        background: float,
        rng: np.random.Generator,
    ) -> None:
        self.evaluations = 0
        self._rng = rng
        self._structure = structure
        self._colour = ColourLikelihood(
            image,
            ellipses_of(state[None])[0],
            samples=COLOUR_SAMPLES,
            sigma=1.0,  # only similarities are used
            surround=surround,
            background=background,
        )
        self._machine = ExtremeLearningMachine(
            PATCH_SIDE**2, hidden=hidden, ridge=RIDGE, memory=MEMORY, rng=rng
        )
        self._train(image, state, FIRST_PATCHES)

    def confidences(
        self, image: NDArray[np.uint8], states: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (N,) confidences in [0, 1] of (N, 2, 3) states, and count them."""
        self.evaluations += len(states)
        colour = self._colour.similarities(image, ellipses_of(states))
        structure = self._machine.predict(normalised_patches(image, states))
        blend = self._structure * np.clip(structure, 0.0, 1.0)
        blend += (1.0 - self._structure) * colour
        return np.clip(blend / FULL_BLEND, 0.0, 1.0)

    def learn(self, image: NDArray[np.uint8], state: NDArray[np.float64]) -> None:
        """Update the model with the target's appearance at a reliable state."""
        self._colour.learn(image, ellipses_of(state[None])[0], COLOUR_SHARE)
        self._train(image, state, LATER_PATCHES)

    def _train(
        self, image: NDArray[np.uint8], state: NDArray[np.float64], count: int
    ) -> None:
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
        patches = normalised_patches(image, compose(state, exp(offsets)))
        self._machine.learn(patches, labels)
