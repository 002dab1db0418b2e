"""DLT: random walk on affine parameters, with an encoder and a logistic layer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.affine_patches import (
    bounded,
    box_of,
    side_limits,
    state_of,
)
from simbench.trackers.parts.encoder import load_encoder
from simbench.trackers.parts.logistic_appearance import LogisticAppearance
from simbench.trackers.parts.parameter_checks import check_counts
from simbench.trackers.parts.resampling import systematic
from simbench.trackers.parts.transitions import parameter_walk

__all__ = ["Dlt"]


@dataclass(kw_only=True, eq=False)
class Dlt:
    """Deep learning tracker: particle filter that a trained encoder weighs.

    In each frame: resample, move by a random walk on the affine parameters, weigh
    each particle by the probability that a logistic layer gives to the features of its
    patch, and take the best particle. The layer is fitted again in every
    ``learn_every``-th frame, and where the best probability falls below
    ``learn_below``.

    Parameters
    ----------
    particles : int
    weights : str
        File of the encoder's weights, of ``simbench train encoder``; the shipped one
        where it is empty.
    learn_below : float, in [0, 1]
        Confidence of the best particle below which the layer is fitted again.
    learn_every : int
        Frames after which it is in any case.
    keep_above : float, in [0, 1]
        Confidence from which the patch of a frame is kept as a positive sample.
    position_noise : float
        Standard deviation of the position, in sides of the target.
    scale_noise, aspect_noise, rotation_noise, shear_noise : float
        Standard deviations of the log of the scale, of half the log of the aspect, of
        the angle in radians, and of the shear.
    keep_cloud : bool
        Whether estimates carry the particle cloud.

    References
    ----------
    Wang and Yeung, "Learning a deep compact image representation for visual tracking",
    NIPS 2013 (DLT), section 3; Jati, Gunawan et al., "Dynamic swarm particle for fast
    motion vehicle tracking", ETRI Journal 2020 (DSP), section 4, a comparison with it.

    Notes
    -----
    Departures: the encoder is smaller (docs/encoder.md) and fixed, only the logistic
    layer is fitted while tracking, where the paper tunes all layers; 100 particles
    where it takes 1,000. Positive samples are those of the first frame and of the last
    ten frames that were clearly seen, negative ones surround the target in this frame
    and in the one learnt from before. Chosen here: systematic resampling; noise in
    sides of the target rather than in pixels.
    """

    particles: int = 100
    weights: str = ""
    learn_below: float = 0.8
    learn_every: int = 50
    keep_above: float = 0.6
    position_noise: float = 0.12
    scale_noise: float = 0.02
    aspect_noise: float = 0.002
    rotation_noise: float = 0.005
    shear_noise: float = 0.001
    keep_cloud: bool = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        check_counts(self, "particles", "learn_every")
        load_encoder(self.weights)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._state = state_of(box)
        self._rng = rng
        self._states = np.tile(self._state, (self.particles, 1, 1))
        self._weights = np.full(self.particles, 1.0 / self.particles)
        self._extent = np.array(frame.image.shape[1::-1], np.float64)
        self._sides = side_limits(self._state)
        self._frames_since = 0  # the layer was fitted
        self._appearance = LogisticAppearance(
            frame.image, self._state, encoder=load_encoder(self.weights), rng=rng
        )
        self._appearance.confidences(self._states)  # compiles, before time is taken

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        ancestors = self._states[systematic(self._weights, self._rng)]
        moved = parameter_walk(ancestors, self._noise(), self._rng)
        self._states = bounded(moved, self._sides, self._extent)
        self._appearance.look_at(frame.image, self._state)
        confidences = self._appearance.confidences(self._states)
        best = int(confidences.argmax())
        confidence = float(confidences[best])
        self._state = self._states[best]
        total = float(confidences.sum())
        uniform = np.full(self.particles, 1.0 / self.particles)
        self._weights = confidences / total if total > 0.0 else uniform
        self._learn(confidence)
        cloud = np.column_stack([self._states[:, :, 2], self._weights])
        return Estimate(
            box_of(self._state),
            confidence=confidence,
            particles=self.particles,
            cloud=cloud if self.keep_cloud else None,
        )

    def _learn(self, confidence: float) -> None:
        """Keep the target's patch where it is clearly seen, and fit where due."""
        if confidence >= self.keep_above:
            self._appearance.keep(self._state)
        self._frames_since += 1
        if confidence < self.learn_below or self._frames_since >= self.learn_every:
            self._appearance.learn(self._state)
            self._frames_since = 0

    def _noise(self) -> NDArray[np.float64]:
        """Return the (6,) deviations of scale, aspect, rotation, shear, x and y."""
        shape = [self.scale_noise, self.aspect_noise]
        shape += [self.rotation_noise, self.shear_noise]
        return np.array([*shape, self.position_noise, self.position_noise])
