from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.photometry import luminance, mean_luminance, ring, target_contrast


def _scene(target: int, ground: int) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    image = np.full((40, 40, 3), ground, np.uint8)
    mask = np.zeros((40, 40), bool)
    mask[16:24, 16:24] = True
    image[mask] = target
    return image, mask


def test_white_is_one_and_black_is_zero() -> None:
    assert mean_luminance(np.full((2, 2, 3), 255, np.uint8)) == pytest.approx(1.0)
    assert mean_luminance(np.zeros((2, 2, 3), np.uint8)) == 0.0


def test_level_188_is_half_the_light_of_white() -> None:
    assert luminance(np.full((1, 1, 3), 188, np.uint8))[0, 0] == pytest.approx(
        0.5, abs=0.005
    )


def test_green_weighs_most() -> None:
    red, green, blue = (luminance(np.eye(3, dtype=np.uint8)[None] * 255))[0]
    assert [red, green, blue] == pytest.approx([0.2126, 0.7152, 0.0722])


def test_weber_and_michelson_are_those_of_the_two_luminances() -> None:
    image, mask = _scene(188, 255)
    low = float(luminance(image)[20, 20])
    contrast = target_contrast(image, mask)
    assert contrast.weber == pytest.approx(low - 1.0)
    assert contrast.michelson == pytest.approx((1.0 - low) / (1.0 + low))


def test_a_target_like_its_surroundings_has_no_contrast() -> None:
    contrast = target_contrast(*_scene(90, 90))
    measures = [contrast.weber, contrast.michelson, contrast.rms]
    assert measures == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_rms_contrast_halves_with_the_deviation_from_the_mean() -> None:
    full = target_contrast(*_scene(200, 100)).rms
    half = target_contrast(*_scene(175, 125)).rms
    assert half == pytest.approx(full / 2.0)


def test_the_ring_keeps_to_the_picture_and_leaves_out_others() -> None:
    mask = np.zeros((6, 6), bool)
    mask[0, 0] = True
    assert ring(mask, 2).sum() == 8
    image, target = _scene(200, 100)
    others = np.zeros((40, 40), bool)
    others[:, 24:] = True
    image[others] = 255
    assert target_contrast(image, target, others=others) != target_contrast(
        image, target
    )
    clean, _ = _scene(200, 100)
    assert target_contrast(image, target, others=others).weber == pytest.approx(
        target_contrast(clean, target).weber
    )


def test_a_hidden_target_has_no_contrast_to_measure() -> None:
    image, mask = _scene(200, 100)
    assert math.isnan(target_contrast(image, np.zeros_like(mask)).rms)


def test_a_mask_of_another_size_is_refused() -> None:
    image, _ = _scene(200, 100)
    with pytest.raises(ValueError, match="shape"):
        target_contrast(image, np.zeros((3, 3), bool))
