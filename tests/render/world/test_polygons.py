from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from simbench.render.world.polygons import dashes, offset, triangulate


def _area(triangles: NDArray[np.float64]) -> float:
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    assert np.all(cross > 0)  # counter-clockwise seen from above
    return float(cross.sum() / 2)


@pytest.mark.parametrize("is_reversed", [False, True])
def test_an_outline_with_a_notch_is_covered_exactly(is_reversed: bool) -> None:
    corners = [[0, 0, 1], [4, 0, 1], [4, 4, 1], [2, 4, 1], [2, 2, 1], [0, 2, 1]]
    outline = np.array(corners[::-1] if is_reversed else corners, dtype=np.float64)
    triangles = triangulate(outline)
    assert len(triangles) == 4
    assert _area(triangles) == pytest.approx(12.0)
    assert np.all(triangles[..., 2] == 1.0)


@given(st.integers(3, 30), st.integers(0, 10**6))
def test_a_star_is_covered_exactly(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * np.arange(count) / count
    radius = rng.uniform(1.0, 3.0, count)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    area = np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2
    outline = np.stack([x, y, np.zeros(count)], axis=1)
    assert _area(triangulate(outline)) == pytest.approx(area)


def test_degenerate_outlines_raise_no_error() -> None:
    twice = np.array([[0, 0, 0], [0, 0, 0], [2, 0, 0], [2, 2, 0]], dtype=np.float64)
    assert _area(triangulate(twice)) == pytest.approx(2.0)
    assert triangulate(twice[:2]).shape == (0, 3, 3)
    bow = np.array([[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0]], dtype=np.float64)
    assert len(triangulate(bow)) <= 2


def test_an_offset_line_keeps_its_distance_at_a_corner() -> None:
    line = np.array([[0, 0, 0], [10, 0, 1], [10, 10, 2]], dtype=np.float64)
    left = offset(line, 2.0)
    assert left == pytest.approx(np.array([[0, 2, 0], [8, 2, 1], [8, 10, 2]]))
    assert offset(line, -2.0)[1] == pytest.approx([12, -2, 1])


def test_dashes_have_their_length_and_gap() -> None:
    line = np.array([[0, 0, 0], [20, 0, 0]], dtype=np.float64)
    ends = [(part[0, 0], part[-1, 0]) for part in dashes(line, 3.0, 2.0)]
    assert ends == [(1.0, 4.0), (6.0, 9.0), (11.0, 14.0), (16.0, 19.0)]
    bent = np.array([[0, 0, 0], [2, 0, 0], [2, 20, 0]], dtype=np.float64)
    assert len(dashes(bent, 3.0, 2.0)[0]) == 3  # the corner stays
