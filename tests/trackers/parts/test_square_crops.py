"""Square crops: places, sizes, and what is outside the picture."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.square_crops import context_side, square_crops


def disc(x: float, y: float, radius: float) -> NDArray[np.uint8]:
    """Return a white disc in a dark picture, (240, 320, 3) uint8."""
    rows, columns = np.mgrid[:240, :320] + 0.5
    inside = np.hypot(columns - x, rows - y) < radius
    return np.repeat(np.where(inside, 255, 20)[..., None], 3, axis=2).astype(np.uint8)


def test_context_is_half_the_sum_of_both_sides() -> None:
    assert context_side(20.0, 20.0) == 40.0
    assert context_side(30.0, 10.0) == pytest.approx((50.0 * 30.0) ** 0.5)


@pytest.mark.parametrize("radius", [6.0, 20.0, 60.0])
def test_target_is_in_the_middle_of_crops_of_any_size(radius: float) -> None:
    image = disc(150.3, 119.6, radius)
    sides = [4.0 * radius * scale for scale in (0.96, 1.0, 1.04)]
    for crop, side in zip(
        square_crops(image, 150.3, 119.6, sides, 64), sides, strict=True
    ):
        white = crop[..., 0] > 137
        rows, columns = np.nonzero(white)
        nearly = 0.1 + 0.15 * 64.0 / side  # a disc of pixels has its middle elsewhere
        assert [rows.mean(), columns.mean()] == pytest.approx([31.5, 31.5], abs=nearly)
        expected = np.pi * (64.0 * radius / side) ** 2
        assert white.sum() == pytest.approx(expected, rel=0.08)


def test_outside_of_the_picture_has_its_mean_colour() -> None:
    image = np.full((100, 100, 3), (10, 100, 200), np.uint8)
    image[:, 50:] = (30, 120, 220)
    crop = square_crops(image, 0.0, 50.0, [64.0], 64)[0]
    assert crop[:, :31].reshape(-1, 3).tolist() == [[20, 110, 210]] * 64 * 31
    assert crop[:, 33:].reshape(-1, 3).tolist() == [[10, 100, 200]] * 64 * 31


def test_fine_stripes_of_a_large_target_become_grey_and_no_others() -> None:
    stripes = np.zeros((400, 400, 3), np.uint8)
    stripes[:, ::2] = 200
    crop = square_crops(stripes, 200.0, 200.0, [256.0], 64)[0]
    assert crop.std() < 3.0
    assert crop.mean() == pytest.approx(100.0, abs=3.0)


@pytest.mark.parametrize("side", [0.5, 3.0, 5000.0])
@pytest.mark.parametrize("place", [(0.0, 0.0), (63.0, 47.0), (31.5, 20.0)])
def test_any_place_and_size_gives_a_crop(
    side: float, place: tuple[float, float], rng: np.random.Generator
) -> None:
    image = rng.integers(0, 255, (48, 64, 3), np.uint8)
    assert square_crops(image, *place, [side], 64).shape == (1, 64, 64, 3)
