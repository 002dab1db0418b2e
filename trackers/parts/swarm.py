"""Particle swarm optimisation on the affine group."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import log_between, moved

__all__ = ["Swarm"]

# Limits of one step, by mode E1 to E6: without them the attraction, which overshoots
# by up to c1 + c2, deforms the shapes before the swarm has contracted.
MAX_STEP = np.array([0.3, 0.1, 0.1, 0.05, 2.0, 2.0])
NEAR = 0.5  # boxes


@dataclass(slots=True)
class Swarm:
    """The states, best states and velocities of N particles.

    Attributes
    ----------
    states : (N, 2, 3) float, px
        Current states.
    best_states : (N, 2, 3) float, px
        State at which each particle had its highest confidence.
    best_confidences : (N,) float, in [0, 1]
        Confidence at ``best_states``.
    velocities : (N, 6) float
        Last step of each particle, in the Lie algebra.
    """

    states: NDArray[np.float64]
    best_states: NDArray[np.float64]
    best_confidences: NDArray[np.float64]
    velocities: NDArray[np.float64]

    @classmethod
    def start(
        cls, states: NDArray[np.float64], confidences: NDArray[np.float64]
    ) -> Swarm:
        """Make a swarm at rest from states and their (N,) confidences."""
        return cls(states, states.copy(), confidences, np.zeros((len(states), 6)))

    @property
    def best(self) -> NDArray[np.float64]:
        """The best state of all particles so far, (2, 3) px."""
        state: NDArray[np.float64] = self.best_states[self.best_confidences.argmax()]
        return state

    @property
    def best_confidence(self) -> float:
        """Confidence of the best state."""
        return float(self.best_confidences.max())

    @property
    def cloud(self) -> NDArray[np.float64]:
        """The best states as (N, 3): x, y in px and normalised confidence."""
        total = max(float(self.best_confidences.sum()), 1e-12)
        places = self.best_states[:, :, 2]
        return np.column_stack([places, self.best_confidences / total])

    def move(
        self, *, inertia: float, own: float, common: float, rng: np.random.Generator
    ) -> None:
        """Move every particle towards its own best state and the swarm's best.

        ``v <- K (v + c1 e1 log(X^-1 P) + c2 e2 log(X^-1 G))``, ``X <- X exp(v)``,
        with e1 and e2 uniform in [0, 1], one of each per particle.

        References
        ----------
        Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle
        tracking", ETRI Journal 2020 (DSP), eqs. 5 and 6, read in the Lie algebra:
        as printed they add and multiply group elements.
        """
        samples = rng.random((2, len(self.states), 1))
        attraction = own * samples[0] * log_between(self.states, self.best_states)
        attraction += common * samples[1] * log_between(self.states, self.best[None])
        # A half turn has no real logarithm; such a particle is not attracted.
        steps = inertia * (self.velocities + attraction)
        self.velocities = np.minimum(np.maximum(steps, -MAX_STEP), MAX_STEP)
        self.states = moved(self.states, self.velocities)

    def mean(self, width: float) -> NDArray[np.float64]:
        """Return the mean, (2, 3) px, of the best states near the swarm's best.

        Weights are ``exp((c - max c) / width)`` of the confidences c, and the mean is
        taken in the Lie algebra at the best state, over states within `NEAR` boxes of
        it: one state out of fifty is noisy, mostly in size.
        """
        best = self.best
        offsets = log_between(best[None], self.best_states)
        weights = self._likelihoods(width)
        weights *= np.hypot(offsets[:, 4], offsets[:, 5]) < NEAR
        step = weights @ offsets / weights.sum()
        mean: NDArray[np.float64] = moved(best[None], step[None])[0]
        return mean

    def weights(self, width: float) -> NDArray[np.float64]:
        """Return the (N,) weights ``exp((c - max c) / width)``, which sum to 1."""
        weights = self._likelihoods(width)
        return np.asarray(weights / weights.sum())

    def _likelihoods(self, width: float) -> NDArray[np.float64]:
        return np.exp((self.best_confidences - self.best_confidence) / width)

    def remember(self, confidences: NDArray[np.float64]) -> None:
        """Update the best states with the (N,) confidences of the current states."""
        better = confidences > self.best_confidences
        self.best_states[better] = self.states[better]
        self.best_confidences[better] = confidences[better]
