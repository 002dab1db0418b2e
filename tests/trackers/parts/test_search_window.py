"""Search windows: what is cut, where the peak is."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.core.box import Box
from simbench.trackers.parts.search_window import (
    SearchWindow,
    gaussian_label,
    peak,
    taper,
)


def grey_image(height: int = 60, width: int = 90) -> np.ndarray:
    """Return a random image of equal channels, (H, W, 3) uint8."""
    rng = np.random.default_rng(5)
    levels = rng.integers(0, 255, (height, width, 1), np.uint8)
    return levels.repeat(3, axis=2)


def test_window_at_one_pixel_a_sample_is_a_slice_of_the_image() -> None:
    image = grey_image()
    window = SearchWindow.around(Box(30.0, 20.0, 16.0, 12.0), 1.0, (1.0, 100.0))
    assert (window.shape, window.step) == ((24, 32), 1.0)
    cut = window.cut(image, 38.0, 26.0)
    assert np.array_equal(cut, image[14:38, 22:54, 0])


def test_window_beyond_the_image_repeats_its_border() -> None:
    image = grey_image()
    window = SearchWindow.around(Box(0.0, 0.0, 16.0, 12.0), 1.0, (1.0, 100.0))
    cut = window.cut(image, 0.0, 0.0)
    padded = np.pad(image[..., 0], 32, mode="edge")
    assert np.array_equal(cut, padded[20:44, 16:48])
    assert np.isfinite(window.cut(image, -500.0, 900.0)).all()


def test_window_between_pixels_is_their_mean() -> None:
    image = grey_image()
    window = SearchWindow.around(Box(30.0, 20.0, 16.0, 12.0), 1.0, (1.0, 100.0))
    halfway = window.cut(image, 38.5, 26.0)
    levels = image[14:38, 22:55, 0].astype(float)
    np.testing.assert_allclose(halfway, (levels[:, 1:] + levels[:, :-1]) / 2, atol=0.01)


@pytest.mark.parametrize(
    ("box", "step"),
    [
        pytest.param(Box(0.0, 0.0, 200.0, 200.0), 4.0, id="large target reduced"),
        pytest.param(Box(0.0, 0.0, 4.0, 4.0), 0.25, id="small target enlarged"),
        pytest.param(Box(0.0, 0.0, 0.5, 0.5), 0.125, id="least side 2 px"),
    ],
)
def test_target_is_sampled_within_the_asked_sizes(box: Box, step: float) -> None:
    window = SearchWindow.around(box, 1.0, (16.0, 50.0), cell=4)
    assert window.step == pytest.approx(step)
    assert all(side % 4 == 0 for side in window.shape)
    assert window.cut(grey_image(), 40.0, 30.0).shape == window.shape


def test_reduced_window_keeps_the_mean_level() -> None:
    window = SearchWindow.around(Box(10.0, 10.0, 40.0, 30.0), 0.0, (1.0, 10.0))
    image = grey_image()
    cut = window.cut(image, 45.0, 30.0)
    assert cut.mean() == pytest.approx(127.0, abs=6.0)
    assert cut.std() < 0.5 * image.std()  # samples are means, not single pixels


@pytest.mark.parametrize("shift", [(0, 0), (3, -4), (-7, 9)])
def test_peak_is_at_the_shift_of_the_label(shift: tuple[int, int]) -> None:
    response = np.roll(gaussian_label((24, 30), 2.0), shift, axis=(0, 1))
    down, right, value = peak(response)
    assert (down, right) == pytest.approx(shift, abs=1e-5)
    assert value == pytest.approx(1.0)


def test_peak_between_samples_is_found() -> None:
    rows, columns = np.mgrid[0:24, 0:30]
    response = np.exp(-0.05 * ((rows - 5.3) ** 2 + (columns - 20.8) ** 2))
    down, right, _ = peak(response.astype(np.float32))
    assert (down, right) == pytest.approx((5.3, -9.2), abs=0.05)


def test_taper_is_positive_symmetric_and_one_in_the_middle() -> None:
    weights = taper((5, 7))
    assert weights.min() > 0.0
    assert weights[2, 3] == pytest.approx(1.0)
    assert np.array_equal(weights, weights[::-1, ::-1])
