"""Boxes sampled around a target, their patches, and the regression of its box."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.box import Box, centers, overlap
from simbench.trackers.parts.box_patches import box_patches
from simbench.trackers.parts.box_regressor import BoxRegressor
from simbench.trackers.parts.box_samples import (
    boxes_off,
    boxes_on,
    candidate_boxes,
    centered_inside,
    regression_boxes,
    whole_picture_boxes,
)

Values = NDArray[np.floating]

TARGET = np.array([100.0, 60.0, 60.0, 20.0])
EXTENT = (320, 240)


def test_candidates_have_the_deviations_of_the_paper(rng: np.random.Generator) -> None:
    boxes = candidate_boxes(TARGET, 20_000, 0.3, 0.5, rng)
    shifts = centers(boxes) - centers(TARGET)
    assert shifts.std(axis=0) == pytest.approx([12.0, 12.0], rel=0.03)  # of side 40
    steps = np.log(boxes[:, 2] / TARGET[2]) / np.log(1.05)
    assert steps.std() == pytest.approx(0.5, rel=0.03)
    assert boxes[:, 2] / boxes[:, 3] == pytest.approx(3.0)


def test_examples_overlap_as_much_as_asked_for(rng: np.random.Generator) -> None:
    on = boxes_on(TARGET, 200, 0.7, rng)
    near = boxes_off(TARGET, 300, 0.3, 2.0, rng, EXTENT)
    anywhere = whole_picture_boxes(TARGET, 300, 0.3, rng, EXTENT)
    shaped = regression_boxes(TARGET, 200, 0.6, rng)
    assert [len(each) for each in (on, near, anywhere, shaped)] == [200, 300, 300, 200]
    assert overlap(on, TARGET).min() >= 0.7
    assert overlap(near, TARGET).max() <= 0.3
    assert overlap(anywhere, TARGET).max() <= 0.3
    assert overlap(shaped, TARGET).min() >= 0.6
    assert np.ptp(shaped[:, 2] / shaped[:, 3]) > 0.5  # shapes differ
    for boxes in (near, anywhere):
        assert centers(boxes).min() >= 0.0
        assert (centers(boxes).max(axis=0) <= EXTENT).all()
    assert np.abs(centers(near) - centers(TARGET)).max() <= 2.0 * 40.0
    assert np.ptp(centers(anywhere)[:, 0]) > 250.0


def test_one_box_is_repeated_where_none_fits(rng: np.random.Generator) -> None:
    assert (boxes_on(TARGET, 5, 1.0, rng) == TARGET).all()
    narrow = boxes_off(TARGET, 5, 0.3, 0.01, rng)
    assert overlap(narrow, TARGET).max() <= 0.3


def test_centres_are_moved_into_the_picture() -> None:
    found = centered_inside(np.array([[-50.0, 10.0, 20.0, 20.0]]), EXTENT)
    assert found.tolist() == [[-10.0, 10.0, 20.0, 20.0]]


@pytest.mark.parametrize("growth", [0.4, 1.0, 3.0])
def test_box_fills_the_same_part_of_its_patch(growth: float) -> None:
    image = np.full((600, 900, 3), 90, np.uint8)
    box = Box.from_center(450.0, 300.0, round(120 * growth), round(40 * growth))
    left, top, width, height = (round(each) for each in box.to_array())
    image[top : top + height, left : left + width] = (240, 20, 20)
    (patch,) = box_patches(image, box.to_array()[None])
    rows, columns = np.nonzero(patch[..., 0] > 165)
    for side in (rows, columns):
        assert side.min() == pytest.approx(10, abs=1)
        assert side.max() == pytest.approx(53, abs=1)


def test_patch_of_a_group_is_that_of_its_box_alone(rng: np.random.Generator) -> None:
    coarse = rng.integers(0, 255, (15, 20, 3), np.uint8)
    image = np.asarray(cv2.resize(coarse, (320, 240)), np.uint8)  # of no fine detail
    boxes = boxes_off(TARGET, 12, 0.3, 2.0, rng, EXTENT)
    together = box_patches(image, boxes)
    for box, patch in zip(boxes, together, strict=True):
        alone = box_patches(image, box[None])[0]
        difference = np.abs(alone.astype(int) - patch)
        assert np.median(difference) <= 2.0


def test_box_at_the_border_shows_the_mean_colour_outside() -> None:
    image = np.full((100, 100, 3), 50, np.uint8)
    image[:, 50:] = 150
    (patch,) = box_patches(image, np.array([[-20.0, 40.0, 40.0, 20.0]]))
    assert patch[32, 2].tolist() == [100, 100, 100]
    assert patch[32, 60].tolist() == [50, 50, 50]


def test_regression_finds_a_box_that_features_tell(rng: np.random.Generator) -> None:
    boxes = regression_boxes(TARGET, 400, 0.6, rng)
    mixing = rng.standard_normal((6, 30))

    def features(boxes: Values, target: Values) -> Values:
        places = (centers(target) - centers(boxes)) / boxes[:, 2:]
        sizes = np.log(target[2:] / boxes[:, 2:])
        known = np.concatenate([places, sizes, np.ones((len(boxes), 2))], axis=1)
        return (known @ mixing).astype(np.float32)

    regressor = BoxRegressor(features(boxes, TARGET), boxes, TARGET, 1e-6)
    moved = np.array([110.0, 66.0, 66.0, 19.0])
    others = regression_boxes(moved, 20, 0.8, rng)
    found = regressor(features(others, moved), others)
    assert overlap(found, moved).min() > 0.98
    assert overlap(others, moved).max() < 0.98
    stiff = BoxRegressor(features(boxes, TARGET), boxes, TARGET, 1e9)
    assert overlap(stiff(features(others, moved), others), others).min() > 0.9
