from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from simbench.core.box import Box, area, centers, clip, overlap

_places = st.floats(-100, 100)
_extents = st.floats(0.1, 100)
_boxes = st.tuples(_places, _places, _extents, _extents).map(np.array)


def _row(*numbers: float) -> NDArray[np.float64]:
    return np.array(numbers, dtype=np.float64)


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        pytest.param(_row(0, 0, 2, 2), 1.0, id="same"),
        pytest.param(_row(1, 0, 2, 2), 2 / 6, id="half across"),
        pytest.param(_row(2, 0, 2, 2), 0.0, id="touching"),
        pytest.param(_row(9, 9, 2, 2), 0.0, id="apart"),
        pytest.param(_row(0.5, 0.5, 1, 1), 1 / 4, id="inside"),
        pytest.param(_row(0, 0, 0, 0), 0.0, id="empty"),
    ],
)
def test_overlap_is_intersection_over_union(
    other: NDArray[np.float64], expected: float
) -> None:
    assert overlap(_row(0, 0, 2, 2), other) == pytest.approx(expected)


def test_overlap_of_two_empty_boxes_is_zero() -> None:
    assert overlap(_row(1, 1, 0, 0), _row(1, 1, 0, 0)) == 0.0


def test_overlap_with_an_absent_box_is_nan() -> None:
    assert np.isnan(overlap(_row(0, 0, 1, 1), np.full(4, np.nan)))


@given(first=_boxes, second=_boxes, shift=_places)
def test_overlap_is_symmetric_bounded_and_invariant_to_translation(
    first: NDArray[np.float64], second: NDArray[np.float64], shift: float
) -> None:
    value = float(overlap(first, second))
    assert 0.0 <= value <= 1.0
    assert value == pytest.approx(float(overlap(second, first)))
    moved = _row(shift, shift, 0, 0)
    assert float(overlap(first + moved, second + moved)) == pytest.approx(
        value, abs=1e-9
    )


@given(box=_boxes)
def test_overlap_with_itself_is_one(box: NDArray[np.float64]) -> None:
    assert overlap(box, box) == pytest.approx(1.0)


@given(box=_boxes)
def test_clipped_boxes_are_inside_both_image_and_box(box: NDArray[np.float64]) -> None:
    inside = clip(box[None], 50, 40)[0]
    if np.isnan(inside).any():
        assert np.isnan(inside).all()
        high = box[:2] + box[2:]
        assert np.any(high <= 0) or box[0] >= 50 or box[1] >= 40
    else:
        assert np.all(inside[:2] >= 0)
        assert np.all(inside[:2] + inside[2:] <= [50 + 1e-9, 40 + 1e-9])
        assert area(inside) <= area(box) + 1e-9


def test_clip_does_not_modify_its_argument() -> None:
    boxes = np.array([[-5.0, -5.0, 10.0, 10.0]])
    clip(boxes, 4, 4)
    assert boxes.tolist() == [[-5.0, -5.0, 10.0, 10.0]]


def test_centres_are_in_continuous_pixels() -> None:
    assert centers(_row(10, 20, 4, 6)).tolist() == [12.0, 23.0]
    assert Box(10, 20, 4, 6).center == (12.0, 23.0)
    assert Box.from_center(12, 23, 4, 6) == Box(10, 20, 4, 6)


@given(box=_boxes)
def test_box_round_trips_through_an_array(box: NDArray[np.float64]) -> None:
    assert Box.from_array(box).to_array().tolist() == box.tolist()


def test_box_with_a_nan_or_infinite_number_is_not_finite() -> None:
    assert Box(0, 0, 1, 1).is_finite
    assert not Box(0, float("nan"), 1, 1).is_finite
    assert not Box(0, 0, float("inf"), 1).is_finite
