"""Which of two velocities leads, on displacements whose course is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.best_velocity import BestVelocity


def steps(along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (T, 6) displacements of (T,) lengths along x, in boxes."""
    return np.column_stack([np.zeros((len(along), 4)), along, np.zeros(len(along))])


def error(moved: NDArray[np.float64], *, is_quick: bool, trust: float = 1.0) -> float:
    """Return the root mean square error, in boxes, of the later predictions."""
    velocity = BestVelocity(smoothing=0.15, is_quick=is_quick)
    best = velocity.start(moved[0], trust)
    errors = []
    for step in moved[1:]:
        errors.append(step - best)
        best = velocity.follow(step, trust)
    return float(np.sqrt(np.mean(np.square(errors[10:]))))


def test_last_displacement_leads_where_the_target_swings() -> None:
    swing = steps(0.8 * np.sin(np.arange(80) / 5.0))
    assert error(swing, is_quick=True) < 0.4 * error(swing, is_quick=False)


def test_smooth_velocity_leads_where_estimates_jitter() -> None:
    jitter = np.random.default_rng(0).normal(0.1, 0.03, 80)
    moved = steps(jitter)
    assert error(moved, is_quick=True) == error(moved, is_quick=False)


def test_smooth_velocity_leads_in_doubt() -> None:
    velocity = BestVelocity(smoothing=0.15, is_quick=True)
    swing = steps(0.8 * np.sin(np.arange(40) / 5.0))
    best = velocity.start(swing[0], 1.0)
    for step in swing[1:]:
        best = velocity.follow(step, 1.0)
    assert np.array_equal(best, swing[-1])
    best = velocity.follow(np.zeros(6), 0.0)
    assert 0.0 < np.abs(best[4]) < 0.8 * np.abs(swing[-1, 4])


def test_target_that_was_found_again_has_the_velocity_given() -> None:
    velocity = BestVelocity(smoothing=0.15, is_quick=True)
    velocity.start(np.zeros(6), 1.0)
    given = np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.1])
    assert np.array_equal(velocity.restart(given), given)
    assert velocity.leading is given
