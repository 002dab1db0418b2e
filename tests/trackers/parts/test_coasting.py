"""Coasting on a steady course, and the search after it."""

from __future__ import annotations

import pytest

from simbench.trackers.parts.coasting import COAST_FRAMES, coasts, set_search
from simbench.trackers.parts.confidence import Confidence
from simbench.trackers.parts.course import Course


@pytest.fixture
def steady() -> Course:
    course = Course(0.0, 0.0, start_px=5.0, still_px=0.5)
    for x in range(0, 80, 4):
        course.advance(float(x), 0.0)
    assert course.is_steady
    return course


def search(course: Course, lost: int) -> dict[str, float]:
    confidence = Confidence(0.8, 0.8)
    confidence.lost = lost
    motion = {"seen_x": 5.0, "seen_y": 6.0}
    set_search(motion, confidence, course, [50.0, 60.0], [40.0, 30.0], (1.0, -2.0))
    return motion


def test_steady_course_is_carried_on_before_a_search(steady: Course) -> None:
    unknown = Course(0.0, 0.0, start_px=5.0, still_px=0.5)
    assert coasts(steady, COAST_FRAMES)
    assert not coasts(steady, COAST_FRAMES + 1)
    assert not coasts(unknown, 1)
    every = [search(steady, lost)["scout_every"] for lost in (0, COAST_FRAMES, 21)]
    assert every == [0, 0, 2]
    assert search(unknown, 1)["scout_every"] == 2


def test_scouts_start_from_where_the_target_was_seen_and_spread(
    steady: Course,
) -> None:
    seen, lost, long_lost = (search(steady, each) for each in (0, 5, 200))
    assert (seen["seen_x"], seen["seen_y"]) == (51.0, 58.0)
    assert (lost["seen_x"], lost["seen_y"]) == (6.0, 4.0)  # moves with the background
    assert (lost["scout_x"], lost["scout_y"]) == pytest.approx((60.0, 45.0))
    assert (long_lost["scout_x"], long_lost["scout_y"]) == (120.0, 90.0)
    assert seen["floor"] == pytest.approx(0.4)
