from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.render.image.sensor import Sensor
from simbench.scenarios.schema import Imaging


def _sensor(**settings: Any) -> Imaging:
    """Return an ideal sensor except for the given settings."""
    return Imaging.model_validate({"noise": 0, "blur_px": 0} | settings)


def _expose(
    picture: NDArray[np.uint8], settings: Imaging, rng: np.random.Generator
) -> NDArray[np.uint8]:
    return Sensor(settings, rng).expose(picture, rng)


def _flat(level: int, size: int = 100) -> NDArray[np.uint8]:
    return np.full((size, size, 3), level, np.uint8)


def _edge() -> NDArray[np.uint8]:
    picture = _flat(20)
    picture[:, 50:] = 220
    return picture


def test_an_ideal_sensor_changes_nothing(rng: np.random.Generator) -> None:
    picture = _edge()
    assert np.array_equal(_expose(picture, _sensor(), rng), picture)


def test_the_input_image_is_not_written(rng: np.random.Generator) -> None:
    picture = _edge()
    kept = picture.copy()
    settings = _sensor(noise=0.1, blur_px=1, downscale=2, exposure=2, jpeg_quality=40)
    _expose(picture, settings, rng)
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
    noisy = _expose(_flat(level), _sensor(noise=0.04), rng).astype(np.float64)
    expected = 0.04 * 255 * share**0.5
    # 30,000 samples: the standard error of a spread is 1 / sqrt(60,000) of it; rounding
    # to whole levels adds a variance of 1/12.
    spread = (expected**2 + 1 / 12) ** 0.5
    assert noisy.std() == pytest.approx(spread, rel=5 / 60_000**0.5)
    assert noisy.mean() == pytest.approx(level, abs=5 * spread / 30_000**0.5)


@pytest.fixture(scope="module")
def noise() -> NDArray[np.float64]:
    """The noise of 50 frames of 120 x 160 px in three channels, in grey levels."""
    sensor = Sensor(_sensor(noise=0.1), np.random.default_rng(3))
    grey = np.full((120, 160, 3), 128, np.uint8)
    frames = [sensor.expose(grey, np.random.default_rng([3, n])) for n in range(50)]
    return np.stack(frames).astype(np.float64) - 128.0


def test_the_noise_of_a_film_is_normal(noise: NDArray[np.float64]) -> None:
    # 2.9 million levels from 1 million normals: the latter limit the errors.
    error = 1.0 / 2**10
    spread = 0.1 * 255 * (0.25 + 0.75 * 128 / 255) ** 0.5
    standard = noise / (spread**2 + 1 / 12) ** 0.5  # rounding has a variance of 1/12
    assert standard.mean() == pytest.approx(0.0, abs=5 * error)
    assert standard.std() == pytest.approx(1.0, abs=5 * error / 2**0.5)
    assert (standard**3).mean() == pytest.approx(0.0, abs=5 * error * 15**0.5)
    assert (standard**4).mean() == pytest.approx(3.0, abs=5 * error * 96**0.5)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        pytest.param(np.s_[:-1], np.s_[1:], id="frames"),
        pytest.param(np.s_[:-7], np.s_[7:], id="frames apart"),
        pytest.param(np.s_[:, :-1], np.s_[:, 1:], id="rows"),
        pytest.param(np.s_[:, :, :-1], np.s_[:, :, 1:], id="columns"),
        pytest.param(np.s_[:, :-1, :-1], np.s_[:, 1:, 1:], id="diagonal"),
        pytest.param(np.s_[..., 0], np.s_[..., 1], id="red and green"),
        pytest.param(np.s_[..., 0], np.s_[..., 2], id="red and blue"),
        pytest.param(np.s_[..., 1], np.s_[..., 2], id="green and blue"),
    ],
)
def test_noise_is_not_correlated(
    one: Any, other: Any, noise: NDArray[np.float64]
) -> None:
    products = noise[one] * noise[other] / noise.var()
    # Products of independent normals have a spread of 1. Rows that share a part of the
    # tile count twice: hence the limit of 6 instead of 4 standard errors.
    assert products.mean() == pytest.approx(0.0, abs=6 / products.size**0.5)


def test_no_row_of_noise_is_there_twice(noise: NDArray[np.float64]) -> None:
    rows = noise.reshape(6000, -1)
    rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    alike = np.abs(rows @ rows.T)
    # Some of 18 million pairs share one of their two parts, which makes 0.5; others
    # add up to 6.5 / 480**0.5.
    assert np.max(alike[~np.eye(6000, dtype=np.bool_)]) < 0.85


def test_the_same_generator_state_gives_the_same_noise() -> None:
    settings = _sensor(noise=0.05)
    one, two = (_expose(_edge(), settings, np.random.default_rng(4)) for _ in range(2))
    assert np.array_equal(one, two)


def test_doubling_the_exposure_doubles_the_light(rng: np.random.Generator) -> None:
    brighter = _expose(_flat(100), _sensor(exposure=2), rng)[0, 0, 0]
    assert brighter == round(255 * (2 * (100 / 255) ** 2.2) ** (1 / 2.2))


def test_exposure_saturates_at_white(rng: np.random.Generator) -> None:
    assert _expose(_flat(200), _sensor(exposure=9), rng).max() == 255


def test_half_the_contrast_halves_deviations_from_the_mean(
    rng: np.random.Generator,
) -> None:
    veiled = _expose(_edge(), _sensor(contrast=0.5), rng)
    assert (veiled[0, 0, 0], veiled[0, 99, 0]) == (70, 170)  # 20 and 220 about 120


def test_no_contrast_is_the_mean_of_each_channel(rng: np.random.Generator) -> None:
    picture = _edge()
    picture[..., 2] = 40
    assert np.unique(_expose(picture, _sensor(contrast=0), rng)[..., :2]) == [120]
    assert np.unique(_expose(picture, _sensor(contrast=0), rng)[..., 2]) == [40]


def test_noise_stays_when_contrast_falls(rng: np.random.Generator) -> None:
    flat = _expose(_flat(120), _sensor(contrast=0.1, noise=0.05), rng)
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
    soft = _expose(_edge(), settings, rng)
    between = np.sum((soft[50, :, 0] > 30) & (soft[50, :, 0] < 210))
    assert between >= 3
    assert soft[50, 5, 0] == 20 and soft[50, 95, 0] == 220
    assert soft.shape == (100, 100, 3)


def test_jpeg_loses_more_at_lower_quality(rng: np.random.Generator) -> None:
    picture = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)

    def loss(quality: int) -> float:
        out = _expose(picture, _sensor(jpeg_quality=quality), rng)
        return float(np.abs(out.astype(int) - picture).mean())

    assert loss(95) < loss(50) < loss(10)


def test_jpeg_keeps_the_order_of_the_channels(rng: np.random.Generator) -> None:
    red = _flat(0)
    red[..., 0] = 200
    out = _expose(red, _sensor(jpeg_quality=90), rng)
    assert out[50, 50, 0] > 180 and out[50, 50, 2] < 20
