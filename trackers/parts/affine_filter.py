"""Base of the particle filters on the affine group that share a model of appearance."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.affine_group import compose, exp, log_between
from simbench.trackers.parts.affine_patches import side_limits, state_of
from simbench.trackers.parts.best_velocity import BestVelocity
from simbench.trackers.parts.dead_reckoning import DeadReckoning
from simbench.trackers.parts.first_appearance import (
    first_appearance,
    require_appearance,
)
from simbench.trackers.parts.lost_search import search_noise
from simbench.trackers.parts.state_priors import clipped, prior_losses, sides_of
from simbench.trackers.parts.swarm import Swarm
from simbench.trackers.parts.transitions import graded_noise

__all__ = ["PAPER", "AffineFilter"]

LEARN_EVERY = 3  # frames of sufficient confidence
ASPECT_NOISE, ROTATION_NOISE, SHEAR_NOISE = 0.01, 0.01, 0.005  # E2, E3, E4
SIZE_GAIN = 0.1  # weight of the newest size in the size expected

PAPER = {
    "appearance": "encoder",
    "least_noise": 1.0,
    "size_prior": 0.0,
    "aspect_prior": 0.0,
    "motion_prior": 0.0,
    "trust_none": 0.0,
    "trust_all": 0.0,
    "size_gain": 1.0,
    "smoothing": 1.0,
    "quick": False,
    "lost_below": 0.0,
    "learn_from": 0.7,
}
"""Parameters of the papers' settings: all that departs from them is switched off."""


@dataclass(kw_only=True, eq=False)
class AffineFilter(ABC):
    """Particle filter on the affine group: what `dsp` and `gdpf-*` have in common.

    Parameters
    ----------
    particles : int
        N.
    alpha : float
        Share of the velocity kept from frame to frame.
    position_noise : float
        Standard deviation of modes E5 and E6, in boxes.
    first_position_noise : float
        The same in the first update, where no velocity is known, and in a search.
    scale_noise : float
        Standard deviation of mode E1.
    least_noise : float, in (0, 1]
        Share of the noise that the first particle has; it rises to 1 at the last one,
        so that the cloud is dense in its middle. 1 gives all of them the same.
    appearance : {"templates", "machine", "encoder"}
        `TemplateAppearance`; an extreme learning machine that reads patches; or the
        papers', which reads their features, by a stacked denoising auto-encoder.
    weights : str
        File of the encoder's weights, of ``simbench train encoder``; the shipped one
        where it is empty.
    hidden : int
        Hidden units of the machine.
    structure, balance, first_share, template_gain, colour_gain, background_gain
        As for `TemplateAppearance`.
    size_prior, aspect_prior : float
        Confidence lost by the squared log size and log aspect ratio of a state,
        relative to the size expected from earlier frames.
    motion_prior : float
        Confidence lost by the squared distance, in boxes, from the predicted place.
    mean_width : float
        Width, in confidence, of the weights of the mean that is the estimate; 0 takes
        the best state, as the paper does.
    trust_none, trust_all : float, in [0, 1]
        Confidences between which the estimate passes from the prediction to the
        particles' state; 0 and 0 always accept that, as the paper does.
    size_gain : float, in [0, 1]
        Share of a measured change of size that is accepted.
    smoothing : float, in (0, 1]
        Weight of the last displacement in the velocity; 1 is eq. 2 of the paper.
    quick : bool
        Whether the last displacement is the velocity where it predicts better, see
        `BestVelocity`.
    lost_below : float, in [0, 1]
        Share of the usual confidence below which the target is lost: nothing is learnt
        then, and 4 N particles search around the place of its `DeadReckoning`, more
        widely with every frame. 0 never searches, as the paper.
    found_above : float, in [0, 1]
        Confidence that the particles of a search must reach, beside that of the others.
    learn_from, background_from : float, in [0, 1]
        Confidence at which the appearance is learnt, every third time, and at which
        the colours around the target are.
    keep_cloud : bool
        Whether estimates carry the particle cloud.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 3.
    """

    particles: int = 50
    alpha: float = 1.0
    position_noise: float = 0.3
    first_position_noise: float = 1.2
    scale_noise: float = 0.05
    least_noise: float = 0.4
    appearance: str = "templates"
    weights: str = ""
    hidden: int = 200
    structure: float = 0.5
    balance: bool = True
    first_share: float = 0.5
    template_gain: float = 0.1
    colour_gain: float = 0.05
    background_gain: float = 0.1
    size_prior: float = 0.5
    aspect_prior: float = 1.0
    motion_prior: float = 0.05
    mean_width: float = 0.02
    trust_none: float = 0.42
    trust_all: float = 0.6
    size_gain: float = 0.5
    smoothing: float = 0.15
    quick: bool = True
    lost_below: float = 0.75
    found_above: float = 0.55
    learn_from: float = 0.55
    background_from: float = 0.5
    keep_cloud: bool = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name, least in (("particles", 1), ("hidden", 1)):
            if (value := getattr(self, name)) < least:
                raise TrackerError(f"{name} must be at least {least}, got {value}")
        if not 0.0 < self.least_noise <= 1.0:
            raise TrackerError(f"least_noise must be in (0, 1], got {self.least_noise}")
        require_appearance(self)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._state = state_of(box)
        self._predicted = self._state
        self._sides_low, self._sides_high = side_limits(self._state)
        self._expected = np.log(sides_of(self._state))
        self._velocity = BestVelocity(smoothing=self.smoothing, is_quick=self.quick)
        self._rng = rng
        self._confident_frames = 0
        self._reckoned = DeadReckoning(self._state)
        self._appearance = first_appearance(self, frame.image, self._state, rng)
        # Compile the kernels here, so that the first update is not timed with it.
        self._confidences(self._state[None])
        self._displacement(self._state)

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        before = self._appearance.evaluations
        self._appearance.look_at(frame.image, self._state)
        swarm = self._sample()
        is_found = False
        if self._is_lost(swarm.best_confidence):
            self._reckoned.frames_lost += 1
            swarm, is_found = self._search(swarm)
        else:
            self._reckoned.frames_lost = 0
        confidence = swarm.best_confidence
        is_lost = self._is_lost(confidence)
        particles = self._appearance.evaluations - before
        velocity = self._advance(swarm, is_found)
        self._reckoned.follow(self._state, velocity, confidence, is_lost=is_lost)
        if not is_lost:
            self._learn(confidence)
        width, height = sides_of(self._state).tolist()
        x, y = self._state[:, 2].tolist()
        return Estimate(
            box=Box.from_center(x, y, width, height),
            confidence=confidence,
            particles=particles,
            cloud=swarm.cloud if self.keep_cloud else None,
        )

    @abstractmethod
    def _sample(self) -> Swarm:
        """Return the particles of a frame, measured; set the predicted state."""

    @abstractmethod
    def _refine(self, swarm: Swarm) -> None:
        """Improve the particles of a frame or of a search, in place."""

    def _sample_first(self) -> Swarm:
        """Return the best N of 4 N particles: no velocity is known yet."""
        noise = exp(self._noise(4 * self.particles, self.first_position_noise))
        return self._best_of(self._bounded(compose(self._state, noise)))

    def _noise(self, count: int, spread: float) -> NDArray[np.float64]:
        """Return (count, 6) noise ``dW`` of eq. 3, graded, with ``spread`` in boxes."""
        shape = [self.scale_noise, ASPECT_NOISE, ROTATION_NOISE, SHEAR_NOISE]
        deviations = np.array([*shape, spread, spread])
        return graded_noise(count, deviations, self.least_noise, self._rng)

    def _best_of(self, states: NDArray[np.float64]) -> Swarm:
        """Return a swarm of the best N of some states."""
        confidences = self._confidences(states)
        kept = np.argsort(confidences)[-self.particles :]
        return Swarm.start(states[kept], confidences[kept])

    def _is_lost(self, confidence: float) -> bool:
        return confidence < self.lost_below * self._reckoned.usual

    def _search(self, swarm: Swarm) -> tuple[Swarm, bool]:
        """Return particles found around the place reckoned, or else ``swarm``."""
        noise = search_noise(
            self._noise,
            4 * self.particles,
            self.first_position_noise,
            self._reckoned.frames_lost,
            self._rng,
        )
        before = self._expected, self._predicted
        self._predicted = self._reckoned.state
        self._expected = np.log(sides_of(self._predicted))
        found = self._best_of(self._bounded(compose(self._predicted, noise)))
        self._refine(found)
        if found.best_confidence >= max(self.found_above, swarm.best_confidence):
            return found, True
        self._expected, self._predicted = before
        return swarm, False

    def _advance(self, swarm: Swarm, is_found: bool) -> NDArray[np.float64]:
        """Set the estimate; update and return the velocity, eq. 1."""
        state = swarm.mean(self.mean_width) if self.mean_width > 0.0 else swarm.best
        trust = self._trust(swarm.best_confidence)
        velocity = self._velocity
        if velocity.leading is None:
            leading = velocity.start(self._displacement(state), trust)
        else:
            step = log_between(self._predicted[None], state[None])[0]
            step[:4] *= self.size_gain
            state = compose(self._predicted, exp(trust * step))
            leading = velocity.follow(self._displacement(state), trust)
            if is_found and self._reckoned.velocity is not None:
                leading = velocity.restart(self._reckoned.velocity)
        self._state = self._bounded(state[None])[0]
        size = np.log(sides_of(self._state))
        self._expected = self._expected + SIZE_GAIN * (size - self._expected)
        return leading

    def _trust(self, confidence: float) -> float:
        """Return the share of the particles' state in the estimate."""
        if confidence >= self.trust_all:
            return 1.0
        rise = (confidence - self.trust_none) / (self.trust_all - self.trust_none)
        return max(rise, 0.0)

    def _learn(self, confidence: float) -> None:
        """Learn the appearance at the estimate as far as it is believed."""
        if confidence >= self.background_from:
            self._appearance.learn_background(self._state)
        if confidence >= self.learn_from:
            self._confident_frames += 1
            if self._confident_frames % LEARN_EVERY == 0:
                self._appearance.learn(self._state)

    def _confidences(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (N,) confidences of states, less what the priors take."""
        confidences = self._appearance.confidences(states)
        priors = np.array([self.size_prior, self.aspect_prior, self.motion_prior])
        losses = prior_losses(
            states, self._expected, self._predicted, sides_of(self._state), priors
        )
        return np.asarray(np.minimum(np.maximum(confidences - losses, 0.0), 1.0))

    def _displacement(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (6,) log of the last estimate's inverse times ``state``."""
        return np.asarray(log_between(self._state[None], state[None])[0])

    def _bounded(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 2, 3) states with the lengths of their sides clipped."""
        return clipped(states, self._sides_low, self._sides_high)
