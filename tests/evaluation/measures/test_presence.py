"""VOTS and long-term measures by head; tests/compat compares with the VOT toolkit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simbench.evaluation.measures.presence import long_term, presence
from simbench.evaluation.measures.rules import RunBoxes

HERE = [20.0, 20.0, 10.0, 10.0]
HALF = [20.0, 20.0, 10.0, 5.0]  # overlap .5
AWAY = [50.0, 20.0, 10.0, 10.0]
NONE = [np.nan] * 4


def run(estimates: list[list[float]], truth: list[list[float]]) -> RunBoxes:
    boxes, true = np.array(estimates), np.array(truth)
    absent = np.isnan(true).any(axis=1)
    said = np.isnan(boxes).any(axis=1)
    return RunBoxes(boxes, true, absent, said, np.full(len(true), np.nan), 100, 60)


def test_each_frame_is_tracked_drifted_or_reported_absent() -> None:
    found = presence(run([HERE, HERE, HALF, AWAY, NONE], [HERE] * 5))
    # the first frame counts as reported absent, as in the toolkit
    assert found.robustness == pytest.approx(2 / 5)
    assert found.drift_rate_error == pytest.approx(1 / 5)
    assert found.not_reported_error == pytest.approx(2 / 5)
    assert found.accuracy == pytest.approx(1.5 / 3)
    assert found.quality == pytest.approx(1.5 / 5)
    assert np.isnan(found.absence_quality)


def test_absence_is_judged_from_eleven_frames_on() -> None:
    said = [NONE] * 6 + [HERE] * 5
    found = presence(run([HERE, *said], [HERE, *[NONE] * 11]))
    assert found.absence_quality == pytest.approx(6 / 11)
    assert found.quality == pytest.approx(6 / 12)
    ten = presence(run([HERE, *said[:10]], [HERE, *[NONE] * 10]))
    assert np.isnan(ten.absence_quality)


def test_frame_after_a_failure_reports_no_absence() -> None:
    given = run([HERE, *[NONE] * 12], [HERE, *[NONE] * 12])
    failed = replace(given, said_absent=np.zeros(13, np.bool_))
    assert presence(failed).absence_quality == 0.0
    assert presence(failed).quality == 0.0


def test_unknown_truth_is_left_out() -> None:
    given = run([HERE] * 4, [HERE, HERE, NONE, HERE])
    unknown = replace(given, absent=np.zeros(4, np.bool_))
    assert presence(unknown).robustness == pytest.approx(2 / 3)


def test_f_is_that_of_the_best_confidence() -> None:
    given = run([HERE, HERE, HERE, AWAY, AWAY], [HERE] * 5)
    found = long_term(given, np.array([1, 0.9, 0.8, 0.2, 0.1]))
    assert found.precision == 1.0
    assert found.recall == pytest.approx(2 / 5)
    assert found.f == pytest.approx(2 * 0.4 / 1.4)


def test_tracker_without_confidence_is_judged_by_all_its_boxes() -> None:
    given = run([HERE, HERE, AWAY, NONE], [HERE] * 4)
    found = long_term(given, np.full(4, np.nan))
    assert found.precision == pytest.approx(1 / 3)  # the given box, a hit, a miss
    assert found.recall == pytest.approx(1 / 4)


def test_f_without_any_target_is_unknown() -> None:
    found = long_term(run([HERE, HERE], [NONE, NONE]), np.ones(2))
    assert np.isnan([found.precision, found.recall, found.f]).all()
