"""Patches against plain NumPy and OpenCV, and the region that they are cut from."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.affine_group import exp
from simbench.trackers.parts.patches import (
    CODES,
    FEW_LEVELS,
    Region,
    gradient_patches,
    grey_patches,
)

STATE = np.array([[[32.0, 0.0, 40.0], [0.0, 32.0, 30.0]]])
PIXELS = np.ones(2)  # a region at the scale of the image


@pytest.fixture
def image(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Smooth noise, 60 x 80 px, bright enough to be no flat patch anywhere."""
    noise = rng.integers(0, 120, (15, 20, 3), dtype=np.uint8)
    large = cv2.resize(noise, (80, 60), interpolation=cv2.INTER_CUBIC)
    return large.astype(np.uint8)


def tilted_states(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    noise = rng.standard_normal((count, 6)) * [0.2, 0.1, 0.3, 0.1, 0.0, 0.0]
    states = exp(noise)
    states[:, :, :2] *= 24.0
    states[:, :, 2] = rng.uniform([20.0, 15.0], [60.0, 45.0], (count, 2))
    return states


def interpolated(
    image: NDArray[np.float32], states: NDArray[np.float64], side: int
) -> NDArray[np.float32]:
    """Return (N, side, side) bilinear samples by OpenCV, at the scale of the image."""
    steps = (np.arange(side) + 0.5) / side - 0.5
    grid = np.stack([*np.meshgrid(steps, steps), np.ones((side, side))])
    # Here pixel c spans [c, c + 1]; for OpenCV its centre is at c.
    points = (np.einsum("nij,jrc->inrc", states, grid) - 0.5).astype(np.float32)
    rows = [
        cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        for x, y in zip(points[0], points[1], strict=True)
    ]
    return np.array(rows, np.float32)


def test_grey_patches_equal_bilinear_remap(
    image: NDArray[np.uint8], rng: np.random.Generator
) -> None:
    states = tilted_states(rng, 40)
    patches = grey_patches(Region(image, states, PIXELS), states, 16)
    grey = image.astype(np.float32) @ np.array([0.299, 0.587, 0.114], np.float32)
    expected = interpolated(grey, states, 16).reshape(40, -1)
    expected -= expected.mean(axis=1, keepdims=True)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    # OpenCV rounds the position to 1/32 px.
    assert np.abs(patches - expected).max() < 0.01
    assert np.sum(patches * expected, axis=1).min() > 0.999


def test_gradient_patches_equal_plain_numpy(
    image: NDArray[np.uint8], rng: np.random.Generator
) -> None:
    states = tilted_states(rng, 40)
    patches = gradient_patches(Region(image, states, PIXELS), states, 12)
    grey = image.astype(np.float32) @ np.array([0.299, 0.587, 0.114], np.float32)
    padded = np.pad(grey, 1, mode="edge")
    x = (padded[1:-1, 2:] - padded[1:-1, :-2]) / 2.0
    y = (padded[2:, 1:-1] - padded[:-2, 1:-1]) / 2.0
    soft = np.stack([x, y]) / (np.hypot(x, y) + FEW_LEVELS)
    parts = [interpolated(channel, states, 12).reshape(40, -1) for channel in soft]
    expected = np.concatenate(parts, axis=1)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.sum(patches * expected, axis=1).min() > 0.998


def test_grey_patch_is_normalised_and_invariant_to_brightness(
    image: NDArray[np.uint8],
) -> None:
    patch = grey_patches(Region(image, STATE, PIXELS), STATE, 32)[0]
    assert patch.mean() == pytest.approx(0.0, abs=1e-6)
    assert math.sqrt(float(patch @ patch)) == pytest.approx(1.0, abs=1e-5)
    brighter = (1.8 * image + 10.0).astype(np.uint8)
    other = grey_patches(Region(brighter, STATE, PIXELS), STATE, 32)[0]
    assert float(patch @ other) > 0.999


def test_gradient_patch_keeps_its_correlation_in_half_a_shadow(
    image: NDArray[np.uint8],
) -> None:
    shaded = image.copy()
    shaded[:, :40] //= 3
    shaded[:, 40:] += 60
    both = [Region(frame, STATE, PIXELS) for frame in (image, shaded)]
    grey = [grey_patches(region, STATE, 12)[0] for region in both]
    soft = [gradient_patches(region, STATE, 12)[0] for region in both]
    assert float(soft[0] @ soft[1]) > 0.7 > float(grey[0] @ grey[1]) + 0.2


def test_flat_patch_is_all_zero() -> None:
    image = np.full((60, 80, 3), 90, np.uint8)
    region = Region(image, STATE, PIXELS)
    assert not grey_patches(region, STATE, 32).any()
    assert not gradient_patches(region, STATE, 12).any()


def test_region_shrinks_to_the_mean_of_its_pixels() -> None:
    rows, columns = np.mgrid[0:60, 0:80]
    level = (rows + 2 * columns).astype(np.uint8)
    region = Region(np.dstack([level] * 3), STATE, np.full(2, 4.0))
    x = region.origin[0] + 4.0 * (np.arange(region.grey.shape[1]) + 0.5) - 0.5
    y = region.origin[1] + 4.0 * (np.arange(region.grey.shape[0]) + 0.5) - 0.5
    expected = y[:, None] + 2.0 * x[None, :]
    within = (y[:, None] > 2) & (y[:, None] < 57) & (x > 2) & (x < 77)
    assert np.abs(region.grey - expected)[within].max() < 0.01


def test_region_marks_points_outside_the_image(image: NDArray[np.uint8]) -> None:
    states = STATE.copy()
    states[0, :, 2] = 4.0
    region = Region(image, states, PIXELS)
    left, top = (-region.origin).astype(int).tolist()
    outside = region.codes == CODES - 1
    assert outside[:top].all()
    assert outside[:, :left].all()
    assert not outside[top:, left:].any()


def test_region_covers_what_it_was_made_for_and_no_more(
    image: NDArray[np.uint8],
) -> None:
    small = np.array([[[8.0, 0.0, 40.0], [0.0, 8.0, 30.0]]])
    region = Region(image, small, PIXELS)
    away = small + np.array([[0.0, 0.0, 20.0], [0.0, 0.0, 0.0]])
    assert region.covers(image, small)
    assert not region.covers(image, away)
    larger = Region(image, away, PIXELS, region.bounds)
    assert larger.covers(image, small)
    assert larger.covers(image, away)
