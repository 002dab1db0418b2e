"""The affine group against SciPy's general matrix exponential and logarithm."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import (
    compose,
    exp,
    inverse,
    log,
    log_between,
    moved,
)

IDENTITY = np.eye(3)[:2]

# Short of a half turn, beyond which the logarithm is another one.
velocities = arrays(np.float64, 6, elements=st.floats(-1.5, 1.5))


def as_matrix(velocity: NDArray[np.float64]) -> NDArray[np.float64]:
    scale, aspect, turn, shear, x, y = velocity.tolist()
    return np.array(
        [[scale + aspect, shear - turn, x], [shear + turn, scale - aspect, y], [0] * 3]
    )


def test_zero_velocity_is_the_identity() -> None:
    assert exp(np.zeros(6)).tolist() == IDENTITY.tolist()
    assert log(IDENTITY).tolist() == [0.0] * 6


def test_quarter_turn_maps_right_to_down() -> None:
    turned = exp(np.array([0.0, 0.0, math.pi / 2, 0.0, 0.0, 0.0]))
    assert turned == pytest.approx(np.array([[0, -1, 0], [1, 0, 0]]), abs=1e-15)


def test_uniform_scale_doubles_at_log_two() -> None:
    doubled = exp(np.array([math.log(2.0), 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert doubled == pytest.approx(np.array([[2, 0, 0], [0, 2, 0]]))


@given(velocities)
def test_exponential_agrees_with_scipy(velocity: NDArray[np.float64]) -> None:
    expected = scipy.linalg.expm(as_matrix(velocity))[:2]
    assert exp(velocity) == pytest.approx(expected, rel=1e-11, abs=1e-11)


@given(velocities)
def test_logarithm_is_the_inverse_of_the_exponential(
    velocity: NDArray[np.float64],
) -> None:
    assert log(exp(velocity)) == pytest.approx(velocity, abs=1e-9)


@given(velocities, velocities)
def test_inverse_of_a_product_is_the_reversed_product_of_inverses(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> None:
    a, b = exp(first), exp(second)
    turned_round = compose(inverse(b), inverse(a))
    assert inverse(compose(a, b)) == pytest.approx(turned_round, rel=1e-8, abs=1e-8)


def test_array_of_elements_gives_the_same_as_single_elements(
    rng: np.random.Generator,
) -> None:
    many = rng.normal(0.0, 0.5, (4, 3, 6))
    assert exp(many).shape == (4, 3, 2, 3)
    assert exp(many)[2, 1].tolist() == exp(many[2, 1]).tolist()
    assert log(exp(many)) == pytest.approx(many, abs=1e-12)


@pytest.mark.parametrize(
    "linear",
    [
        pytest.param([[1.0, 0.0], [0.0, -1.0]], id="mirror"),
        pytest.param([[-1.0, 0.0], [0.0, -1.0]], id="half turn"),
        pytest.param([[0.0, 0.0], [0.0, 0.0]], id="collapsed"),
    ],
)
def test_element_without_a_real_logarithm_gives_nan(linear: list[list[float]]) -> None:
    element = np.column_stack([np.array(linear), np.zeros(2)])
    assert np.isnan(log(element)).all()


def test_moves_and_differences_equal_their_definitions(
    rng: np.random.Generator,
) -> None:
    first = exp(rng.normal(0.0, 0.4, (20, 6)))
    second = exp(rng.normal(0.0, 0.4, (20, 6)))
    steps = log_between(first, second)
    assert steps == pytest.approx(log(compose(inverse(first), second)), abs=1e-12)
    assert moved(first, steps) == pytest.approx(second, abs=1e-12)
    one = log_between(first[:1], second)
    assert one == pytest.approx(log(compose(inverse(first[:1]), second)), abs=1e-12)


def test_difference_without_a_real_logarithm_is_no_step() -> None:
    mirror = np.array([[[1.0, 0.0, 3.0], [0.0, -1.0, 0.0]]])
    assert log_between(IDENTITY[None], mirror).tolist() == [[0.0] * 6]
