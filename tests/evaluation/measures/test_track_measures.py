"""The measures: hand-checked values, edge cases and general properties."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from simbench.evaluation.measures import frame_errors, track_measures

FrameMeasure: TypeAlias = Callable[
    [NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]
]
NAN_BOX = [np.nan] * 4
TRUTH = np.array([[10.0, 20.0, 4.0, 8.0]])

distances = arrays(
    np.float64, st.integers(1, 30), elements=st.floats(0.0, 100.0) | st.just(np.inf)
)
overlaps = arrays(np.float64, st.integers(1, 30), elements=st.floats(0.0, 1.0))
boxes = arrays(
    np.float64,
    (6, 4),
    elements=st.floats(0.5, 200.0),
)


def test_scored_frames_exclude_the_first_and_absent_frames() -> None:
    absent = np.array([False, False, True, False])
    assert frame_errors.scored_frames(absent).tolist() == [False, True, False, True]
    assert absent.tolist() == [False, False, True, False]


def test_center_error_is_the_distance_of_centres() -> None:
    estimate = np.array([[12.0, 22.0, 6.0, 12.0]])  # centre (15, 28), truth (12, 24)
    assert frame_errors.center_error(estimate, TRUTH).tolist() == [5.0]


def test_norm_center_error_divides_by_the_true_size() -> None:
    estimate = np.array([[12.4, 20.0, 4.0, 8.0]])  # 2.4 px of 4 px to the right
    estimate[0, 1] += 6.4  # 6.4 px of 8 px down: a triangle of 0.6 and 0.8
    assert_allclose(frame_errors.norm_center_error(estimate, TRUTH), [1.0])


def test_norm_center_error_counts_a_size_below_one_pixel_as_one() -> None:
    truth = np.array([[0.0, 0.0, 0.5, 0.5]])
    estimate = np.array([[3.0, 0.0, 0.5, 0.5]])
    assert frame_errors.norm_center_error(estimate, truth).tolist() == [3.0]


def test_frame_overlap_is_intersection_over_union() -> None:
    estimate = np.array([[12.0, 20.0, 4.0, 8.0]])  # half of it on the truth
    assert_allclose(frame_errors.frame_overlap(estimate, TRUTH), [1 / 3])


@pytest.mark.parametrize(
    ("measure", "miss"),
    [
        pytest.param(frame_errors.center_error, np.inf, id="center error"),
        pytest.param(frame_errors.norm_center_error, np.inf, id="norm center error"),
        pytest.param(frame_errors.frame_overlap, 0.0, id="overlap"),
    ],
)
def test_frame_without_estimate_is_a_miss_and_without_truth_is_nan(
    measure: FrameMeasure, miss: float
) -> None:
    estimates = np.array([NAN_BOX, TRUTH[0], NAN_BOX])
    truth = np.array([TRUTH[0], NAN_BOX, NAN_BOX])
    assert_array_equal(measure(estimates, truth), [miss, np.nan, np.nan])


def test_precision_counts_an_error_of_exactly_the_threshold() -> None:
    errors = np.array([0.0, 20.0, 20.000001, np.inf])
    assert track_measures.precision(errors) == 0.5
    curve = track_measures.precision_curve(errors)
    assert len(curve) == 51
    assert (curve[0], curve[19], curve[20], curve[21]) == (0.25, 0.25, 0.5, 0.75)


def test_success_does_not_count_an_overlap_of_exactly_the_threshold() -> None:
    overlaps = np.array([0.0, 0.5, 0.500001, 1.0])
    assert track_measures.success(overlaps) == 0.5
    curve = track_measures.success_curve(overlaps)
    assert len(curve) == 21
    assert (curve[0], curve[9], curve[10], curve[20]) == (0.75, 0.75, 0.5, 0.0)


def test_success_thresholds_hold_one_half_exactly() -> None:
    assert track_measures.SUCCESS_THRESHOLDS[10] == 0.5
    assert_allclose(track_measures.SUCCESS_THRESHOLDS, np.linspace(0.0, 1.0, 21))


def test_success_area_of_perfect_boxes_is_20_of_21() -> None:
    assert track_measures.success_area(np.ones(7)) == pytest.approx(20 / 21)


def test_success_area_of_no_overlap_is_zero() -> None:
    assert track_measures.success_area(np.zeros(7)) == 0.0


def test_norm_precision_is_the_value_at_0_2_and_the_area_the_mean_of_all() -> None:
    errors = np.array([0.0, 0.2, 0.3, np.inf])
    assert track_measures.norm_precision(errors) == 0.5
    # 0 passes 51 thresholds, 0.2 those from 0.20 on (31), 0.3 those from 0.30 on (21)
    assert track_measures.norm_precision_area(errors) == pytest.approx(103 / 51 / 4)


def test_shares_are_nan_without_scored_frames() -> None:
    empty = np.zeros(0)
    for share in (
        track_measures.precision,
        track_measures.success,
        track_measures.success_area,
        track_measures.norm_precision,
        track_measures.norm_precision_area,
    ):
        assert np.isnan(share(empty))
    assert np.isnan(track_measures.success_curve(empty)).all()


def test_frames_per_second_is_updates_over_their_total_time() -> None:
    seconds = np.array([9.0, 0.1, 0.3, np.nan])  # initialisation, two updates, none
    assert track_measures.frames_per_second(seconds) == pytest.approx(2 / 0.4)


def test_frames_per_second_is_nan_without_a_timed_update() -> None:
    assert np.isnan(track_measures.frames_per_second(np.array([1.0])))


def test_particle_usage_excludes_the_first_frame_and_frames_without_estimate() -> None:
    particles = np.array([0, 10, 40, 0])
    estimated = np.array([True, True, True, False])
    assert track_measures.particle_usage(particles, estimated) == (10.0, 25.0)


def test_particle_usage_is_nan_without_estimates() -> None:
    least, mean = track_measures.particle_usage(
        np.array([0, 0]), np.array([True, False])
    )
    assert np.isnan(least)
    assert np.isnan(mean)


@given(errors=distances)
def test_precision_curve_is_ascending_and_agrees_with_the_score(
    errors: NDArray[np.float64],
) -> None:
    curve = track_measures.precision_curve(errors)
    assert (np.diff(curve) >= 0.0).all()
    assert 0.0 <= curve[0]
    assert curve[-1] <= 1.0
    assert curve[20] == track_measures.precision(errors)


@given(values=overlaps)
def test_success_curve_is_descending_and_agrees_with_the_score(
    values: NDArray[np.float64],
) -> None:
    curve = track_measures.success_curve(values)
    assert (np.diff(curve) <= 0.0).all()
    assert curve[10] == track_measures.success(values)


@given(values=overlaps)
def test_success_area_is_the_mean_overlap_within_one_step(
    values: NDArray[np.float64],
) -> None:
    # Each frame passes ceil(20 s) of the 21 thresholds: 20 s <= ceil(20 s) < 20 s + 1.
    area = track_measures.success_area(values) * 21.0 / 20.0
    mean = float(values.mean())
    assert mean - 1e-9 <= area <= mean + 1 / 20 + 1e-9


@given(values=overlaps, seed=st.integers(0, 1000))
def test_shares_do_not_depend_on_the_order_of_frames(
    values: NDArray[np.float64], seed: int
) -> None:
    mixed = np.random.default_rng(seed).permutation(values)
    assert_array_equal(
        track_measures.success_curve(mixed), track_measures.success_curve(values)
    )


@given(first=boxes, second=boxes, shift=st.floats(-500.0, 500.0))
def test_measures_do_not_change_when_both_boxes_move(
    first: NDArray[np.float64], second: NDArray[np.float64], shift: float
) -> None:
    move = np.array([shift, -shift, 0.0, 0.0])
    for measure in (
        frame_errors.center_error,
        frame_errors.norm_center_error,
        frame_errors.frame_overlap,
    ):
        moved = measure(first + move, second + move)
        assert_allclose(moved, measure(first, second), atol=1e-6)


@given(estimates=boxes, truth=boxes, scale=st.sampled_from([2.0, 4.0, 8.0]))
def test_overlap_and_normalised_error_do_not_change_with_resolution(
    estimates: NDArray[np.float64], truth: NDArray[np.float64], scale: float
) -> None:
    truth = truth + np.array([0.0, 0.0, 1.0, 1.0])  # above the minimum of one pixel
    for measure in (frame_errors.norm_center_error, frame_errors.frame_overlap):
        scaled = measure(estimates * scale, truth * scale)
        assert_allclose(scaled, measure(estimates, truth), atol=1e-9)
