"""What a course makes of jitter, braking, doubt and jumps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from simbench.trackers.parts.course import Course


def eastward(speed: float = 4.0) -> Course:
    """Return a known course along x that has been followed for a while."""
    course = Course(0.0, 0.0, start_px=5.0, still_px=0.5)
    for index in range(1, 30):
        course.advance(speed * index, 0.0)
    return course


def test_course_from_jitter_starts_less_often_with_the_test(
    rng: np.random.Generator,
) -> None:
    starts = {0.0: 0, 2.0: 0}
    for _ in range(100):
        places = np.cumsum(rng.normal(0.0, 3.0, (6, 2)), axis=0).tolist()
        for jitter in starts:
            course = Course(0.0, 0.0, start_px=5.0, still_px=0.5, jitter=jitter)
            for x, y in places:
                course.advance(x, y)
            starts[jitter] += course.is_known
    assert starts[0.0] > 60 > 30 > starts[2.0]


def test_followed_course_is_steady_and_its_error_vanishes() -> None:
    course = eastward()
    assert course.is_steady
    assert course.error < 0.2
    assert course.disagreement < 0.05


def test_vibration_leaves_a_course_steady_and_widens_its_error() -> None:
    course = eastward()
    for index in range(30, 60):
        course.advance(4.0 * index + 2.0 * (-1) ** index, 0.0)
    assert course.is_steady
    assert course.error > 2.0


def test_braking_target_has_no_steady_course() -> None:
    course = eastward(8.0)
    x = 8.0 * 29
    for speed in (6.0, 4.0, 2.0, 0.0, -2.0):
        x += speed
        course.advance(x, 0.0)
    assert not course.is_steady


def test_steps_aside_disagree_with_the_course() -> None:
    course = eastward()
    for index in range(1, 8):
        course.advance(4.0 * 29, 4.0 * index)
    assert course.disagreement > 0.5
    assert not course.is_steady


def test_tolerance_decides_what_disagrees() -> None:
    disagreements = []
    for tolerance in (math.pi / 8, math.pi / 2):
        course = eastward()
        course.tolerance = tolerance
        for index in range(1, 8):
            course.advance(4.0 * (29 + index), 4.0 * index)
        disagreements.append(course.disagreement)
    assert disagreements[0] > 0.5 > disagreements[1]


def test_doubtful_step_teaches_in_proportion_to_its_trust() -> None:
    speeds = []
    for trust in (0.0, 0.5, 1.0):
        course = eastward()
        course.advance(4.0 * 29 + 14.0, 0.0, trust=trust)
        speeds.append(course.speed)
    assert speeds[0] == pytest.approx(4.0, abs=0.01)
    assert speeds[1] == pytest.approx((speeds[0] + speeds[2]) / 2)
    assert speeds[2] > 6.0


def test_jump_of_an_unknown_course_is_no_displacement() -> None:
    course = Course(0.0, 0.0, start_px=5.0, still_px=0.5)
    course.jump(0.0, 0.0)
    course.advance(1.0, 0.0)
    course.jump(90.0, 40.0)
    for x in (91.0, 92.0):
        course.advance(x, 40.0)
    assert not course.is_known  # 3 px, not 92
    for x in (93.0, 94.0, 95.0):
        course.advance(x, 40.0)
    assert course.is_known
    assert course.theta == pytest.approx(0.0)


def test_course_that_every_step_contradicts_is_forgotten() -> None:
    course = eastward()
    for index in range(1, 40):
        course.advance(4.0 * 29 - 4.0 * index, 0.0)
        course.forget_if_wrong()
        if not course.is_known:
            break
    assert not course.is_known
