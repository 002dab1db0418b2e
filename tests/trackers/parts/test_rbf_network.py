"""Networks of Gaussian units: their formula, their fit, and what is stored of them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.rbf_network import Network, fit_linear, fit_rbf
from simbench.trackers.parts.weights_file import pack_weights


@pytest.fixture(scope="module")
def samples() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    inputs = np.random.default_rng(2).uniform(-2.0, 2.0, (800, 2)) * [1.0, 50.0]
    bump = np.exp(-(inputs[:, 0] ** 2)) * np.cos(inputs[:, 1] / 25.0)
    return inputs, np.column_stack([bump, 3.0 - inputs[:, 0]])


def fitted(samples: tuple[NDArray[np.float64], NDArray[np.float64]]) -> Network:
    return fit_rbf(*samples, units=80, ridge=1e-6, rng=np.random.default_rng(0))


def test_output_is_that_of_equations_5_to_7() -> None:
    network = Network(
        mean=np.array([1.0]),
        scale=np.array([2.0]),
        centres=np.array([[0.0], [1.0]]),
        inverse_widths=np.array([1.0, 0.5]),
        weights=np.array([[3.0], [-1.0]]),
        bias=np.array([0.25]),
    )
    point = (4.0 - 1.0) / 2.0
    expected = 3.0 * np.exp(-(point**2)) - np.exp(-((point - 1.0) ** 2) * 0.25) + 0.25
    assert network.predict(np.array([4.0])) == pytest.approx([expected])


def test_fit_learns_a_bump_that_a_linear_map_cannot(
    samples: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> None:
    inputs, targets = samples
    errors = []
    for network in (fitted(samples), fit_linear(inputs, targets, ridge=1e-6)):
        answers = np.array([network.predict(one) for one in inputs])
        errors.append(np.sqrt(((answers - targets) ** 2).mean(axis=0)))
    assert errors[0].max() < 0.1
    assert errors[1][0] > 0.25
    assert errors[1][1] < 1e-3


def test_units_are_silent_far_from_all_samples(
    samples: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> None:
    network = fitted(samples)
    assert network.predict(np.array([1e3, 1e4])).tolist() == network.bias.tolist()


def test_same_seed_gives_the_same_bytes(
    samples: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> None:
    first, again = (pack_weights(fitted(samples).to_arrays("a")) for _ in range(2))
    assert first == again


def test_stored_network_answers_as_before(
    samples: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> None:
    for network in (fitted(samples), fit_linear(*samples, ridge=1e-6)):
        stored = Network.from_arrays(network.to_arrays("a.b"), "a.b")
        point = samples[0][0]
        assert stored.predict(point) == pytest.approx(network.predict(point), abs=1e-3)


@pytest.mark.parametrize("damage", ["missing", "not finite", "wrong shape"])
def test_damaged_parts_are_refused_in_one_line(
    damage: str, samples: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> None:
    arrays = fitted(samples).to_arrays("a")
    if damage == "missing":
        del arrays["a.bias"]
    elif damage == "not finite":
        arrays["a.weights"][0] = np.nan
    else:
        arrays["a.scale"] = np.ones(5, np.float32)
    with pytest.raises(TrackerError, match="parts of a network named 'a'"):
        Network.from_arrays(arrays, "a")


def test_constant_input_does_not_break_the_fit() -> None:
    inputs = np.column_stack([np.linspace(0.0, 1.0, 50), np.ones(50)])
    network = fit_linear(inputs, inputs[:, :1], ridge=1e-9)
    assert network.predict(np.array([0.3, 1.0])) == pytest.approx([0.3], abs=1e-6)
