"""Dynamic swarm particle: particle filter on the affine group with swarm steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.affine_group import compose, exp, inverse, log
from simbench.trackers.parts.appearance import Appearance, ellipses_of
from simbench.trackers.parts.swarm import Swarm

__all__ = ["DynamicSwarmParticle"]

MIN_SIDE_PX = 3.0
SCALE_RANGE = (0.1, 10.0)  # of the first box, each side
GROWTH_GAIN = 0.05  # weight of the newest change of size in the velocity
LEARN_EVERY = 3  # frames of sufficient confidence
ASPECT_NOISE, ROTATION_NOISE, SHEAR_NOISE = 0.01, 0.01, 0.005  # E2, E3, E4


@dataclass(kw_only=True, eq=False)
class DynamicSwarmParticle:
    """Dynamic swarm particle: affine particle filter with swarm steps, N = 50.

    In each frame particles start from the last estimate with noise on every mode,
    shifted by the autoregressive velocity. If the best confidence reaches ``stop``, the
    frame is done; otherwise each particle keeps the better of its two states, shifted
    or not, and the swarm steps until the best confidence reaches ``stop`` or the
    iterations are used up.

    Parameters
    ----------
    particles : int
        N.
    iterations : int
        Maximum number of swarm steps in a frame.
    stop : float, in [0, 1]
        Confidence at which a frame is done.
    alpha : float
        Share of the velocity kept from frame to frame.
    smoothing : float, in (0, 1]
        Weight of the last displacement in the velocity; 1 is eq. 2 of the paper.
    inertia, own, common : float
        K, c1 and c2 of the swarm step.
    position_noise : float
        Standard deviation of modes E5 and E6, in boxes.
    first_position_noise : float
        The same in the first update, where no velocity is known.
    scale_noise : float
        Standard deviation of mode E1.
    hidden : int
        Hidden units of the extreme learning machine.
    structure : float, in [0, 1]
        Weight of that machine in the confidence; the remainder is colour.
    surround, background : float
        As for the colour likelihood.
    trust : float, in [0, 1]
        Confidence below which the swarm's best state is rejected and the target is
        propagated at its velocity; 0 always accepts it, as the paper does.
    learn_from : float, in [0, 1]
        Confidence at which the appearance is learnt.
    keep_cloud : bool
        Whether estimates carry the particle cloud.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 3, eqs. 1 to 6.

    Notes
    -----
    Chosen here where the paper is silent or ambiguous: noise and velocity act on the
    right, in the frame of the target, translations in box sizes; only translation and
    growth of the velocity are kept, since the noise of the other modes would make the
    shape a random walk; the shifted states are measured first, and the others only if
    the confidence of the shifted ones is below ``stop``; particles start from the last
    estimate.

    Trust and smoothing depart from the paper. A swarm always finds a state with some
    similarity to the target; while a pole occludes the car that is the pole, or the
    road beside it, and the displacement to it becomes the velocity. Particles,
    iterations, stop, inertia, own and common are the paper's; the other defaults were
    tuned on the scenario library, seeds 1000 to 1005.
    """

    particles: int = 50
    iterations: int = 5
    stop: float = 0.8
    alpha: float = 1.0
    inertia: float = 0.8
    own: float = 2.05
    common: float = 2.05
    position_noise: float = 0.3
    first_position_noise: float = 1.2
    scale_noise: float = 0.05
    hidden: int = 200
    structure: float = 0.4
    surround: float = 0.75
    background: float = 8.0
    trust: float = 0.6
    learn_from: float = 0.7
    smoothing: float = 0.15
    keep_cloud: bool = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name, least in (("particles", 1), ("hidden", 1), ("iterations", 0)):
            if (value := getattr(self, name)) < least:
                raise TrackerError(f"{name} must be at least {least}, got {value}")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        x, y = box.center
        sides = np.maximum([box.width, box.height], MIN_SIDE_PX)
        self._state = np.array([[sides[0], 0.0, x], [0.0, sides[1], y]])
        self._sides_low = np.maximum(sides * SCALE_RANGE[0], MIN_SIDE_PX)
        self._sides_high = sides * SCALE_RANGE[1]
        self._velocity: NDArray[np.float64] | None = None  # unknown in the first frame
        self._rng = rng
        self._confident_frames = 0
        self._appearance = Appearance(
            frame.image,
            self._state,
            hidden=self.hidden,
            structure=self.structure,
            surround=self.surround,
            background=self.background,
            rng=rng,
        )
        # Compile the kernels here, so that the first update is not timed with it.
        self._appearance.confidences(frame.image, self._state[None])
        log(exp(np.zeros((1, 6))))

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        before = self._appearance.evaluations
        swarm = self._transition(frame.image)
        for _ in range(self.iterations):
            if swarm.best_confidence >= self.stop:
                break
            swarm.move(
                inertia=self.inertia, own=self.own, common=self.common, rng=self._rng
            )
            swarm.states = self._bounded(swarm.states)
            swarm.remember(self._appearance.confidences(frame.image, swarm.states))
        particles = self._appearance.evaluations - before
        self._advance(swarm)
        if swarm.best_confidence >= self.learn_from:
            self._confident_frames += 1
            if self._confident_frames % LEARN_EVERY == 0:
                self._appearance.learn(frame.image, self._state)
        x, y, half_width, half_height = ellipses_of(self._state[None])[0].tolist()
        return Estimate(
            box=Box.from_center(x, y, 2.0 * half_width, 2.0 * half_height),
            confidence=swarm.best_confidence,
            particles=particles,
            cloud=_snapshot(swarm) if self.keep_cloud else None,
        )

    def _transition(self, image: NDArray[np.uint8]) -> Swarm:
        """Sample the particles and shift them by the velocity, eqs. 2 to 4."""
        first = self._velocity is None
        count = 4 * self.particles if first else self.particles
        spread = self.first_position_noise if first else self.position_noise
        shape_noise = [self.scale_noise, ASPECT_NOISE, ROTATION_NOISE, SHEAR_NOISE]
        scales = np.array([*shape_noise, spread, spread])
        noise = exp(self._rng.standard_normal((count, 6)) * scales)
        unshifted = self._bounded(compose(self._state, noise))
        if self._velocity is None:
            confidences = self._appearance.confidences(image, unshifted)
            kept = np.argsort(confidences)[-self.particles :]
            return Swarm.start(unshifted[kept], confidences[kept])
        shift = compose(self._state, exp(self.alpha * self._velocity))
        shifted = self._bounded(compose(shift, noise))
        swarm = Swarm.start(shifted, self._appearance.confidences(image, shifted))
        if swarm.best_confidence < self.stop:
            swarm.states = unshifted
            swarm.remember(self._appearance.confidences(image, unshifted))
            swarm.states = swarm.best_states.copy()
        return swarm

    def _advance(self, swarm: Swarm) -> None:
        """Set the estimate to the swarm's best and update the velocity, eq. 1.

        Below the trusted confidence the last estimate moves on at its velocity.
        """
        if self._velocity is None:
            moved = self._displacement(swarm.best)
            self._velocity = moved * [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
        elif swarm.best_confidence < self.trust:
            self._state = compose(self._state, exp(self._velocity))
            return
        else:
            gains = np.array([GROWTH_GAIN, 0.0, 0.0, 0.0, *[self.smoothing] * 2])
            moved = self._displacement(swarm.best)
            self._velocity = self._velocity + gains * (moved - self._velocity)
        self._state = swarm.best

    def _displacement(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (6,) log of the last estimate's inverse times ``state``."""
        return np.nan_to_num(log(compose(inverse(self._state), state)))

    def _bounded(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 2, 3) states with the lengths of their sides clipped."""
        sides = np.hypot(states[:, 0, :2], states[:, 1, :2])
        factors = np.clip(sides, self._sides_low, self._sides_high) / sides
        bounded = states.copy()
        bounded[:, :, :2] *= factors[:, None, :]
        return bounded


def _snapshot(swarm: Swarm) -> NDArray[np.float64]:
    """Return the swarm as (N, 3): x, y in px and normalised confidence."""
    total = max(float(swarm.best_confidences.sum()), 1e-12)
    return np.column_stack([swarm.best_states[:, :, 2], swarm.best_confidences / total])
