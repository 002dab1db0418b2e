"""Statistics of the transitions: means and deviations of what they add."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.trackers.parts.affine_group import compose, exp, log_between
from simbench.trackers.parts.affine_patches import state_of
from simbench.trackers.parts.transitions import (
    GrowingAlpha,
    autoregressive,
    brownian,
    graded_noise,
    mode_noise,
    parameter_walk,
)

COUNT = 6000
DEVIATIONS = np.array([0.05, 0.02, 0.03, 0.01, 0.3, 0.2])
VELOCITY = np.array([0.04, 0.0, 0.0, 0.0, 0.5, -0.25])


def turned(angle: float) -> NDArray[np.float64]:
    """Return COUNT copies of the state of a box of 40 x 20 px, turned by an angle."""
    state = compose(state_of(Box(20.0, 10.0, 40.0, 20.0)), exp(np.zeros(6)))
    cosine, sine = np.cos(angle), np.sin(angle)
    state[:, :2] = np.array([[cosine, -sine], [sine, cosine]]) @ state[:, :2]
    return np.tile(state, (COUNT, 1, 1))


def test_brownian_motion_has_the_deviations_in_the_frame_of_the_target() -> None:
    states = turned(0.7)
    moved = brownian(states, DEVIATIONS, np.random.default_rng(1))
    steps = log_between(states, moved)
    np.testing.assert_allclose(steps.std(axis=0), DEVIATIONS, rtol=0.05)
    assert (np.abs(steps.mean(axis=0)) < 5.0 * DEVIATIONS / np.sqrt(COUNT)).all()


@pytest.mark.parametrize("alpha", [0.0, 0.5, 1.0])
def test_autoregression_keeps_its_share_of_the_velocity(alpha: float) -> None:
    states = turned(0.7)
    noise = mode_noise(COUNT, DEVIATIONS, np.random.default_rng(2))
    steps = log_between(states, autoregressive(states, VELOCITY, alpha, noise))
    error = np.abs(steps.mean(axis=0) - alpha * VELOCITY)
    assert (error < 5.0 * DEVIATIONS / np.sqrt(COUNT)).all()
    np.testing.assert_allclose(steps.std(axis=0), DEVIATIONS, rtol=0.05)


def test_growing_alpha_rises_to_its_last_value_and_stays() -> None:
    alpha = GrowingAlpha(first=0.2, step=0.3, last=0.9)
    values = [alpha.next() for _ in range(5)]
    np.testing.assert_allclose(values, [0.2, 0.5, 0.8, 0.9, 0.9])


def test_parameter_walk_moves_along_the_image_whatever_the_angle() -> None:
    """The group's noise turns with the target; that of the parameters does not."""
    states = turned(np.pi / 2)
    only_x = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0])
    walked = parameter_walk(states, only_x, np.random.default_rng(3))
    spread = (walked - states)[:, :, 2].std(axis=0)
    np.testing.assert_allclose(spread, [4.0, 0.0], rtol=0.05, atol=1e-9)
    moved = brownian(states, only_x, np.random.default_rng(3))
    spread = (moved - states)[:, :, 2].std(axis=0)
    np.testing.assert_allclose(spread, [0.0, 4.0], rtol=0.05, atol=1e-9)


def test_parameter_walk_has_the_deviations_of_each_parameter() -> None:
    states = turned(0.4)
    walked = parameter_walk(states, DEVIATIONS, np.random.default_rng(4))
    width = np.hypot(walked[:, 0, 0], walked[:, 1, 0])
    angle = np.arctan2(walked[:, 1, 0], walked[:, 0, 0])
    height = np.linalg.det(walked[:, :, :2]) / width
    shear = np.einsum("nk,nk->n", walked[:, :, 0], walked[:, :, 1]) / width / height
    found = [
        (0.5 * np.log(width * height)).std(),
        (0.5 * np.log(width / height)).std(),
        angle.std(),
        shear.std(),
        walked[:, 0, 2].std() / 40.0,
        walked[:, 1, 2].std() / 20.0,
    ]
    np.testing.assert_allclose(found, DEVIATIONS, rtol=0.05)
    assert angle.mean() == pytest.approx(0.4, abs=0.01)


def test_parameter_walk_without_noise_stays() -> None:
    states = brownian(turned(0.4), DEVIATIONS, np.random.default_rng(5))
    walked = parameter_walk(states, np.zeros(6), np.random.default_rng(6))
    np.testing.assert_allclose(walked, states, atol=1e-9)


def test_graded_noise_rises_from_none_to_all() -> None:
    rng = np.random.default_rng(7)
    rows = np.array([graded_noise(50, DEVIATIONS, 0.1, rng) for _ in range(1500)])
    spread = rows.std(axis=0) / DEVIATIONS
    assert (rows[:, 0] == 0.0).all()
    np.testing.assert_allclose(spread[-1], 1.0, rtol=0.1)
    np.testing.assert_allclose(spread[1], 0.1 ** (48 / 49), rtol=0.1)
    same = graded_noise(50, DEVIATIONS, 1.0, np.random.default_rng(8))
    assert (same == mode_noise(50, DEVIATIONS, np.random.default_rng(8))).all()
