"""Fourier series of feature maps: interpolation, places and maxima between cells."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.fourier_series import FourierSeries, cubic_spectrum

SERIES = FourierSeries(7, 64.0)  # 16 cells of 4 samples
FIRST = 1.5 - 31.5  # place of the first of cells that fill the square


def blob(down: float, right: float, count: int = 16) -> NDArray[np.float32]:
    """Return a smooth spot, samples off the middle, at the places of cells."""
    places = FIRST + 4.0 * np.arange(count)
    rows, columns = np.meshgrid(places, places, indexing="ij")
    square = (rows - down) ** 2 + (columns - right) ** 2
    return np.asarray(np.exp(-square / (2.0 * 7.0**2)), np.float32)[..., None]


def keys_kernel(distance: float) -> float:
    """Return Keys' cubic kernel with a = -0.75."""
    a, x = -0.75, abs(distance)
    if x <= 1.0:
        return (a + 2.0) * x**3 - (a + 3.0) * x**2 + 1.0
    return a * (x**3 - 5.0 * x**2 + 8.0 * x - 4.0) if x < 2.0 else 0.0


@pytest.mark.parametrize("frequency", [0.0, 0.005, 0.03, 0.2, 0.45])
def test_spectrum_is_the_transform_of_the_kernel(frequency: float) -> None:
    places = np.linspace(-2.0, 2.0, 8001)
    values = np.array([keys_kernel(place) for place in places])
    integral = np.sum(values * np.cos(2.0 * np.pi * frequency * places)) * 0.0005
    assert cubic_spectrum(np.array(frequency)) == pytest.approx(integral, abs=2e-4)


@pytest.mark.parametrize(("down", "right"), [(0.0, 0.0), (1.3, -2.6), (-9.1, 4.7)])
def test_maximum_of_interpolated_cells_is_found_within_a_cell(
    down: float, right: float
) -> None:
    coefficients = SERIES.interpolated(blob(down, right), 4.0, FIRST)
    places, values = SERIES.maxima(coefficients, 32)
    assert places[0] == pytest.approx([down, right], abs=0.1)
    assert values[0] == pytest.approx(1.0, abs=0.03)


def test_cells_of_a_smaller_map_are_where_its_start_says() -> None:
    whole = SERIES.interpolated(blob(2.0, -1.0), 4.0, FIRST)
    inner = SERIES.interpolated(blob(2.0, -1.0)[3:-3, 3:-3], 4.0, FIRST + 12.0)
    assert inner == pytest.approx(whole, abs=0.004)


def test_moved_function_is_that_of_a_moved_picture() -> None:
    still = SERIES.interpolated(blob(0.0, 0.0), 4.0, FIRST)
    moved = SERIES.interpolated(blob(3.0, -1.0), 4.0, FIRST)
    # The cells sample a spot that has few frequencies above the limit.
    assert SERIES.moved(still, 3.0, -1.0) == pytest.approx(moved, abs=1e-3)


def test_grid_and_coefficients_are_inverse(rng: np.random.Generator) -> None:
    values = rng.standard_normal((20, 20, 2)).astype(np.float32)
    coefficients = SERIES.from_grid(values)
    again = SERIES.from_grid(SERIES.on_grid(coefficients, 20))
    assert again == pytest.approx(coefficients, abs=1e-6)


def test_inner_product_is_the_mean_of_the_product(rng: np.random.Generator) -> None:
    values = rng.standard_normal((2, 20, 20, 3)).astype(np.float32)
    first, second = (SERIES.from_grid(each) for each in values)
    on_grid = [SERIES.on_grid(each, 20) for each in (first, second)]
    expected = np.mean(np.sum(on_grid[0] * on_grid[1], axis=-1))
    assert SERIES.inner(first, second) == pytest.approx(float(expected), rel=1e-4)


def test_gaussian_has_its_deviation_and_a_maximum_of_one() -> None:
    grid = SERIES.on_grid(SERIES.gaussian(6.0)[:, None], 64)[..., 0]
    assert grid[0, 0] == pytest.approx(1.0, abs=1e-3)
    assert grid[6, 0] == pytest.approx(np.exp(-0.5), abs=1e-3)
    assert grid[-6, 6] == pytest.approx(np.exp(-1.0), abs=1e-3)
