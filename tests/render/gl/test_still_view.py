"""A camera that stands still: parts drawn anew give the picture of a whole drawing."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.sequence import Truth
from simbench.render.gl.ground_height import GroundHeight
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.gl.still_view import StillView, shadow_ends, windows_around
from simbench.render.truth import TruthRecorder
from simbench.render.world.mesh import merge, triangle_mesh
from simbench.render.world.projection import NEAR_M, clip_matrix, part_of
from simbench.render.world.scene import Scene, build_scene, vehicle_poses
from simbench.scenarios.stage import Stage, build_stage
from tests.scenarios.small_scenario import small_scenario

_CAMERA = Camera(
    np.array([[200.0, 0.0, 80.0], [0.0, 200.0, 60.0], [0.0, 0.0, 1.0]]),
    np.eye(3),  # looks along z
    np.zeros(3),
    160,
    120,
)
_CLIP = clip_matrix(_CAMERA)
_BUSY: dict[str, Any] = {
    "frames": 8,
    "traffic": {"density_per_km_lane": 18, "warm_up_s": 3},
    "surroundings": {"lamp_spacing_m": 30, "tree_spacing_m": 15},
    "camera": {
        "position": {"along_m": 0, "lateral_m": -18, "height_m": 7},
        "look_at": {"along_m": 50, "lateral_m": -4, "height_m": 0},
        "fov_rad": 0.9,
    },
}


def _box(*middle: float, half: float = 1.0) -> NDArray[np.float64]:
    signs = np.indices((2, 2, 2)).reshape(3, 8).T * 2.0 - 1.0
    corners: NDArray[np.float64] = np.array(middle) + half * signs
    return corners


class TestWindows:
    def test_windows_hold_all_that_is_projected(self, rng: np.random.Generator) -> None:
        for _ in range(300):
            middle = rng.uniform([-6, -6, -2], [6, 6, 20])
            points = middle + rng.uniform(-2.0, 2.0, (8, 3))
            window = windows_around(_CLIP, points[None], 320, 240)[0]
            mix = rng.dirichlet(np.ones(8), 500) @ points  # all over the hull
            ahead = mix[mix[:, 2] >= NEAR_M]
            if not len(ahead):
                continue
            pixels, _ = _CAMERA.project(ahead)
            spots = pixels * 2.0  # two samples a pixel
            shown = spots[np.all((spots >= 0) & (spots < [320, 240]), axis=1)]
            assert np.all((shown >= window[:2]) & (shown < window[2:]))

    def test_what_is_behind_the_camera_or_beside_the_picture_has_no_window(
        self,
    ) -> None:
        points = np.stack([_box(0, 0, -5), _box(-90, 0, 10), _box(0, 0, 10)])
        windows = windows_around(_CLIP, points, 160, 120)
        assert windows[:2].tolist() == [[0, 0, 0, 0]] * 2
        assert (windows[2, :2] > 0).all()


def test_a_part_of_the_picture_fills_its_own_clip_space() -> None:
    corners = np.array([[40, 30], [80, 90]])  # pixels, at a depth of 10 m
    points = np.column_stack([(corners - [80, 60]) / 200.0 * 10.0, [10, 10], [1, 1]])
    placed = points @ part_of(_CLIP, (40, 30, 80, 90), 160, 120).T
    assert placed[:, :2] / placed[:, 3:] == pytest.approx(
        np.array([[-1.0, -1.0], [1.0, 1.0]])
    )


class TestChanges:
    def _parts(
        self,
        still: StillView,
        *middles: list[float],
        view: bytes = b"",
        size: tuple[int, int] = (320, 240),
    ) -> list[Any] | None:
        points = np.stack([_box(*middle, half=0.2) for middle in middles])
        poses = np.tile(np.eye(4), (len(middles), 1, 1))
        poses[:, :3, 3] = middles
        windows = windows_around(_CLIP, points, *size)
        return still.changed(view, windows, poses, np.ones(len(middles), np.bool_))

    def test_all_is_drawn_at_first_and_in_another_view(self) -> None:
        still = StillView(2)
        assert self._parts(still, [0, 0, 10]) is None
        assert self._parts(still, [0, 0, 10]) == []
        assert self._parts(still, [0, 0, 10], view=b"other") is None
        still.forget()
        assert self._parts(still, [0, 0, 10], view=b"other") is None

    def test_the_part_holds_the_old_and_the_new_place_of_what_moved(self) -> None:
        still = StillView(2)
        self._parts(still, [-1, 0, 10], [3, 2, 10])
        parts = self._parts(still, [-0.5, 0, 10], [3, 2, 10])
        # From x = -1.2 to -0.3 m at 10 m, y = -0.2 to 0.2: 40 samples a metre.
        assert parts is not None and len(parts) == 1
        left, top, right, bottom = parts[0]
        assert 108 <= left <= 112 and 148 <= right <= 152
        assert 108 <= top <= 112 and 128 <= bottom <= 132
        assert not any(side % 2 for side in parts[0])

    def test_parts_near_each_other_become_one_and_others_do_not(self) -> None:
        still = StillView(2)
        first = [-3.0, -2, 10], [-2.9, -2, 10], [3.0, 2, 10]
        self._parts(still, *first, size=(640, 480))
        second = [-3.0, -1.9, 10], [-2.9, -1.9, 10], [3.0, 1.9, 10]
        parts = self._parts(still, *second, size=(640, 480))
        assert parts is not None and len(parts) == 2


class TestGround:
    def _height(self) -> GroundHeight:
        """A road at 0 m beside a ditch at -2 m from y = 5 to 50 m, on a field."""
        field = np.array([[-500, -500, -1], [500, -500, -1], [0, 900, -1]])
        road = np.array([[-90, 0, 0], [90, 0, 0], [0, 5, 0]])
        ditch = np.array([[-90, 5, 0], [90, 50, -2], [-90, 50, -2]])
        return GroundHeight(
            merge(
                triangle_mesh(one[None].astype(float), (0, 0, 0))
                for one in (field, road, ditch)
            )
        )

    def test_shadows_end_at_the_lowest_ground_that_they_reach(self) -> None:
        ground = self._height()
        middles = np.array([[0.0, -20.0, 0.0], [0.0, 2.0, 0.0], [-400.0, -400.0, 9.0]])
        lowest = ground.below_shadows(middles, np.full(3, 2.0), 1.0)
        # Light at 45 degrees: a body of 2 m casts its shadow 2 m + 3 m + the drop far.
        assert lowest.tolist() == [-1.0, -2.0, -1.0]

    def test_the_height_at_a_place_is_that_of_the_ground_near_by(self) -> None:
        assert self._height().at(np.array([0.0, 0.0, 7.0])) in (-1.0, 0.0)

    def test_shadows_are_cast_from_corners_away_from_the_sun(self) -> None:
        corners = np.array([[[0.0, 0.0, 2.0], [1.0, 0.0, -3.0]]])
        ends = shadow_ends(corners, np.array([0.6, 0.0, 0.8]), np.array([-1.0]))
        assert ends[0, 0] == pytest.approx([-2.25, 0.0, -1.0])
        assert ends[0, 1] == pytest.approx([1.0, 0.0, -3.0])  # below the ground


def _render(
    stage: Stage, scene: Scene, samples: int, *, whole: bool
) -> tuple[list[RenderedFrame], Truth]:
    camera, frames = stage.cameras[0], []
    recorder = TruthRecorder(scene, stage.trajectories, samples)
    with SceneRenderer(scene, camera.width, camera.height, samples) as renderer:
        for index in range(len(stage.cameras)):
            poses, present = vehicle_poses(stage.trajectories, index)
            if whole:
                renderer.forget_last()
            frame = renderer.render(
                stage.cameras[index],
                poses,
                present,
                stage.trajectories.target,
                with_depth=index >= 3,  # as a whole when it is first requested
                gain=1.0 if index < 6 else 1.5,
            )
            silhouette = partial(renderer.silhouette, stage.cameras[index], poses)
            recorder.add(frame, stage.cameras[index], poses, silhouette)
            frames.append(frame)
    return frames, recorder.finish(camera.width, camera.height)


@pytest.fixture(scope="module")
def busy() -> Stage:
    return build_stage(small_scenario(**_BUSY), 0)


@pytest.mark.gl
@pytest.mark.sumo
@pytest.mark.parametrize(
    ("samples", "light"),
    [
        pytest.param(2, {}, id="day"),
        pytest.param(3, {"time": "dusk"}, id="long-shadows"),
        pytest.param(1, {"weather": "fog", "fog_visibility_m": 200}, id="fog"),
        pytest.param(1, {"shadows": False}, id="no-shadows"),
        pytest.param(1, {"time": "night"}, id="lamps"),
    ],
)
def test_parts_drawn_anew_are_bit_identical_to_a_whole_drawing(
    busy: Stage, samples: int, light: dict[str, Any]
) -> None:
    stage = replace(busy, scenario=small_scenario(light=light, **_BUSY))
    scene = build_scene(stage)
    parts, truth = _render(stage, scene, samples, whole=False)
    whole, whole_truth = _render(stage, scene, samples, whole=True)
    for part, expected in zip(parts, whole, strict=True):
        assert np.array_equal(part.ids, expected.ids)
        assert np.array_equal(part.image, expected.image)
        assert np.array_equal(part.target_silhouette, expected.target_silhouette)
        assert (part.depth is None) == (expected.depth is None)
        if part.depth is not None and expected.depth is not None:
            assert np.array_equal(part.depth, expected.depth)
    assert truth.vehicles is not None and whole_truth.vehicles is not None
    pairs = zip(truth.vehicles.masks, whole_truth.vehicles.masks, strict=True)
    for masks, expected_masks in pairs:
        assert masks.keys() == expected_masks.keys()
        for identity, mask in masks.items():
            assert np.array_equal(mask.counts, expected_masks[identity].counts)
    fraction = truth.vehicles.visible_fraction
    expected_fraction = whole_truth.vehicles.visible_fraction
    assert fraction is not None and expected_fraction is not None
    assert np.array_equal(fraction, expected_fraction)
    vehicles = np.unique(parts[0].ids)
    assert np.sum(vehicles >= scene.ids[0]) >= 4
    assert not np.array_equal(parts[0].image, parts[1].image)


@pytest.mark.gl
@pytest.mark.sumo
def test_shadows_of_a_camera_that_moves_and_rests_are_those_of_whole_maps(
    busy: Stage,
) -> None:
    scene, first = build_scene(busy), busy.cameras[0]
    target = busy.trajectories.target
    images: dict[bool, list[NDArray[np.uint8]]] = {True: [], False: []}
    for whole, kept in images.items():
        with SceneRenderer(scene, first.width, first.height, 1) as renderer:
            # as it begins to move, goes on, rests and moves back
            for frame, along_m in enumerate([0, 40, 80, 80, 80, 120, 160, 0]):
                shift = first.rotation @ np.array([along_m, 0.0, 0.0])
                camera = replace(first, translation=first.translation - shift)
                poses, present = vehicle_poses(busy.trajectories, frame)
                if whole:
                    renderer.forget_last()
                kept.append(renderer.render(camera, poses, present, target).image)
    assert all(map(np.array_equal, images[True], images[False]))
    assert not np.array_equal(images[True][0], images[True][-1])  # traffic moved on
