"""The kernelised filter against dense ridge regression on all shifts."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.fft
from numpy.typing import NDArray

from simbench.trackers.parts.kernel_filter import KernelFilter, kernel_correlation
from simbench.trackers.parts.search_window import gaussian_label

SHAPE = (6, 5)  # an odd side too: the real transform must keep it
KERNELS = [pytest.param(0.4, id="gaussian"), pytest.param(0.0, id="linear")]


def windows(channels: int = 3) -> NDArray[np.float32]:
    rng = np.random.default_rng(2)
    return rng.standard_normal((2, channels, *SHAPE)).astype(np.float32)


def dense_kernel(
    first: NDArray[np.float32], second: NDArray[np.float32], deviation: float
) -> float:
    """Return the kernel of two windows by its definition."""
    if deviation == 0.0:
        return float(np.mean(first * second))
    return float(np.exp(-np.mean((first - second) ** 2) / deviation**2))


def shifts(window: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """Return every cyclic shift of a window, row by row."""
    return [
        np.roll(window, (row, column), axis=(1, 2))
        for row in range(SHAPE[0])
        for column in range(SHAPE[1])
    ]


@pytest.mark.parametrize("deviation", KERNELS)
def test_kernel_correlation_equals_the_kernel_of_every_shift(deviation: float) -> None:
    first, second = windows()
    spectra = [scipy.fft.rfft2(each, axes=(1, 2)) for each in (first, second)]
    fast = kernel_correlation(first, spectra[0], second, spectra[1], deviation)
    slow = [dense_kernel(first, each, deviation) for each in shifts(second)]
    np.testing.assert_allclose(fast.ravel(), slow, rtol=2e-4, atol=1e-6)


@pytest.mark.parametrize("deviation", KERNELS)
def test_response_equals_dense_kernel_ridge_regression(deviation: float) -> None:
    ridge = 0.01
    trained, seen = windows()
    label = gaussian_label(SHAPE, 1.0)
    samples = shifts(trained)
    gram = [[dense_kernel(a, b, deviation) for b in samples] for a in samples]
    alpha = np.linalg.solve(np.array(gram) + ridge * np.eye(len(gram)), label.ravel())
    # The window moved by -(r, k) is the target moved to (r, k) put back in the middle.
    dense = [
        sum(
            weight
            * dense_kernel(np.roll(seen, (-row, -column), axis=(1, 2)), b, deviation)
            for weight, b in zip(alpha, samples, strict=True)
        )
        for row in range(SHAPE[0])
        for column in range(SHAPE[1])
    ]
    one = KernelFilter(label, kernel_deviation=deviation, ridge=ridge, rate=0.1)
    one.learn(trained)
    mirrored = np.array(dense).reshape(SHAPE)
    np.testing.assert_allclose(one.respond(seen), mirrored, rtol=2e-3, atol=2e-4)


def test_response_to_the_shifted_window_is_the_shifted_label() -> None:
    label = gaussian_label(SHAPE, 1.0)
    one = KernelFilter(label, kernel_deviation=0.4, ridge=1e-5, rate=0.1)
    window = windows()[0]
    one.learn(window)
    moved = np.roll(window, (2, 1), axis=(1, 2))
    expected = np.roll(label, (2, 1), axis=(0, 1))
    np.testing.assert_allclose(one.respond(moved), expected, atol=1e-3)


def test_model_moves_towards_the_newest_window_by_the_rate() -> None:
    first, second = windows()
    label = gaussian_label(SHAPE, 1.0)
    none, full = (
        KernelFilter(label, kernel_deviation=0.4, ridge=1e-3, rate=rate)
        for rate in (0.0, 1.0)
    )
    for one in (none, full):
        one.learn(first)
        one.learn(second)
    assert none.respond(first).max() == pytest.approx(1.0, abs=0.02)
    assert full.respond(second).max() == pytest.approx(1.0, abs=0.02)
    assert full.respond(first).max() < 0.7
