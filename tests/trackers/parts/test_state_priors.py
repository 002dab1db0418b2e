"""The losses by what is expected of size and place, and the limits of size."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.trackers.parts.state_priors import clipped, prior_losses

STATE = np.array([[40.0, 0.0, 100.0], [0.0, 20.0, 50.0]])
EXPECTED = np.log([40.0, 20.0])
SIDES = np.array([40.0, 20.0])


@pytest.mark.parametrize(
    ("state", "losses"),
    [
        pytest.param(STATE, [0.0, 0.0, 0.0], id="as expected"),
        pytest.param(STATE * [[2.0, 2.0, 1.0]], [0.48045, 0.0, 0.0], id="larger"),
        pytest.param(STATE * [[2.0, 0.5, 1.0]], [0.0, 1.92181, 0.0], id="longer"),
        pytest.param(STATE + [[0, 0, 40], [0, 0, 40]], [0.0, 0.0, 5.0], id="away"),
    ],
)
def test_each_prior_takes_its_own_square(
    state: np.ndarray, losses: list[float]
) -> None:
    taken = [
        prior_losses(state[None], EXPECTED, STATE, SIDES, prior)[0]
        for prior in np.eye(3)
    ]
    assert taken == pytest.approx(losses, abs=1e-4)


def test_sides_are_clipped_each_for_itself_and_places_kept() -> None:
    states = np.stack([STATE, STATE * [[0.1, 3.0, 1.0]]])
    low, high = np.array([10.0, 10.0]), np.array([80.0, 40.0])
    bounded = clipped(states, low, high)
    assert bounded[0].tolist() == STATE.tolist()
    assert bounded[1].tolist() == [[10.0, 0.0, 100.0], [0.0, 40.0, 50.0]]
