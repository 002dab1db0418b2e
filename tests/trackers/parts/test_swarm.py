"""The swarm's steps and its mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.swarm import Swarm

TARGET = np.array([5.0, -3.0])


def scattered(rng: np.random.Generator, spread: float) -> NDArray[np.float64]:
    states = np.tile(np.array([[20.0, 0.0, 0.0], [0.0, 20.0, 0.0]]), (30, 1, 1))
    states[:, :, 2] = rng.normal(0.0, spread, (30, 2))
    return states


def confidences(states: NDArray[np.float64]) -> NDArray[np.float64]:
    squared = np.sum((states[:, :, 2] - TARGET) ** 2, axis=1)
    return np.asarray(np.exp(-squared / 800.0))


def test_swarm_moves_particles_to_its_best(rng: np.random.Generator) -> None:
    states = scattered(rng, 20.0)
    swarm = Swarm.start(states, confidences(states))
    before = np.linalg.norm(swarm.best[:, 2] - TARGET)
    for _ in range(20):
        swarm.move(inertia=0.73, own=2.05, common=2.05, rng=rng)
        swarm.remember(confidences(swarm.states))
    after = np.linalg.norm(swarm.best[:, 2] - TARGET)
    assert after < 0.5 < before


def test_mean_of_the_swarm_is_nearer_than_its_noisy_best(
    rng: np.random.Generator,
) -> None:
    errors = np.empty((40, 2))
    for row in errors:
        states = scattered(rng, 6.0)
        states[:, :, 2] += TARGET
        noisy = confidences(states) + rng.normal(0.0, 0.03, len(states))
        swarm = Swarm.start(states, noisy)
        for index, state in enumerate((swarm.best, swarm.mean(0.02))):
            row[index] = np.linalg.norm(state[:, 2] - TARGET)
    assert errors[:, 1].mean() < 0.8 * errors[:, 0].mean()


def test_mean_of_the_swarm_ignores_states_elsewhere() -> None:
    states = np.tile(np.array([[20.0, 0.0, 0.0], [0.0, 20.0, 0.0]]), (2, 1, 1))
    states[1, 0, 2] = 60.0
    swarm = Swarm.start(states, np.array([0.71, 0.7]))
    assert swarm.mean(0.02)[0, 2] == 0.0
