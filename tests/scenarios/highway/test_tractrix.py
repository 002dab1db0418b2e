from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.scenarios.highway.tractrix import body_poses
from simbench.scenarios.network.recording import class_of


def _headings(
    front: NDArray[np.float64], initial: NDArray[np.float64], length: float
) -> NDArray[np.float64]:
    _, headings, _ = body_poses(front, initial, 0.0 * initial, np.array([length]))
    return headings[:, 0]


def _front(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([x, y, np.zeros_like(x)], axis=-1)[:, None]


def test_a_body_on_a_circle_lags_by_the_geometric_angle() -> None:
    # The rear axle, b = 0.8 * 5 m behind, runs on a circle of sqrt(R^2 - b^2): the body
    # points asin(b / R) inwards of the front's direction of travel.
    angle = np.arange(0.0, 6.0, 0.02)
    front = _front(20 * np.cos(angle), 20 * np.sin(angle))
    initial = np.full((len(angle), 1), np.pi / 2)
    heading = _headings(front, initial, 5.0)
    lag = angle + np.pi / 2 - heading
    assert lag[-1] == pytest.approx(np.arcsin(4.0 / 20.0), abs=0.01)
    assert np.all(np.diff(heading) > 0)  # past pi without a jump


def test_a_corner_is_taken_without_a_jump() -> None:
    walk = np.arange(0.0, 30.0, 0.5)
    x, y = np.minimum(walk, 15.0), np.maximum(walk - 15.0, 0.0)
    heading = _headings(_front(x, y), np.zeros((60, 1)), 5.0)
    assert heading[30] == 0.0 and heading[-1] == pytest.approx(np.pi / 2, abs=0.1)
    assert np.diff(heading).max() < 0.13  # at most step / axle distance


def test_a_body_has_the_initial_heading_when_it_appears_or_has_jumped() -> None:
    x = np.array([np.nan, 0.0, 1.0, 500.0, 501.0])
    initial = np.full((5, 1), 0.5)
    heading = _headings(_front(x, np.zeros(5)), initial, 5.0)
    assert np.isnan(heading[0]) and heading[1] == 0.5 and heading[3] == 0.5
    assert heading[2] < 0.5


def test_a_standing_body_keeps_its_heading() -> None:
    front = _front(np.full(9, 3.0), np.full(9, 2.0))
    heading = _headings(front, np.full((9, 1), 1.25), 4.0)
    assert heading == pytest.approx(1.25)


@pytest.mark.parametrize(
    ("looks", "expected"),
    [
        (("passenger", "passenger", 5.0, 1.5), "car"),
        (("passenger", "passenger/van", 4.7, 1.9), "van"),
        (("passenger", "passenger", 4.8, 1.8), "suv"),
        (("passenger", "passenger", 9.0, 3.0), "truck"),
        (("truck", "truck", 7.1, 2.4), "truck"),
        (("truck", "truck/semitrailer", 16.5, 4.0), "trailer"),
        (("delivery", "delivery", 6.5, 2.9), "van"),
        (("coach", "bus/coach", 14.0, 4.0), "bus"),
        (("moped", "moped", 2.1, 1.7), "motorcycle"),
    ],
)
def test_every_sumo_class_gets_a_body(
    looks: tuple[str, str, float, float], expected: str
) -> None:
    assert class_of(*looks) == expected
