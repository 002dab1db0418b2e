"""Convolutions and pooling against their definitions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from simbench.trackers.parts.convolution import (
    convolve,
    convolve_3x3,
    largest_of_3x3,
    winograd_weights,
)


def by_definition(
    values: NDArray[np.float32], weights: NDArray[np.float32], stride: int
) -> NDArray[np.float64]:
    """Return the convolution of (H, W, C) values with (K, C, k, k) weights."""
    windows = sliding_window_view(values, weights.shape[2:], (0, 1))
    found: NDArray[np.float64] = np.einsum(
        "yxcij,kcij->yxk", windows[::stride, ::stride], weights, dtype=np.float64
    )
    return found


@pytest.mark.parametrize(("size", "stride"), [(7, 2), (3, 1), (1, 3)])
def test_convolution_is_that_of_the_definition(
    size: int, stride: int, rng: np.random.Generator
) -> None:
    values = rng.standard_normal((19, 24, 3), np.float32)
    weights = rng.standard_normal((5, 3, size, size), np.float32)
    matrix = weights.transpose(2, 3, 1, 0).reshape(-1, 5)
    found = convolve(values, np.ascontiguousarray(matrix), size, stride)
    assert found == pytest.approx(by_definition(values, weights, stride), abs=1e-4)


@pytest.mark.parametrize("shape", [(4, 4, 1), (10, 16, 5), (30, 30, 32)])
@pytest.mark.parametrize("least", [0.0, -math.inf])
def test_convolution_of_3_x_3_is_that_of_the_definition(
    shape: tuple[int, int, int], least: float, rng: np.random.Generator
) -> None:
    values = rng.standard_normal(shape, np.float32)
    weights = rng.standard_normal((7, shape[2], 3, 3), np.float32)
    biases = rng.standard_normal(7, np.float32)
    found = convolve_3x3(values, winograd_weights(weights), biases, least)
    expected = np.maximum(by_definition(values, weights, 1) + biases, least)
    assert found == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("shape", [(3, 3, 1), (29, 29, 4), (61, 60, 2)])
def test_pooling_takes_the_largest_of_3_x_3(
    shape: tuple[int, int, int], rng: np.random.Generator
) -> None:
    values = rng.standard_normal(shape, np.float32)
    windows = sliding_window_view(values, (3, 3), (0, 1))[::2, ::2]
    assert np.array_equal(largest_of_3x3(values), windows.max(axis=(3, 4)))
