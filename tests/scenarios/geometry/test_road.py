from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Road, RoadSection


def _line(*sections: RoadSection) -> RoadLine:
    return RoadLine.from_road(Road(lanes=3, before_m=100, sections=sections))


def test_a_straight_road_is_the_x_axis() -> None:
    point = _line(RoadSection(length_m=500)).point(120.0, 4.0, 1.0)
    assert point == pytest.approx([120.0, 4.0, 1.0])


def test_the_origin_lies_at_along_zero_with_heading_zero() -> None:
    line = _line(RoadSection(length_m=300, curve_radius_m=200))
    assert line.point(0.0, 0.0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert float(line.heading_at(0.0)) == pytest.approx(0.0, abs=1e-9)


def test_a_left_curve_turns_by_length_over_radius() -> None:
    line = _line(
        RoadSection(length_m=100), RoadSection(length_m=200, curve_radius_m=400)
    )
    turned = float(line.heading_at(400.0) - line.heading_at(50.0))
    assert turned == pytest.approx(200 / 400, rel=0.01)  # positive is left


def test_a_slope_climbs_by_length_times_grade() -> None:
    line = _line(RoadSection(length_m=200), RoadSection(length_m=300, slope_percent=5))
    climb = line.point(600.0, 0.0)[2] - line.point(100.0, 0.0)[2]
    assert climb == pytest.approx(300 * 0.05, rel=0.02)


def test_heading_never_jumps_where_sections_meet() -> None:
    line = _line(
        RoadSection(length_m=100), RoadSection(length_m=200, curve_radius_m=100)
    )
    steps = np.abs(np.diff(line.heading_at(np.arange(0.0, 300.0, 1.0))))
    assert steps.max() <= 1.0 / 100 + 1e-9  # one metre on the tightest circle


def test_lanes_count_from_the_right() -> None:
    line = _line(RoadSection(length_m=100))
    lanes = line.lane_lateral(np.arange(3))
    assert np.diff(lanes) == pytest.approx([3.5, 3.5])
    # median 3 m: its half, half a metre of margin and half a lane from the middle
    assert lanes[2] == pytest.approx(-(1.5 + 0.5 + 1.75))


@settings(deadline=None)  # the first call imports SciPy
@given(along=st.floats(-80, 550), lateral=st.floats(-50, 50))
def test_locate_inverts_point(along: float, lateral: float) -> None:
    line = _line(
        RoadSection(length_m=150),
        RoadSection(length_m=250, curve_radius_m=-300, slope_percent=3),
    )
    found = line.locate(line.point(along, lateral)[None])[0]
    assert found == pytest.approx([along, lateral], abs=5e-3)


def test_headings_are_tangents() -> None:
    line = _line(RoadSection(length_m=400, curve_radius_m=150))
    here, there = line.point(200.0, 0.0), line.point(200.5, 0.0)
    tangent = math.atan2(there[1] - here[1], there[0] - here[0])
    # The line is sampled every metre: a chord turns by half of 1 m / 150 m at most.
    assert tangent == pytest.approx(float(line.heading_at(200.25)), abs=0.5 / 150)
