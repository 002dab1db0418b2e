from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.core.camera import Camera


def _camera(**changes: float) -> Camera:
    settings = {"fov_rad": 2 * np.arctan(0.5), "roll_rad": 0.0} | changes
    return Camera.look_at((0, 0, 5), (10, 0, 5), width=100, height=60, **settings)


def test_target_projects_to_the_image_centre() -> None:
    pixel, depth = _camera().project(np.array([10.0, 0.0, 5.0]))
    assert pixel == pytest.approx([50.0, 30.0])
    assert depth == pytest.approx(10.0)


def test_left_and_up_in_the_road_frame_are_left_and_up_in_the_image() -> None:
    pixel, _ = _camera().project(np.array([10.0, 1.0, 7.0]))
    assert pixel == pytest.approx([40.0, 10.0])  # focal length 100 px


def test_field_of_view_spans_the_image_width() -> None:
    edge, _ = _camera().project(np.array([10.0, 5.0, 5.0]))
    assert edge[0] == pytest.approx(0.0)


def test_points_behind_the_camera_have_nan_pixels_and_negative_depth() -> None:
    pixel, depth = _camera().project(np.array([-3.0, 0.0, 5.0]))
    assert np.isnan(pixel).all()
    assert depth == pytest.approx(-3.0)


def test_camera_looking_straight_down_has_road_x_upwards() -> None:
    camera = Camera.look_at((0, 0, 50), (0, 0, 0), fov_rad=1.0, width=64, height=48)
    ahead, _ = camera.project(np.array([5.0, 0.0, 0.0]))
    left, _ = camera.project(np.array([0.0, 5.0, 0.0]))
    assert ahead[1] < 24 and ahead[0] == pytest.approx(32)
    assert left[0] < 32 and left[1] == pytest.approx(24)


def test_roll_rotates_the_image_about_its_centre() -> None:
    level, _ = _camera().project(np.array([10.0, -2.0, 5.0]))
    rolled, _ = _camera(roll_rad=0.1).project(np.array([10.0, -2.0, 5.0]))
    arm = rolled - [50.0, 30.0]
    assert np.linalg.norm(arm) == pytest.approx(level[0] - 50.0)
    assert abs(np.arctan2(arm[1], arm[0])) == pytest.approx(0.1)


def test_camera_at_its_own_target_is_refused() -> None:
    with pytest.raises(ValueError, match="must differ"):
        Camera.look_at((1, 2, 3), (1, 2, 3), fov_rad=1.0, width=9, height=9)


_coordinates = st.floats(-200, 200)


@given(
    eye=st.tuples(_coordinates, _coordinates, st.floats(1, 60)),
    aim=st.tuples(_coordinates, _coordinates, st.just(0.0)),
    roll=st.floats(-3, 3),
)
def test_pose_is_a_rotation_and_gives_back_the_position(
    eye: tuple[float, float, float], aim: tuple[float, float, float], roll: float
) -> None:
    camera = Camera.look_at(eye, aim, fov_rad=0.7, width=64, height=48, roll_rad=roll)
    assert camera.rotation @ camera.rotation.T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(camera.rotation) == pytest.approx(1.0)
    assert camera.position == pytest.approx(np.array(eye), abs=1e-6)
