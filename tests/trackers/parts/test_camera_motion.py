"""Motion of the background: its size, the cheap test, and what must not disturb it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.camera_motion import CameraMotion
from tests.trackers.clips import car, draw

ELLIPSE = np.array([160.0, 120.0, 25.0, 20.0])


def street(shift: tuple[float, float], noise: float = 2.0) -> NDArray[np.uint8]:
    """Return a textured street, moved by (x, y) px, (240, 320, 3)."""
    rng = np.random.default_rng(2)
    coarse = rng.normal(120.0, 45.0, (50, 64, 3)).astype(np.float32)
    wide = cv2.resize(coarse, (384, 300), interpolation=cv2.INTER_CUBIC)
    matrix = np.array([[1.0, 0.0, shift[0] - 32.0], [0.0, 1.0, shift[1] - 30.0]])
    image = cv2.warpAffine(wide, matrix, (320, 240))
    fresh = np.random.default_rng(int(1000 * abs(sum(shift))) + 7)
    noisy = image + fresh.normal(0.0, noise, image.shape)
    return np.asarray(np.clip(noisy, 0, 255), np.uint8)


def with_car(image: NDArray[np.uint8], x: float, y: float) -> NDArray[np.uint8]:
    sprite = car((30, 90, 170), np.random.default_rng(1))
    draw(image, sprite, np.array([x - 25.0, y - 20.0, 50.0, 40.0]))
    return image


@pytest.mark.parametrize("shift", [(3.0, -2.0), (-6.5, 1.25), (0.0, 9.0)])
def test_shift_of_the_background_is_measured(shift: tuple[float, float]) -> None:
    camera = CameraMotion(with_car(street((0.0, 0.0)), 160, 120))
    measured = camera.shift(with_car(street(shift), 160, 120), ELLIPSE)
    assert measured == pytest.approx(shift, abs=0.3)
    assert camera.measured == 1


@pytest.mark.parametrize("noise", [0.5, 3.0, 8.0])
def test_still_camera_costs_no_flow(noise: float) -> None:
    camera = CameraMotion(with_car(street((0.0, 0.0), noise), 160, 120))
    moved = with_car(street((1e-3, 0.0), noise), 168, 122)  # the car, and new noise
    assert camera.shift(moved, ELLIPSE) == pytest.approx([0.0, 0.0], abs=0.0)
    assert camera.measured == 0


def test_car_passing_through_the_ring_is_no_camera_motion() -> None:
    before = with_car(with_car(street((0.0, 0.0)), 160, 120), 215, 120)
    after = with_car(with_car(street((1e-3, 0.0)), 160, 120), 205, 120)
    shift = CameraMotion(before).shift(after, ELLIPSE)
    assert shift is not None
    assert shift == pytest.approx([0.0, 0.0], abs=0.3)


def test_change_of_everything_tells_no_motion() -> None:
    camera = CameraMotion(street((0.0, 0.0)))
    other = np.random.default_rng(9).integers(0, 255, (240, 320, 3), dtype=np.uint8)
    assert camera.shift(other, ELLIPSE) is None


def test_plain_background_counts_as_still() -> None:
    grey = np.full((240, 320, 3), 100, np.uint8)
    camera = CameraMotion(grey)
    assert camera.shift(grey + np.uint8(20), ELLIPSE) == pytest.approx([0.0, 0.0])


def test_target_at_the_edge_of_the_image() -> None:
    camera = CameraMotion(street((0.0, 0.0)))
    edge = np.array([2.0, 3.0, 25.0, 20.0])
    assert camera.shift(street((4.0, 0.0)), edge) == pytest.approx([4, 0], abs=0.5)
    outside = np.array([-400.0, -400.0, 25.0, 20.0])
    assert camera.shift(street((8.0, 0.0)), outside) == pytest.approx([0.0, 0.0])
