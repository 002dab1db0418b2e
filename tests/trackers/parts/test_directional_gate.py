"""The gate's weights and mean advance, by hand; the course's median."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.trackers.parts.course import Course, wrap
from simbench.trackers.parts.directional_gate import (
    CLOUD_OFFSET,
    WEIGHTINGS,
    forward_mean,
    gate_weights,
    reach,
)

ANGLES = [math.pi / 2, math.pi / 4, math.pi / 8]


def at(degrees: float) -> list[float]:
    return [math.cos(math.radians(degrees)), math.sin(math.radians(degrees))]


def test_weight_falls_linearly_to_zero_at_the_edge_of_the_cone() -> None:
    offsets = np.array([at(0), at(22.5), at(-45), at(67.5), at(90), at(91), at(180)])
    weights = gate_weights(offsets, 0.0, math.pi / 2)
    assert weights == pytest.approx([1.0, 0.75, 0.5, 0.25, 0.0, 0.0, 0.0], abs=1e-12)


def test_angles_wrap_at_half_a_turn() -> None:
    weights = gate_weights(np.array([at(-179)]), math.radians(179), math.radians(4))
    assert weights == pytest.approx([0.5])  # two degrees apart, not 358


@given(theta=st.floats(-10.0, 10.0), turn=st.floats(-3.1, 3.1))
def test_gate_depends_only_on_the_angle_between(theta: float, turn: float) -> None:
    angle = theta + turn
    offset = np.array([[math.cos(angle), math.sin(angle)]])
    weight = gate_weights(offset, theta, math.pi / 2)[0]
    assert weight == pytest.approx(max(0.0, 1.0 - abs(turn) / (math.pi / 2)), abs=1e-9)


@pytest.mark.parametrize("half_angle", ANGLES)
def test_gate_advances_a_centred_cloud_by_the_closed_form(
    half_angle: float,
) -> None:
    # E[r] = sqrt(pi / 2); mean cosine under 1 - psi / T is 2 (1 - cos T) / T^2.
    advance = math.sqrt(math.pi / 2) * 2 * (1 - math.cos(half_angle)) / half_angle**2
    assert forward_mean(0.0, half_angle) == pytest.approx(advance, rel=1e-3)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_forward_mean_agrees_with_a_sampled_cloud(
    weighting: str, rng: np.random.Generator
) -> None:
    cloud = rng.standard_normal((400_000, 2)) + [0.85, 0.0]
    weights = gate_weights(cloud, 0.0, math.pi / 4, weighting)
    sampled = weights @ cloud[:, 0] / weights.sum()
    # Half pass, spread about 0.7: standard error about 0.7 / sqrt(200 000) = 0.0016.
    advance = forward_mean(0.85, math.pi / 4, weighting)
    assert advance == pytest.approx(sampled, abs=0.008)
    for half_angle in (0.3, 1.1, 2.9):
        exact = forward_mean(CLOUD_OFFSET, half_angle, weighting)
        assert reach(half_angle, weighting) == pytest.approx(exact, abs=0.002)


@pytest.mark.parametrize(
    ("weighting", "expected"),
    [
        ("linear", [1.0, 0.5, 0.0, 0.0]),
        ("cosine", [1.0, math.sqrt(0.5), 0.0, 0.0]),
        ("gaussian", [1.0, math.exp(-0.5), math.exp(-2.0), 0.0]),
        ("none", [1.0, 1.0, 1.0, 0.0]),
    ],
)
def test_weight_falls_with_the_angle_by_its_function(
    weighting: str, expected: list[float]
) -> None:
    offsets = np.array([at(0), at(-20), at(39.999), at(40.001)])
    weights = gate_weights(offsets, 0.0, math.radians(40), weighting)
    assert weights == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("degrees", "wrapped"), [(0, 0), (190, -170), (-190, 170), (540, 180), (-180, 180)]
)
def test_wrap_gives_angles_within_half_a_turn(degrees: float, wrapped: float) -> None:
    assert math.degrees(wrap(math.radians(degrees))) == pytest.approx(wrapped)


def course(theta_degrees: float) -> Course:
    theta = math.radians(theta_degrees)
    return Course(0.0, 0.0, start_px=5.0, still_px=0.5, theta=theta, speed=4.0)


@pytest.mark.parametrize(
    ("theta", "measured", "after"),
    [
        pytest.param(10.0, 50.0, 11.0, id="one degree up"),
        pytest.param(10.0, -50.0, 9.0, id="one degree down"),
        pytest.param(10.0, 10.4, 10.4, id="no further than the measurement"),
        pytest.param(179.5, -170.0, -179.5, id="up across half a turn"),
        pytest.param(-179.5, 170.0, 179.5, id="down across half a turn"),
    ],
)
def test_median_moves_one_degree_towards_the_measured_angle(
    theta: float, measured: float, after: float
) -> None:
    moving = course(theta)
    step = at(measured)
    moving.advance(4.0 * step[0], 4.0 * step[1])
    assert math.degrees(moving.theta) == pytest.approx(after)


@pytest.mark.parametrize("degrees", [5.0, 20.0, 40.0])
def test_spread_is_the_deviation_of_recent_directions(
    degrees: float, rng: np.random.Generator
) -> None:
    moving = course(0.0)
    x = y = 0.0
    spreads = []
    for turn in rng.normal(0.0, degrees, 400).tolist():
        step = at(turn)
        x, y = x + 4.0 * step[0], y + 4.0 * step[1]
        moving.advance(x, y)
        spreads.append(math.degrees(moving.spread))
    # Over about 1 / 0.15 steps, and about a theta that wanders by some degrees.
    assert np.mean(spreads[50:]) == pytest.approx(degrees, rel=0.15)


def test_direction_is_kept_while_the_target_is_stationary() -> None:
    moving = course(10.0)
    moving.advance(0.0, 0.4)
    assert math.degrees(moving.theta) == pytest.approx(10.0)
    assert moving.speed < 4.0


def test_course_is_unknown_until_the_target_has_moved_away() -> None:
    moving = Course(0.0, 0.0, start_px=5.0, still_px=0.5)
    for x in (3.0, 6.0):
        moving.advance(x, 0.0)
        assert not moving.is_known  # two frames are too few
    moving.advance(9.0, 0.0)
    assert moving.is_known
    assert (moving.theta, moving.speed) == (0.0, 3.0)


def test_course_stays_unknown_for_jitter_about_one_position() -> None:
    moving = Course(0.0, 0.0, start_px=5.0, still_px=0.5)
    for index in range(50):
        moving.advance(4.0 * (-1) ** index, 0.0)
    assert not moving.is_known


def test_course_predicts_constant_velocity_in_the_world() -> None:
    # A car at depth Z = 20 + 0.5 t and 3 m to the side, seen with f = 100 px: its
    # steps alone, smoothed, would lag behind; carried on by the size they do not.
    depths = 20.0 + 0.5 * np.arange(60)
    places = 100.0 * 3.0 / depths
    moving = Course(places[0], 0.0, start_px=1.0, still_px=0.0)
    for index in range(1, 60):
        growth = math.log(depths[index - 1] / depths[index])
        moving.advance(places[index], 0.0, growth)
    assert moving.speed == pytest.approx(places[-2] - places[-1], rel=0.03)
    # By a share of 0.06 a frame, 0.94^59 = 0.03 of the start at nothing is left.
    assert moving.growth == pytest.approx(math.log(depths[-2] / depths[-1]), rel=0.2)


def test_speed_of_a_jittering_target_is_nearly_zero(
    rng: np.random.Generator,
) -> None:
    moving = course(0.0)
    speeds = []
    for x in rng.normal(0.0, 1.0, 400).tolist():
        moving.advance(x, 0.0)
        speeds.append(moving.speed)
    # Smoothing by 0.3 leaves about half the jitter of a step, and half of that is cut.
    assert np.mean(speeds[100:]) < 0.4
