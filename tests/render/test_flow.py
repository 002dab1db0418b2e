"""Optical flow: against values computed by hand, and against the next frame."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.flow import Flow, View, forward_flow, sample_offset
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.world.scene import FIRST_VEHICLE_ID, build_scene, vehicle_poses
from simbench.scenarios.stage import Stage, build_stage
from tests.scenarios.small_scenario import small_scenario

HEIGHT, WIDTH = 20, 40
GROUND, CAR = 1, 1000


def camera(x: float = 0.0, *, turn: float = 0.0) -> Camera:
    """Return a camera at (x, 0, 0) that looks along x, with a focal length of 40 px."""
    ahead = (x + np.cos(turn), np.sin(turn), 0.0)
    fov = 2 * np.arctan(0.5)
    return Camera.look_at((x, 0, 0), ahead, fov_rad=fov, width=WIDTH, height=HEIGHT)


def pose(x: float, y: float, heading: float = 0.0) -> NDArray[np.float64]:
    """Return the (1, 4, 4) pose of one vehicle."""
    cos, sin = np.cos(heading), np.sin(heading)
    matrix = np.eye(4)
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:2, 3] = x, y
    return matrix[None]


def view(
    eye: Camera, depth: float, identity: int, place: NDArray[np.float64] | None = None
) -> View:
    """Return a frame of one object at the same depth everywhere."""
    shape = (HEIGHT, WIDTH)
    where = pose(0, 0) if place is None else place
    depths = np.full(shape, depth, np.float32)
    return View(eye, depths, np.full(shape, identity, np.uint16), where)


def flow_between(before: View, after: View) -> Flow:
    return forward_flow(before, after, CAR, 0.5)


def test_static_points_have_no_flow_under_a_static_camera() -> None:
    found = flow_between(view(camera(), 20.0, GROUND), view(camera(), 20.0, GROUND))
    assert not found.flow.any()
    assert not found.invalid.any() and not found.occlusions.any()


def test_a_vehicle_moves_by_its_projected_displacement() -> None:
    # 1 m to the left (y) at 20 m: 40 px * 1 / 20 = 2 px to the left in the image
    before = view(camera(), 20.0, CAR, pose(20, 0))
    found = flow_between(before, view(camera(), 20.0, CAR, pose(20, 1)))
    assert found.flow[..., 0] == pytest.approx(np.full((HEIGHT, WIDTH), -2.0), abs=1e-6)
    assert np.abs(found.flow[..., 1]).max() < 1e-6
    assert found.invalid[:, :2].all() and not found.invalid[:, 2:].any()


def test_an_approaching_camera_expands_the_image_from_its_middle() -> None:
    # From 20 m to 10 m: everything is twice as far from the middle.
    found = flow_between(view(camera(), 20.0, GROUND), view(camera(10), 10.0, GROUND))
    columns = np.arange(WIDTH) + 0.5 - WIDTH / 2
    assert found.flow[0, :, 0] == pytest.approx(columns, abs=1e-5)
    quarter = np.abs(columns) < WIDTH / 4
    assert not found.invalid[HEIGHT // 2, quarter].any()
    assert found.invalid[HEIGHT // 2, ~quarter].all()


def test_a_turning_vehicle_turns_its_points_about_itself() -> None:
    # Half a turn about its middle at 20 m puts what was seen at 19 m to 21 m.
    before = view(camera(), 19.0, CAR, pose(20, 0))
    after = view(camera(), 21.0, CAR, pose(20, 0, np.pi))
    found = flow_between(before, after)
    columns = np.arange(WIDTH) + 0.5 - WIDTH / 2
    expected = -columns * 19 / 21 - columns
    assert found.flow[3, :, 0] == pytest.approx(expected, abs=1e-5)


def test_the_sky_moves_with_the_cameras_turn_alone() -> None:
    before = view(camera(), np.inf, 0)
    driven = flow_between(before, view(camera(50), np.inf, 0))
    assert np.abs(driven.flow).max() < 1e-5
    assert not driven.occlusions.any()
    turned = flow_between(before, view(camera(turn=0.1), np.inf, 0))
    middle = turned.flow[HEIGHT // 2, WIDTH // 2, 0]
    x = np.arctan(0.5 / 40)  # half a pixel right of the axis, which turns to the left
    assert middle == pytest.approx(40 * np.tan(x + 0.1) - 0.5, abs=1e-4)


def test_a_point_without_projection_into_the_next_frame_is_nan_and_invalid() -> None:
    behind = flow_between(view(camera(), 5.0, GROUND), view(camera(10), 5.0, GROUND))
    assert np.isnan(behind.flow).all() and behind.invalid.all()
    gone = pose(np.nan, np.nan)
    left = flow_between(
        view(camera(), 20.0, CAR, pose(20, 0)), view(camera(), 50.0, GROUND, gone)
    )
    assert np.isnan(left.flow).all() and left.invalid.all()
    assert not left.occlusions.any()


@pytest.mark.parametrize(
    ("depth", "identity", "is_hidden"),
    [
        pytest.param(20.0, GROUND, False, id="the same surface"),
        pytest.param(10.0, GROUND, True, id="a nearer surface of the same id"),
        pytest.param(10.0, CAR, True, id="a vehicle in front"),
        pytest.param(30.0, GROUND, False, id="nothing nearer"),
    ],
)
def test_a_nearer_surface_in_the_next_frame_occludes_a_point(
    depth: float, identity: int, is_hidden: bool
) -> None:
    after = view(camera(), depth, identity)
    found = flow_between(view(camera(), 20.0, GROUND), after)
    assert (found.occlusions == is_hidden).all()


def _frames(
    samples: int, **parts: Any
) -> tuple[Stage, list[RenderedFrame], list[View]]:
    parts["imaging"] = {
        "width_px": 240,
        "height_px": 160,
        "samples": samples,
        "noise": 0,
        "blur_px": 0,
    }
    stage = build_stage(small_scenario(**parts), 0)
    middle = slice(samples // 2, None, samples)
    frames, views = [], []
    with SceneRenderer(build_scene(stage), 240, 160, samples) as renderer:
        for index, eye in enumerate(stage.cameras):
            poses, present = vehicle_poses(stage.trajectories, index)
            target = stage.trajectories.target
            frame = renderer.render(eye, poses, present, target, with_depth=True)
            assert frame.depth is not None
            frames.append(frame)
            views.append(View(eye, frame.depth, frame.ids[middle, middle], poses))
    return stage, frames, views


@pytest.mark.gl
def test_a_ball_bouncing_off_a_wall_moves_as_its_middle() -> None:
    _, _, views = _frames(
        1,
        frames=10,
        road={"floor": {"length_m": 6, "width_m": 4, "wall_m": 1.2}},
        target={"ball": {"diameter_m": 1, "along_m": 4.6, "speed_mps": 5, "spread": 0}},
        camera={
            "position": {"along_m": 3, "lateral_m": -6, "height_m": 5},
            "look_at": {"along_m": 4, "lateral_m": 0},
            "fov_rad": 0.8,
        },
    )
    along = [view.poses[0, 0, 3] for view in views]
    turn = int(np.argmax(along[1:])) + 1
    assert 0 < turn < 9 and along[turn + 1] < along[turn]
    for before, after in pairwise(views):
        found = forward_flow(before, after, FIRST_VEHICLE_ID, sample_offset(1))
        is_ball = before.ids == FIRST_VEHICLE_ID
        feet = np.stack([before.poses[0, :3, 3], after.poses[0, :3, 3]])
        pixels, _ = before.camera.project(feet + [0, 0, 0.5])
        moved = np.median(found.flow[is_ball], axis=0)
        # The visible side is nearer than the middle, by a twelfth at most.
        assert moved == pytest.approx(pixels[1] - pixels[0], rel=0.15, abs=0.2)
        assert found.occlusions[is_ball].mean() < 0.1


@pytest.mark.gl
@pytest.mark.sumo
class TestRendered:
    def test_the_rear_of_a_bus_shrinks_towards_the_vanishing_point(self) -> None:
        stage, _, views = _frames(
            3,
            frames=2,
            target={"vehicle_class": "bus", "lane": 0, "along_m": 40, "speed_mps": 15},
        )
        found = forward_flow(views[0], views[1], FIRST_VEHICLE_ID, sample_offset(3))
        target = stage.trajectories.target
        x = stage.trajectories.positions[:, target, 0]
        rear = x - stage.trajectories.vehicles[target].length / 2.0
        flat = views[0].ids == FIRST_VEHICLE_ID + target
        flat &= np.abs(views[0].depth - rear[0]) < 0.04  # plate, window and panel
        assert flat.sum() > 500
        rows, columns = np.nonzero(flat)
        away = np.stack([columns + 0.5 - 120.0, rows + 0.5 - 80.0], axis=-1)
        expected = away * (rear[0] / rear[1] - 1.0)
        assert np.abs(expected).max() > 0.3
        assert found.flow[flat] == pytest.approx(expected, abs=0.01)

    def test_depth_is_that_of_the_road_along_the_ray_of_the_sample(self) -> None:
        _, _, (first, _) = _frames(2, frames=2)
        is_ground = first.ids == GROUND
        rows, columns = np.nonzero(is_ground)
        rays = np.ones((len(rows), 3))
        pixels = np.stack([columns, rows], axis=-1) + sample_offset(2)
        eye = first.camera
        rays[:, :2] = (pixels - eye.matrix[:2, 2]) / eye.focal_px
        down = (rays @ eye.rotation)[:, 2]
        expected = -eye.position[2] / down
        near = (expected > 0.0) & (expected < 60.0)
        found = first.depth[rows, columns]
        # marks lie a few mm above the asphalt, the verge a few cm below it
        close = np.abs(found - expected)[near] / expected[near] < 0.01
        assert near.sum() > 2000
        assert close.mean() > 0.95

    @pytest.mark.parametrize("samples", [1, 2])
    def test_following_the_flow_leads_to_the_same_object_in_the_next_frame(
        self, samples: int
    ) -> None:
        _, frames, views = _frames(
            samples,
            frames=3,
            traffic={"density_per_km_lane": 25, "warm_up_s": 3},
            surroundings={"lamp_spacing_m": 30, "tree_spacing_m": None},
            occluders=[{"along_m": 20, "lateral_m": -9.0, "width_m": 0.5}],
            camera={
                "motion": "follow",
                "position": {"along_m": -30, "lateral_m": -8, "height_m": 7},
                "look_at": {"along_m": 20, "lateral_m": 2, "height_m": 0},
                "fov_rad": 0.8,
                "vibration_px": 3.0,
            },
        )
        place = sample_offset(samples)
        for before, after, frame in zip(views, views[1:], frames[1:], strict=False):
            found = forward_flow(before, after, FIRST_VEHICLE_ID, place)
            known = ~found.invalid & ~found.occlusions
            rows, columns = np.nonzero(known)
            pixels = np.stack([columns, rows], axis=-1) + place
            there = np.floor((pixels + found.flow[known]) * samples).astype(int)
            limit = np.array(frame.ids.shape[::-1]) - 1
            x, y = np.minimum(there, limit).T
            same = frame.ids[y, x] == before.ids[known]
            assert np.abs(found.flow[known]).max() > 3.0
            assert known.mean() > 0.8
            assert 0.0 < found.occlusions.mean() < 0.05
            # The rest is within a pixel of an edge of the object or of its occluder.
            assert same.mean() > 0.97
            one = np.ones((3, 3), np.uint8)
            inner = cv2.erode(before.ids, one) == cv2.dilate(before.ids, one)
            assert inner.mean() > 0.8
            assert same[inner[known]].mean() > 0.99

    def test_the_next_image_warped_back_along_the_flow_looks_the_same(self) -> None:
        # World-fixed grain and marks pass below a camera that drives. What the flow
        # does not explain are edges and, farther off, grain finer than a pixel.
        _, frames, (before, after) = _frames(
            3,
            frames=2,
            camera={
                "motion": "follow",
                "position": {"along_m": -20, "lateral_m": -4, "height_m": 4},
                "look_at": {"along_m": 10, "lateral_m": -4, "height_m": 0},
                "fov_rad": 0.8,
            },
        )
        found = forward_flow(before, after, FIRST_VEHICLE_ID, sample_offset(3))
        known = ~found.invalid & ~found.occlusions & (before.depth < 25.0)
        rows, columns = np.indices(known.shape, dtype=np.float32)
        first, second = (frame.image.astype(np.float32) for frame in frames)
        maps = columns + found.flow[..., 0], rows + found.flow[..., 1]
        back = cv2.remap(second, *maps, cv2.INTER_LINEAR)
        followed = np.median(np.abs(back - first)[known])
        stayed = np.median(np.abs(second - first)[known])
        assert np.median(np.abs(found.flow[known])) > 1.0
        assert followed < 0.35 * stayed
