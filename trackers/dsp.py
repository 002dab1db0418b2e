"""Dynamic swarm particle: a particle filter on the affine group that swarms."""

from __future__ import annotations

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

SMALLEST_SIDE_PX = 3.0
SCALE_RANGE = (0.1, 10.0)  # of the first box, each side
GROWTH_GAIN = 0.05  # of the newest change of size in the velocity
LEARN_EVERY = 3  # of the frames that are sure enough to learn from
ASPECT_NOISE, ROTATION_NOISE, SHEAR_NOISE = 0.01, 0.01, 0.005  # E2, E3, E4


class DynamicSwarmParticle:
    """Dynamic swarm particle: affine particle filter with swarm steps, N = 50.

    A frame's particles start from the last estimate with noise on every mode, shifted
    by the autoregressive velocity. Where the best of them is sure enough the frame is
    done; otherwise each keeps the better of its two places, shifted or not, and the
    swarm steps until the best is sure enough or the iterations are used up.

    Parameters
    ----------
    particles : int
        N.
    iterations : int
        Swarm steps at most, in a frame.
    stop : float, in [0, 1]
        Confidence from which a frame is done.
    alpha : float
        Share of the velocity that goes on.
    smoothing : float, in (0, 1]
        Share of the last displacement in the velocity; 1 is eq. 2 of the paper.
    inertia, own, common : float
        K, c1 and c2 of the swarm step.
    position_noise : float
        Standard deviation of modes E5 and E6, in boxes.
    first_position_noise : float
        The same in the first frame, where no velocity is known.
    scale_noise : float
        Standard deviation of mode E1.
    hidden : int
        Hidden units of the extreme learning machine.
    structure : float, in [0, 1]
        Weight of the machine in the confidence; the rest is colour.
    surround, background : float
        As for the colour likelihood.
    trust : float, in [0, 1]
        Confidence below which the swarm's best is not believed and the target carries
        on at its velocity; 0 always believes, as the paper does.
    learn_from : float, in [0, 1]
        Confidence from which the appearance is learnt.
    keep_cloud : bool
        Whether estimates carry the particle cloud.

    References
    ----------
    Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking",
    ETRI Journal 2020 (DSP), section 3, eqs. 1 to 6.

    Notes
    -----
    Chosen where the paper is silent or cannot be read: noise and velocity act on the
    right, in the frame of the target, translations in box sizes; of the velocity only
    translation and growth are carried on, since the noise of the other modes would
    random-walk the shape; the shifted place is measured first, and the other one only
    where the shifted ones leave doubt; particles start from the last estimate.

    Trust and smoothing depart from the paper. A swarm always finds something that
    looks a little like the target; while a pole hides the car that is the pole, or the
    road beside it, and the displacement to there becomes the velocity. Particles,
    iterations, stop, inertia, own and common are the paper's; the other defaults were
    tuned on the library's scenarios, seeds 1000 to 1005.
    """

    def __init__(
        self,
        *,
        particles: int = 50,
        iterations: int = 5,
        stop: float = 0.8,
        alpha: float = 1.0,
        inertia: float = 0.8,
        own: float = 2.05,
        common: float = 2.05,
        position_noise: float = 0.3,
        first_position_noise: float = 1.2,
        scale_noise: float = 0.05,
        hidden: int = 200,
        structure: float = 0.4,
        surround: float = 0.75,
        background: float = 8.0,
        trust: float = 0.6,
        learn_from: float = 0.7,
        smoothing: float = 0.15,
        keep_cloud: bool = False,
    ) -> None:
        for name, value in {"particles": particles, "hidden": hidden}.items():
            if value < 1:
                raise TrackerError(f"{name} must be at least 1, got {value}")
        if iterations < 0:
            raise TrackerError(f"iterations must be at least 0, got {iterations}")
        self.particles = particles
        self.iterations = iterations
        self.stop = stop
        self.alpha = alpha
        self.inertia = inertia
        self.own = own
        self.common = common
        self.position_noise = position_noise
        self.first_position_noise = first_position_noise
        self.scale_noise = scale_noise
        self.hidden = hidden
        self.structure = structure
        self.surround = surround
        self.background = background
        self.trust = trust
        self.learn_from = learn_from
        self.smoothing = smoothing
        self.keep_cloud = keep_cloud

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Start on a frame in which ``box`` (px) bounds the target."""
        x, y = box.center
        sides = np.maximum([box.width, box.height], SMALLEST_SIDE_PX)
        self._state = np.array([[sides[0], 0.0, x], [0.0, sides[1], y]])
        self._sides_low = np.maximum(sides * SCALE_RANGE[0], SMALLEST_SIDE_PX)
        self._sides_high = sides * SCALE_RANGE[1]
        self._velocity: NDArray[np.float64] | None = None  # unknown: one frame seen
        self._rng = rng
        self._frames = 0
        self._appearance = Appearance(
            frame.image,
            self._state,
            hidden=self.hidden,
            structure=self.structure,
            surround=self.surround,
            background=self.background,
            rng=rng,
        )
        # Compiles what the first update would otherwise wait for.
        self._appearance.confidences(frame.image, self._state[None])
        log(exp(np.zeros((1, 6))))

    def update(self, frame: Frame) -> Estimate:
        """Return where the target is in the next frame."""
        before = self._appearance.evaluations
        swarm = self._transition(frame.image)
        for _ in range(self.iterations):
            if swarm.best_confidence >= self.stop:
                break
            swarm.move(
                inertia=self.inertia, own=self.own, common=self.common, rng=self._rng
            )
            swarm.states = self._tamed(swarm.states)
            swarm.remember(self._appearance.confidences(frame.image, swarm.states))
        particles = self._appearance.evaluations - before
        self._advance(swarm)
        if swarm.best_confidence >= self.learn_from:
            self._frames += 1
            if self._frames % LEARN_EVERY == 0:
                self._appearance.learn(frame.image, self._state)
        x, y, half_width, half_height = ellipses_of(self._state[None])[0].tolist()
        return Estimate(
            box=Box.from_center(x, y, 2.0 * half_width, 2.0 * half_height),
            confidence=swarm.best_confidence,
            particles=particles,
            cloud=_snapshot(swarm) if self.keep_cloud else None,
        )

    def _transition(self, image: NDArray[np.uint8]) -> Swarm:
        """Spread the particles and shift them by the velocity, eqs. 2 to 4."""
        first = self._velocity is None
        count = 4 * self.particles if first else self.particles
        spread = self.first_position_noise if first else self.position_noise
        scales = np.array(
            [
                self.scale_noise,
                ASPECT_NOISE,
                ROTATION_NOISE,
                SHEAR_NOISE,
                spread,
                spread,
            ]
        )
        noise = exp(self._rng.standard_normal((count, 6)) * scales)
        resting = self._tamed(compose(self._state, noise))
        if self._velocity is None:
            confidences = self._appearance.confidences(image, resting)
            kept = np.argsort(confidences)[-self.particles :]
            return Swarm.start(resting[kept], confidences[kept])
        shift = compose(self._state, exp(self.alpha * self._velocity))
        shifted = self._tamed(compose(shift, noise))
        swarm = Swarm.start(shifted, self._appearance.confidences(image, shifted))
        if swarm.best_confidence < self.stop:
            swarm.states = resting
            swarm.remember(self._appearance.confidences(image, resting))
            swarm.states = swarm.best_states.copy()
        return swarm

    def _advance(self, swarm: Swarm) -> None:
        """Make the swarm's best the estimate and its displacement the velocity, eq. 1.

        Where the swarm is not to be trusted, the target carries on as it went.
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

    def _tamed(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 2, 3) states with the lengths of their sides in bounds."""
        sides = np.hypot(states[:, 0, :2], states[:, 1, :2])
        bounded = np.clip(sides, self._sides_low, self._sides_high)
        tamed = states.copy()
        tamed[:, :, :2] *= (bounded / sides)[:, None, :]
        return tamed


def _snapshot(swarm: Swarm) -> NDArray[np.float64]:
    """Return the swarm as (N, 3): x, y in px and normalised confidence."""
    total = max(float(swarm.best_confidences.sum()), 1e-12)
    return np.column_stack([swarm.best_states[:, :, 2], swarm.best_confidences / total])
