"""Feature maps of crops for ECO: their places, norms and kinds."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.eco_features import CELL, KINDS, FeatureMaps
from simbench.trackers.parts.siamese_network import SiameseNetwork
from tests.trackers.test_siamfc import random_weights


@pytest.fixture(scope="module")
def maps() -> FeatureMaps:
    return FeatureMaps(SiameseNetwork(random_weights()), list(KINDS))


def spot(row: int, column: int) -> NDArray[np.uint8]:
    """Return a crop, (1, 128, 128, 3), with a bright square around a sample."""
    crop = np.full((1, 128, 128, 3), 90, np.uint8)
    crop[:, row - 3 : row + 4, column - 3 : column + 4] = (250, 60, 160)
    return crop


@pytest.mark.parametrize("name", KINDS)
def test_cells_are_where_the_kind_says(name: str, maps: FeatureMaps) -> None:
    row, column = 73, 58
    index = list(KINDS).index(name)
    flat = np.full((1, 128, 128, 3), 90, np.uint8)
    found = FeatureMaps(maps.network, [name])
    change = found._of_crop(spot(row, column)[0])[0] - found._of_crop(flat[0])[0]
    energy = (change**2).sum(axis=-1)
    places = KINDS[name].start + CELL * np.arange(len(energy))
    down = float((energy.sum(axis=1) @ places) / energy.sum())
    right = float((energy.sum(axis=0) @ places) / energy.sum())
    assert (down, right) == pytest.approx((row - 63.5, column - 63.5), abs=2.5)
    assert len(maps(flat)) == len(KINDS) > index


def test_maps_of_every_crop_have_the_same_power(
    maps: FeatureMaps, rng: np.random.Generator
) -> None:
    crops = rng.integers(0, 255, (2, 128, 128, 3), np.uint8)
    crops[1] //= 4
    for each in maps(crops):
        power = np.mean(each**2, axis=(1, 2, 3))
        assert power[0] == pytest.approx(power[1], rel=0.2)
        assert 0.05 < power[0] < 0.3  # 1, less what the window takes


def test_maps_fall_to_the_border(maps: FeatureMaps, rng: np.random.Generator) -> None:
    for each in maps(rng.integers(0, 255, (1, 128, 128, 3), np.uint8)):
        border = np.abs(each[0, 0]).mean()
        middle = np.abs(each[0, len(each[0]) // 2]).mean()
        assert border < 0.1 * middle
