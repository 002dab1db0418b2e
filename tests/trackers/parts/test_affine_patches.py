"""Grey patches under affine states, and random walks of states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.trackers.parts.affine_patches import (
    bounded,
    box_of,
    grey_patches,
    state_of,
)


def grey_image() -> NDArray[np.uint8]:
    rng = np.random.default_rng(5)
    return rng.integers(0, 255, (60, 90, 1), np.uint8).repeat(3, axis=2)


def test_box_and_state_are_inverse() -> None:
    box = Box(10.0, 20.0, 30.0, 40.0)
    assert box_of(state_of(box)) == box
    assert box_of(state_of(Box(10.0, 20.0, 0.5, 4.0))).width == 3.0


def test_patch_at_one_pixel_a_sample_is_a_slice_of_the_image() -> None:
    image = grey_image()
    state = state_of(Box(20.0, 10.0, 16.0, 12.0))
    patch = grey_patches(image, state[None], (12, 16))[0].reshape(12, 16)
    np.testing.assert_allclose(patch, image[10:22, 20:36, 0], atol=1e-3)


def test_patch_turned_by_a_quarter_is_the_turned_patch() -> None:
    image = grey_image()
    square = state_of(Box(20.0, 10.0, 16.0, 16.0))
    turned = square.copy()
    turned[:, :2] = [[0.0, -16.0], [16.0, 0.0]]
    upright, rotated = grey_patches(image, np.stack([square, turned]), (16, 16))
    expected = np.rot90(upright.reshape(16, 16))
    np.testing.assert_allclose(rotated.reshape(16, 16), expected, atol=1e-3)


def test_patch_beyond_the_image_repeats_its_border() -> None:
    image = grey_image()
    state = state_of(Box(-8.0, -6.0, 16.0, 12.0))
    patch = grey_patches(image, state[None], (12, 16))[0].reshape(12, 16)
    padded = np.pad(image[..., 0], 10, mode="edge")
    np.testing.assert_allclose(patch, padded[4:16, 2:18], atol=1e-3)
    far = state_of(Box(500.0, 500.0, 16.0, 12.0))
    assert np.all(grey_patches(image, far[None], (12, 16)) == image[-1, -1, 0])


def test_patch_of_a_large_target_is_made_of_single_pixels() -> None:
    image = grey_image()
    whole = grey_patches(image, state_of(Box(0.0, 0.0, 90.0, 60.0))[None], (4, 6))[0]
    # The middles of samples 15 px wide are the middles of pixels.
    np.testing.assert_allclose(whole, image[7::15, 7::15, 0].ravel(), atol=1e-3)


def test_patches_do_not_depend_on_the_others() -> None:
    image = grey_image()
    states = np.stack([state_of(Box(20.0, 10.0, w, w)) for w in (14.0, 16.0, 17.0)])
    together = grey_patches(image, states, (12, 12))
    alone = [grey_patches(image, state[None], (12, 12))[0] for state in states]
    np.testing.assert_allclose(together, alone, atol=2e-3)


def test_bounded_states_keep_their_direction() -> None:
    states = np.array([[[100.0, 0.0, -5.0], [0.0, 1.0, 70.0]]])
    sides = (np.array([5.0, 5.0]), np.array([50.0, 50.0]))
    result = bounded(states, sides, np.array([90.0, 60.0]))[0]
    assert result.tolist() == [[50.0, 0.0, 0.0], [0.0, 5.0, 60.0]]
