"""Confidence against the truth."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from simbench.evaluation.measures.confidence import (
    alarm_delays,
    calibration,
    false_alarms,
    separation,
    stated,
)
from simbench.evaluation.measures.losses import Loss

NEVER = np.zeros(4, np.bool_)


@pytest.mark.parametrize(
    "confidence",
    [
        pytest.param([1, np.nan, np.nan, np.nan], id="nothing is stated"),
        pytest.param([1, 0.5, 0.5, 0.5], id="always the same"),
        pytest.param([1.0], id="one frame"),
    ],
)
def test_confidence_that_says_nothing_is_not_stated(confidence: list[float]) -> None:
    assert stated(np.array(confidence), NEVER[: len(confidence)]) is None


def test_target_said_absent_has_confidence_zero() -> None:
    said = np.array([False, False, True, False])
    found = stated(np.array([1, 0.8, 0.9, np.nan]), said)
    assert found is not None
    assert_allclose(found, [1, 0.8, 0, np.nan])


@pytest.mark.parametrize(
    ("confidence", "expected"),
    [
        pytest.param([0.9, 0.8, 0.2, 0.1], 1.0, id="perfect"),
        pytest.param([0.1, 0.2, 0.8, 0.9], 0.0, id="the wrong way round"),
        pytest.param([0.5, 0.5, 0.5, 0.5], 0.5, id="ties count by half"),
        pytest.param([0.9, 0.3, 0.6, 0.1], 0.75, id="three pairs of four"),
        pytest.param([0.9, np.nan, 0.2, 0.1], 1.0, id="NaN is left out"),
    ],
)
def test_separation(confidence: list[float], expected: float) -> None:
    right = np.array([True, True, False, False])
    assert separation(np.array(confidence), right) == expected


def test_separation_of_one_kind_of_frame_is_unknown() -> None:
    assert np.isnan(separation(np.array([0.2, 0.9]), np.array([True, True])))


def test_calibration_error_is_weighted_by_frames() -> None:
    confidence = np.array([0.95, 0.95, 0.95, 0.25])
    right = np.array([True, True, False, False])
    found = calibration(confidence, right)
    assert found.count.tolist() == [0, 0, 1, 0, 0, 0, 0, 0, 0, 3]
    assert_allclose(found.share[[2, 9]], [0, 2 / 3])
    assert found.error == pytest.approx((3 * (0.95 - 2 / 3) + 0.25) / 4)


def test_calibration_of_certainty_is_in_the_last_bin() -> None:
    found = calibration(np.ones(2), np.array([True, True]))
    assert (found.count[9], found.error) == (2, 0.0)
    assert np.isnan(calibration(np.empty(0), np.empty(0, np.bool_)).error)


def test_alarm_comes_before_the_target_is_found_or_not_at_all() -> None:
    confidence = np.array([1, 0.9, 0.8, 0.7, 0.2, 0.9, 0.9, 0.9, 0.1])
    losses = [Loss(2, 6, 6), Loss(6, 8, 8)]
    assert alarm_delays(confidence, losses) == [2, None]


def test_false_alarm_needs_a_visible_target_on_the_box() -> None:
    confidence = np.array([0.2, 0.2, 0.2, 0.9, 0.2])
    right = np.array([True, True, False, True, True])
    visible = np.array([1.0, 0.1, 1.0, 1.0, np.nan])
    # frames 0, 3 and 4, whose visibility is unknown
    assert false_alarms(confidence, right, visible) == pytest.approx(2 / 3)
    assert np.isnan(false_alarms(confidence, ~right & ~right, visible[:5] * 0))
