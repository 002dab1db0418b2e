"""Particle swarm optimisation on the affine group."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import compose, exp, inverse, log

__all__ = ["Swarm"]

# Bounds on one step, by mode E1 to E6: without them the attraction, which overshoots
# by up to c1 + c2, tears shapes apart before the swarm has contracted.
LARGEST_STEP = np.array([0.3, 0.1, 0.1, 0.05, 2.0, 2.0])


@dataclass(slots=True)
class Swarm:
    """N particles with what they remember, and one step of all of them.

    Attributes
    ----------
    states : (N, 2, 3) float, px
        Where the particles are.
    best_states : (N, 2, 3) float, px
        Where each has been most confident.
    best_confidences : (N,) float, in [0, 1]
        How confident it was there.
    velocities : (N, 6) float
        Last step of each, in the Lie algebra.
    """

    states: NDArray[np.float64]
    best_states: NDArray[np.float64]
    best_confidences: NDArray[np.float64]
    velocities: NDArray[np.float64]

    @classmethod
    def start(
        cls, states: NDArray[np.float64], confidences: NDArray[np.float64]
    ) -> Swarm:
        """Start at rest from measured states."""
        return cls(states, states.copy(), confidences, np.zeros((len(states), 6)))

    @property
    def best(self) -> NDArray[np.float64]:
        """The best state any particle has seen, (2, 3) px."""
        state: NDArray[np.float64] = self.best_states[self.best_confidences.argmax()]
        return state

    @property
    def best_confidence(self) -> float:
        """How confident it was there."""
        return float(self.best_confidences.max())

    def move(
        self, *, inertia: float, own: float, common: float, rng: np.random.Generator
    ) -> None:
        """Draw every particle towards its own best and the swarm's best.

        ``v <- K (v + c1 e1 log(X^-1 P) + c2 e2 log(X^-1 G))``, ``X <- X exp(v)``,
        with e1 and e2 uniform in [0, 1], one each a particle.

        References
        ----------
        Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle
        tracking", ETRI Journal 2020 (DSP), eqs. 5 and 6, read in the Lie algebra:
        as printed they add and multiply group elements.
        """
        back = inverse(self.states)
        draws = rng.random((2, len(self.states), 1))
        pull = own * draws[0] * log(compose(back, self.best_states))
        pull += common * draws[1] * log(compose(back, self.best))
        steps = inertia * (self.velocities + pull)
        # A half turn away there is no logarithm; such a particle stays where it is.
        steps = np.nan_to_num(steps, nan=0.0)
        self.velocities = np.clip(steps, -LARGEST_STEP, LARGEST_STEP)
        self.states = compose(self.states, exp(self.velocities))

    def remember(self, confidences: NDArray[np.float64]) -> None:
        """Take in the (N,) confidences of the present states."""
        better = confidences > self.best_confidences
        self.best_states[better] = self.states[better]
        self.best_confidences[better] = confidences[better]
