from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.render.image.sensor import _add_noise, simulate_sensor
from simbench.scenarios.schema import Imaging


def _sensor(**settings: Any) -> Imaging:
    """Return an ideal sensor except for the given settings."""
    return Imaging.model_validate({"noise": 0, "blur_px": 0} | settings)


def _flat(level: int, size: int = 100) -> NDArray[np.uint8]:
    return np.full((size, size, 3), level, np.uint8)


def _edge() -> NDArray[np.uint8]:
    picture = _flat(20)
    picture[:, 50:] = 220
    return picture


def test_an_ideal_sensor_changes_nothing(rng: np.random.Generator) -> None:
    picture = _edge()
    assert np.array_equal(simulate_sensor(picture, _sensor(), rng), picture)


def test_the_input_image_is_not_written(rng: np.random.Generator) -> None:
    picture = _edge()
    kept = picture.copy()
    settings = _sensor(noise=0.1, blur_px=1, downscale=2, exposure=2, jpeg_quality=40)
    simulate_sensor(picture, settings, rng)
    assert np.array_equal(picture, kept)


@pytest.mark.parametrize(
    ("level", "share"),
    [
        pytest.param(64, 0.25 + 0.75 * 64 / 255, id="dark"),
        pytest.param(160, 0.25 + 0.75 * 160 / 255, id="bright"),
    ],
)
def test_noise_has_the_requested_spread(
    level: int, share: float, rng: np.random.Generator
) -> None:
    noisy = simulate_sensor(_flat(level), _sensor(noise=0.04), rng).astype(np.float64)
    expected = 0.04 * 255 * share**0.5
    # 30,000 samples: the standard error of a spread is 1 / sqrt(60,000) of it; rounding
    # to whole levels adds a variance of 1/12.
    spread = (expected**2 + 1 / 12) ** 0.5
    assert noisy.std() == pytest.approx(spread, rel=5 / 60_000**0.5)
    assert noisy.mean() == pytest.approx(level, abs=5 * spread / 30_000**0.5)


@pytest.mark.parametrize("shape", [(1, 1, 3), (37, 41, 3), (211, 320, 3)])
def test_the_noise_is_that_of_numpy_to_the_bit(
    shape: tuple[int, ...], rng: np.random.Generator
) -> None:
    picture = rng.integers(0, 256, shape, np.uint8)
    scale = np.linspace(0.0, 60.0, 256, dtype=np.float32)
    normals = rng.standard_normal(shape, dtype=np.float32)
    noisy = _add_noise(picture, normals, scale)
    expected = np.clip(np.rint(picture + normals * scale[picture]), 0, 255)
    assert np.array_equal(noisy, expected.astype(np.uint8))


def test_the_same_generator_state_gives_the_same_noise() -> None:
    settings = _sensor(noise=0.05)
    one, two = (
        simulate_sensor(_edge(), settings, np.random.default_rng(4)) for _ in range(2)
    )
    assert np.array_equal(one, two)


def test_doubling_the_exposure_doubles_the_light(rng: np.random.Generator) -> None:
    brighter = simulate_sensor(_flat(100), _sensor(exposure=2), rng)[0, 0, 0]
    assert brighter == round(255 * (2 * (100 / 255) ** 2.2) ** (1 / 2.2))


def test_exposure_saturates_at_white(rng: np.random.Generator) -> None:
    assert simulate_sensor(_flat(200), _sensor(exposure=9), rng).max() == 255


def test_half_the_contrast_halves_deviations_from_the_mean(
    rng: np.random.Generator,
) -> None:
    veiled = simulate_sensor(_edge(), _sensor(contrast=0.5), rng)
    assert (veiled[0, 0, 0], veiled[0, 99, 0]) == (70, 170)  # 20 and 220 about 120


def test_no_contrast_is_the_mean_of_each_channel(rng: np.random.Generator) -> None:
    picture = _edge()
    picture[..., 2] = 40
    assert np.unique(simulate_sensor(picture, _sensor(contrast=0), rng)[..., :2]) == [
        120
    ]
    assert np.unique(simulate_sensor(picture, _sensor(contrast=0), rng)[..., 2]) == [40]


def test_noise_stays_when_contrast_falls(rng: np.random.Generator) -> None:
    flat = simulate_sensor(_flat(120), _sensor(contrast=0.1, noise=0.05), rng)
    assert flat.std() > 5


@pytest.mark.parametrize(
    "settings",
    [
        pytest.param(_sensor(blur_px=2), id="blur"),
        pytest.param(_sensor(downscale=4), id="lost detail"),
    ],
)
def test_softening_widens_an_edge_and_keeps_the_rest(
    settings: Imaging, rng: np.random.Generator
) -> None:
    soft = simulate_sensor(_edge(), settings, rng)
    between = np.sum((soft[50, :, 0] > 30) & (soft[50, :, 0] < 210))
    assert between >= 3
    assert soft[50, 5, 0] == 20 and soft[50, 95, 0] == 220
    assert soft.shape == (100, 100, 3)


def test_jpeg_loses_more_at_lower_quality(rng: np.random.Generator) -> None:
    picture = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)

    def loss(quality: int) -> float:
        out = simulate_sensor(picture, _sensor(jpeg_quality=quality), rng)
        return float(np.abs(out.astype(int) - picture).mean())

    assert loss(95) < loss(50) < loss(10)


def test_jpeg_keeps_the_order_of_the_channels(rng: np.random.Generator) -> None:
    red = _flat(0)
    red[..., 0] = 200
    out = simulate_sensor(red, _sensor(jpeg_quality=90), rng)
    assert out[50, 50, 0] > 180 and out[50, 50, 2] < 20
