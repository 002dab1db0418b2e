"""Distribution fields: their sums, their distance, and the descent."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.distribution_field import (
    LEVELS,
    descend,
    distribution_field,
)


def smooth_image() -> NDArray[np.uint8]:
    rng = np.random.default_rng(3)
    coarse = rng.integers(0, 255, (8, 10)).astype(np.uint8)
    image = cv2.resize(coarse, (80, 64), interpolation=cv2.INTER_CUBIC)
    return np.asarray(image, np.uint8)


@pytest.mark.parametrize("deviation", [1.0, 2.0])
def test_levels_of_every_pixel_sum_to_one(deviation: float) -> None:
    field = distribution_field(smooth_image(), deviation)
    assert field.shape == (64, 80, LEVELS)
    assert field.min() >= 0.0
    np.testing.assert_allclose(field.sum(axis=2), 1.0, atol=1e-5)


def test_flat_image_has_its_own_level_most_and_the_neighbours_alike() -> None:
    field = distribution_field(np.full((8, 8), 100, np.uint8), 1.0)[4, 4]
    assert field.argmax() == 100 * LEVELS // 256
    assert field[5] == pytest.approx(field[7])
    assert field[0] == 0.0


def test_descent_finds_the_place_of_the_model() -> None:
    field = distribution_field(smooth_image(), 2.0)
    model = field[20:40, 30:54].copy()
    row, column, distance = descend(field, model, 24, 26)
    assert (row, column) == (20, 30)
    assert distance == pytest.approx(0.0, abs=1e-6)


def test_distance_is_the_mean_over_pixels_of_absolute_differences() -> None:
    field = distribution_field(smooth_image(), 1.0)
    model = field[:20, :24].copy()
    only = field[30:50, 40:64]
    _, _, distance = descend(only, model, 0, 0)
    expected = np.abs(only - model).sum(axis=2).mean()
    assert distance == pytest.approx(expected, rel=1e-5)


def test_fields_without_a_common_level_are_two_apart() -> None:
    dark, light = (np.full((9, 9), grey, np.uint8) for grey in (0, 255))
    fields = [distribution_field(each, 1.0) for each in (dark, light)]
    assert descend(fields[0], fields[1], 0, 0)[2] == pytest.approx(2.0, rel=1e-5)
