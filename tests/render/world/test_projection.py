"""Windows of a picture around what is projected into it."""

from __future__ import annotations

import numpy as np

from simbench.core.camera import Camera
from simbench.render.world.projection import NEAR_M, clip_matrix, covering_window

_MATRIX = np.array([[200.0, 0.0, 80.0], [0.0, 200.0, 60.0], [0.0, 0.0, 1.0]])
_CAMERA = Camera(_MATRIX, np.eye(3), np.zeros(3), 160, 120)  # looks along z
_CLIP = clip_matrix(_CAMERA)


def test_a_window_holds_all_projected_points(rng: np.random.Generator) -> None:
    for _ in range(200):
        middle = rng.uniform([-6, -6, 1], [6, 6, 30])
        points = middle + rng.uniform(-0.5, 0.5, (8, 3))
        left, top, right, bottom = covering_window(_CLIP, points, 320, 240)
        pixels, _ = _CAMERA.project(points)
        spots = pixels * 2.0  # two samples a pixel
        inside = np.all((spots >= 0) & (spots < [320, 240]), axis=1)
        assert 0 <= left <= right <= 320
        assert 0 <= top <= bottom <= 240
        shown = spots[inside]
        assert np.all((shown >= [left, top]) & (shown < [right, bottom]))


def test_a_window_is_tight() -> None:
    points = np.array([[-0.99, -0.99, 10.0], [0.99, 0.99, 10.0]])
    # pixels 60.2 to 99.8 and 40.2 to 79.8
    assert covering_window(_CLIP, points, 160, 120) == (59, 39, 101, 81)


def test_points_before_the_near_plane_may_cover_the_whole_picture() -> None:
    points = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, NEAR_M / 2]])
    assert covering_window(_CLIP, points, 160, 120) == (0, 0, 160, 120)


def test_a_window_is_empty_where_nothing_is_shown() -> None:
    for points in (np.zeros((0, 3)), np.array([[-90.0, 0.0, 10.0]])):
        left, top, right, bottom = covering_window(_CLIP, points, 160, 120)
        assert left >= right or top >= bottom
