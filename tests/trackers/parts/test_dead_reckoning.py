"""The place reckoned of a target that is not clearly seen."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.dead_reckoning import DeadReckoning


def at(x: float) -> NDArray[np.float64]:
    return np.array([[40.0, 0.0, x], [0.0, 30.0, 50.0]])


def seen_for(frames: int) -> DeadReckoning:
    """A target that moves by 2 px, a twentieth of its width, in each frame."""
    reckoned = DeadReckoning(at(100.0))
    for frame in range(1, frames + 1):
        reckoned.follow(at(100.0 + 2.0 * frame), np.zeros(6), 0.9, is_lost=False)
    return reckoned


def test_target_moves_on_where_the_tracker_stays_behind() -> None:
    reckoned = seen_for(60)
    for _ in range(10):  # the tracker holds on to what it still sees
        reckoned.follow(at(220.0), np.zeros(6), 0.6, is_lost=False)
    assert reckoned.state[0, 2] == pytest.approx(220.0 + 2.0 * 10, abs=2.5)


def test_sight_of_the_target_ends_the_reckoning() -> None:
    reckoned = seen_for(60)
    reckoned.follow(at(220.0), np.zeros(6), 0.3, is_lost=True)
    reckoned.follow(at(250.0), np.zeros(6), 0.9, is_lost=False)
    assert reckoned.state[0, 2] == 250.0
    velocity = reckoned.velocity
    assert velocity is not None
    assert velocity[4] == pytest.approx(0.05, abs=0.005)  # the jump taught it nothing


def test_usual_confidence_hardly_falls_while_lost() -> None:
    usual = []
    for is_lost in (False, True):
        reckoned = seen_for(5)
        for _ in range(20):
            reckoned.follow(at(110.0), np.zeros(6), 0.2, is_lost=is_lost)
        usual.append(reckoned.usual)
    assert usual[0] < 0.6 < 0.8 < usual[1]


def test_first_frames_better_than_the_rest_leave_nothing_behind() -> None:
    reckoned = DeadReckoning(at(100.0))
    for frame, confidence in enumerate([0.99, *[0.75] * 40], start=1):
        x = 100.0 + 2.0 * frame
        reckoned.follow(at(x), np.zeros(6), confidence, is_lost=False)
    assert reckoned.state[0, 2] == 100.0 + 2.0 * 41
    assert reckoned.usual == pytest.approx(0.75, abs=0.03)
