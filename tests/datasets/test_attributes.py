"""Attributes of boxes and pictures, on sequences whose answer is known by head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.datasets.attributes import box_attributes, picture_attributes

NAN = [np.nan] * 4


def test_boxes_tell_speed_size_and_change() -> None:
    boxes = np.array(
        [[0, 0, 10, 10], [6, 0, 10, 10], [8, 0, 30, 10], NAN, [8, 0, 60, 30]], float
    )
    found = box_attributes(boxes)
    nan = np.nan
    # the centre moves by 6 of 10 px, then by 12 of 17
    np.testing.assert_array_equal(found["fast_motion"], [nan, 1, 1, nan, nan])
    np.testing.assert_array_equal(found["scale_change"], [0, 0, 1, nan, 1])
    np.testing.assert_array_equal(found["aspect_change"], [0, 0, 1, nan, 0])
    np.testing.assert_array_equal(found["low_resolution"], [1, 1, 1, nan, 0])


def _shifted(sequence: Sequence, step: int, *, grey: bool = False) -> Sequence:
    """Return random dots that move by whole pixels behind a fixed target."""
    rng = np.random.default_rng(5)
    dots = rng.integers(0, 2, (30, 50, 3)).repeat(4, 0).repeat(4, 1) * 200
    image: NDArray[np.uint8] = dots.astype(np.uint8)
    if grey:
        image = image[..., :1].repeat(3, axis=2)
    frames = [
        Frame(np.roll(image, step * i, axis=1), i / 25, i) for i in range(len(sequence))
    ]
    height, width = image.shape[:2]
    return replace(sequence, frames=frames, width=width, height=height)


@pytest.mark.parametrize(("step", "moves"), [(0, 0.0), (2, 1.0)])
def test_background_that_moves_is_camera_motion(
    tiny: Sequence, step: int, moves: float
) -> None:
    found = picture_attributes(_shifted(tiny, step))["camera_motion"]
    assert np.isnan(found[0])
    assert found[1:].tolist() == [moves] * 7


def test_background_without_corners_tells_nothing(tiny: Sequence) -> None:
    blank = np.zeros((24, 32, 3), np.uint8)
    frames = [Frame(blank, i / 25, i) for i in range(len(tiny))]
    found = picture_attributes(replace(tiny, frames=frames))
    assert np.isnan(found["camera_motion"]).all()


@pytest.mark.parametrize("grey", [False, True])
def test_pictures_without_colour_are_grey(tiny: Sequence, grey: bool) -> None:
    found = picture_attributes(_shifted(tiny, 0, grey=grey))["grey"]
    assert found.tolist() == [float(grey)] * 8
