"""Histograms of oriented gradients: known properties."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.fhog import CHANNELS, cell_histograms, fhog


def texture(height: int = 32, width: int = 40) -> NDArray[np.uint8]:
    rng = np.random.default_rng(4)
    return rng.integers(60, 120, (height, width), np.uint8)


def ramp(angle: float, step: float = 5.0) -> NDArray[np.uint8]:
    """Return a plane whose levels rise in a direction, (24, 24)."""
    rows, columns = np.mgrid[0:24, 0:24] - 11.5
    rise = np.cos(angle) * columns + np.sin(angle) * rows
    return np.asarray(np.round(128.0 + step * rise), np.uint8)


def test_shape_is_31_channels_by_whole_cells() -> None:
    features = fhog(texture(33, 42), 4)
    assert features.shape == (CHANNELS, 8, 10)
    assert features.dtype == np.float32


@pytest.mark.parametrize("direction", [0, 3, 9, 14])
def test_ramp_has_its_own_direction_only(direction: int) -> None:
    histograms = cell_histograms(ramp(direction * np.pi / 9.0), 4)[1:-1, 1:-1]
    strongest = histograms.sum(axis=(0, 1)).argmax()
    assert strongest == direction
    features = fhog(ramp(direction * np.pi / 9.0), 4)[:, 1:-1, 1:-1]
    assert features[:18].mean(axis=(1, 2)).argmax() == direction
    assert features[18:27].mean(axis=(1, 2)).argmax() == direction % 9


def test_bilinear_weights_of_a_pixel_sum_to_its_gradient() -> None:
    grey = np.full((32, 32), 100, np.uint8)
    grey[13, 17] = 110  # four neighbours see a gradient of 10
    histograms = cell_histograms(grey, 4)
    assert histograms.sum() == pytest.approx(40.0, rel=1e-6)


def test_pixel_is_shared_by_the_four_nearest_cells_with_bilinear_weights() -> None:
    grey = np.full((32, 32), 100, np.uint8)
    grey[14, 18] = 110  # pixel (14, 17) rises by 10 in x, and no other does
    rising = cell_histograms(grey, 4)[..., 0]
    # Its middle is at 14.5 / 4 - 0.5 = 3.125 cells down, and at 3.875 right.
    expected = 10.0 * np.outer([0.875, 0.125], [0.125, 0.875])
    np.testing.assert_allclose(rising[3:5, 3:5], expected, rtol=1e-5)
    assert rising.sum() == pytest.approx(10.0, rel=1e-5)


def test_contrast_does_not_change_the_features() -> None:
    grey = texture()
    brighter = (2 * (grey.astype(int) - 60) + 20).astype(np.uint8)
    np.testing.assert_allclose(fhog(brighter, 4), fhog(grey, 4), atol=1e-4)


def test_features_are_within_their_bounds() -> None:
    features = fhog(texture(), 4)
    assert features.min() >= 0.0
    assert features[:27].max() <= 0.4 + 1e-6
    assert features[27:].max() <= 0.85 + 1e-3


def test_normalised_cell_equals_the_definition() -> None:
    grey = texture()
    histograms = cell_histograms(grey, 4).astype(np.float64)
    energy = ((histograms[..., :9] + histograms[..., 9:]) ** 2).sum(axis=-1)
    row, column = 3, 4
    expected = np.zeros(31)
    for corner, (dr, dc) in enumerate([(-1, -1), (-1, 0), (0, -1), (0, 0)]):
        block = energy[row + dr : row + dr + 2, column + dc : column + dc + 2].sum()
        signed = histograms[row, column] / np.sqrt(block + 1e-4)
        unsigned = signed[:9] + signed[9:]
        expected[:18] += 0.5 * np.minimum(signed, 0.2)
        expected[18:27] += 0.5 * np.minimum(unsigned, 0.2)
        expected[27 + corner] = 0.2357 * np.minimum(signed, 0.2).sum()
    np.testing.assert_allclose(fhog(grey, 4)[:, row, column], expected, rtol=1e-4)


def test_flat_image_has_no_features() -> None:
    assert fhog(np.full((16, 16), 77, np.uint8), 4).max() == 0.0
