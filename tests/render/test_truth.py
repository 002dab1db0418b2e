from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from simbench.core.camera import Camera
from simbench.core.sequence import Truth
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.instance_ids import pixel_ids
from simbench.render.truth import TruthRecorder
from simbench.render.world.scene import Scene, build_scene, vehicle_poses
from simbench.scenarios.stage import Stage, build_stage
from tests.scenarios.small_scenario import small_scenario


@dataclass(frozen=True)
class Rendered:
    stage: Stage
    scene: Scene
    frames: list[RenderedFrame]
    truth: Truth


def _render(*, samples: int = 2, with_depth: bool = False, **parts: Any) -> Rendered:
    stage = build_stage(small_scenario(**parts), 0)
    scene = build_scene(stage)
    width, height = stage.cameras[0].width, stage.cameras[0].height
    recorder = TruthRecorder(scene, stage.trajectories, samples)
    frames = []
    with SceneRenderer(scene, width, height, samples) as renderer:
        for index, camera in enumerate(stage.cameras):
            poses, present = vehicle_poses(stage.trajectories, index)
            target = stage.trajectories.target
            frame = renderer.render(
                camera, poses, present, target, with_depth=with_depth
            )
            recorder.add(
                frame, camera, poses, partial(renderer.silhouette, camera, poses)
            )
            frames.append(frame)
    return Rendered(stage, scene, frames, recorder.finish(width, height))


_BUSY: dict[str, Any] = {
    "frames": 2,
    "traffic": {"density_per_km_lane": 20, "warm_up_s": 3},
    "surroundings": {"lamp_spacing_m": 30, "gantry_spacing_m": 80},
    "camera": {
        "position": {"along_m": 0, "lateral_m": -18, "height_m": 7},
        "look_at": {"along_m": 50, "lateral_m": -4, "height_m": 0},
        "fov_rad": 0.8,
    },
}


@pytest.mark.gl
@pytest.mark.sumo
class TestRendered:
    @pytest.mark.parametrize("samples", [1, 2, 3])
    def test_an_unoccluded_target_is_visible_exactly(self, samples: int) -> None:
        truth = _render(samples=samples).truth
        assert truth.visible_fraction.tolist() == [1.0, 1.0, 1.0]
        assert truth.occluders == ("", "", "")

    def test_a_pole_hides_the_share_that_geometry_predicts(self) -> None:
        # A pole 0.3 m wide, 20 m ahead on the optical axis, covers the columns within
        # focal * 0.15 / 20 of the middle, over the whole height of the target.
        place = {"along_m": 0, "lateral_m": -7.25, "height_m": 2.0}
        aim = {"along_m": 100, "lateral_m": -7.25, "height_m": 2.0}
        rendered = _render(
            frames=2,
            imaging={"width_px": 640, "height_px": 480},
            camera={"position": place, "look_at": aim, "fov_rad": 0.12},
            target={"vehicle_class": "bus", "lane": 0, "along_m": 60, "speed_mps": 0.1},
            occluders=[{"along_m": 20, "lateral_m": -7.25, "width_m": 0.3}],
        )
        alone = rendered.frames[0].target_silhouette
        columns = (np.arange(alone.shape[1]) + 0.5) / 2.0
        behind = (
            np.abs(columns - 320.0) < rendered.stage.cameras[0].focal_px * 0.15 / 20
        )
        expected = alone[:, behind].sum() / alone.sum()
        hidden = 1.0 - rendered.truth.visible_fraction[0]
        # One column of samples on each side of 270, and half a per cent of polygon.
        assert hidden == pytest.approx(expected, abs=0.01)
        assert 0.2 < expected < 0.4
        assert rendered.truth.occluders[0] == "pole"

    @pytest.mark.parametrize("samples", [1, 2])
    def test_box_edges_agree_with_the_mask_within_a_pixel(self, samples: int) -> None:
        rendered = _render(samples=samples)
        truth = rendered.truth
        assert truth.visible_boxes == pytest.approx(truth.boxes, abs=1.0)
        vehicles = truth.vehicles
        assert vehicles is not None
        mask = vehicles.masks[0][int(vehicles.ids[0])].to_array()
        rows, columns = np.nonzero(mask)
        left, top, width, height = truth.boxes[0]
        edges = [left, top, left + width, top + height]
        seen = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        assert seen == pytest.approx(edges, abs=1.0)

    @pytest.mark.parametrize("samples", [1, 2, 3, 4])
    def test_ids_survive_anti_aliasing(self, samples: int) -> None:
        rendered = _render(samples=samples, **_BUSY)
        known = set(rendered.scene.labels) | set(rendered.scene.ids.tolist())
        for frame in rendered.frames:
            assert set(np.unique(frame.ids).tolist()) <= known
            assert set(np.unique(pixel_ids(frame.ids, samples)).tolist()) <= known
        vehicles = rendered.truth.vehicles
        assert vehicles is not None
        assert np.sum(vehicles.visible_px[0] > 0) >= 4

    def test_every_visible_vehicle_lies_in_its_amodal_box(self) -> None:
        vehicles = _render(**_BUSY).truth.vehicles
        assert vehicles is not None
        seen = ~np.isnan(vehicles.visible_boxes[..., 0])
        inner, outer = vehicles.visible_boxes[seen], vehicles.boxes[seen]
        boxed = ~np.isnan(outer[:, 0])
        assert boxed.sum() >= 8
        low = inner[boxed, :2] - outer[boxed, :2]
        high = (outer[:, :2] + outer[:, 2:] - inner[:, :2] - inner[:, 2:])[boxed]
        assert low.min() > -0.51 and high.min() > -0.51  # half a pixel a sample

    def test_masks_are_the_pixels_of_the_ids(self) -> None:
        rendered = _render(**_BUSY)
        vehicles = rendered.truth.vehicles
        assert vehicles is not None
        for frame, masks in zip(rendered.frames, vehicles.masks, strict=True):
            pixels = pixel_ids(frame.ids, 2)
            assert masks
            for identity, mask in masks.items():
                assert np.array_equal(mask.to_array(), pixels == identity)

    def test_every_vehicle_has_the_visible_fraction_it_would_have_as_the_target(
        self,
    ) -> None:
        # Rendered with those whose boxes do not overlap, or alone as the target.
        rendered = _render(**_BUSY)
        vehicles = rendered.truth.vehicles
        assert vehicles is not None and vehicles.visible_fraction is not None
        stage, scene = rendered.stage, rendered.scene
        poses, present = vehicle_poses(stage.trajectories, 0)
        camera, ids = stage.cameras[0], rendered.frames[0].ids
        hidden = 0
        with SceneRenderer(scene, camera.width, camera.height, 2) as renderer:
            renderer.render(camera, poses, present, 0)  # sets the levels of detail
            for column, identity in enumerate(vehicles.ids.tolist()):
                found = vehicles.visible_fraction[0, column]
                if not present[identity - scene.ids[0]]:
                    assert found == 0.0
                    continue
                which = np.array([identity - scene.ids[0]])
                alone = renderer.silhouette(camera, poses, which)
                seen = np.count_nonzero(ids == identity)
                assert found == (seen / alone.sum() if seen else 0.0)
                hidden += 0.0 < found < 1.0
        assert hidden >= 2
        target = [v.name for v in vehicles.vehicles].index("target")
        shares = vehicles.visible_fraction[:, target]
        assert (shares == rendered.truth.visible_fraction).all()

    def test_silhouettes_in_windows_are_parts_of_those_in_the_whole_picture(
        self,
    ) -> None:
        rendered = _render(**_BUSY)
        stage, scene, frame = rendered.stage, rendered.scene, rendered.frames[0]
        poses, present = vehicle_poses(stage.trajectories, 0)
        camera = stage.cameras[0]
        height, width = frame.ids.shape
        crossing = poses.copy()  # one vehicle stands across the camera's plane
        crossing[0] = np.eye(4)
        crossing[0, :3, 3] = camera.position - [0.0, 0.0, 1.0]
        with SceneRenderer(scene, camera.width, camera.height, 2) as renderer:
            renderer.render(camera, poses, present, 0)  # sets the levels of detail
            for index in np.flatnonzero(present):
                for places in (poses, crossing):
                    which = np.array([index])
                    whole = renderer.silhouette(
                        camera, places, which, (0, 0, width, height)
                    )
                    found = renderer.silhouette(camera, places, which)
                    assert np.array_equal(found, whole)
                    part = renderer.silhouette(camera, places, which, (20, 10, 90, 70))
                    assert np.array_equal(part[10:70, 20:90], whole[10:70, 20:90])
                    part[10:70, 20:90] = False
                    assert not part.any()
            all_ids = renderer.render_ids(camera, poses, present)
        assert np.array_equal(all_ids, frame.ids)
        outside = frame.target_silhouette.copy()
        outside[frame.target_window] = False
        assert frame.target_silhouette.any()
        assert not outside.any()

    def test_depth_is_the_distance_along_the_axis(self) -> None:
        rendered = _render(with_depth=True, frames=2)
        depth = rendered.frames[0].depth
        assert depth is not None and depth.shape == (120, 160)
        vehicles = rendered.truth.vehicles
        assert vehicles is not None
        rear = 40 - 4.5 / 2
        mask = vehicles.masks[0][int(vehicles.ids[0])].to_array()
        assert depth[mask].min() == pytest.approx(rear, abs=0.05)
        # The road under the camera's look: height 1.5 m, 50 px below the horizon.
        focal = rendered.stage.cameras[0].focal_px
        assert depth[115, 10] == pytest.approx(1.5 * focal / 55.5, rel=0.02)
        assert np.isinf(depth[0, 0])

    def test_a_target_at_the_border_is_cut_and_then_absent(self) -> None:
        camera = {
            "position": {"along_m": 40, "lateral_m": -40, "height_m": 3},
            "look_at": {"along_m": 40, "lateral_m": -7, "height_m": 1},
            "fov_rad": 0.3,
        }
        target = {"lane": 0, "along_m": 40, "speed_mps": 30}
        truth = _render(frames=10, camera=camera, target=target).truth
        assert not truth.cut_by_image[0] and not truth.absent[0]
        assert truth.cut_by_image.any()
        assert truth.absent[-1]
        assert np.isnan(truth.boxes[-1]).all()
        assert truth.visible_fraction[-1] == 0.0
        assert not truth.cut_by_image[-1]

    def test_a_target_across_the_cameras_plane_is_present_and_has_a_box(self) -> None:
        # 2.4 m behind the middle of a bus 12 m long: the camera is inside it.
        camera = {
            "position": {"along_m": 37.6, "lateral_m": -7.25, "height_m": 1.5},
            "look_at": {"along_m": 60, "lateral_m": -7.25, "height_m": 1.5},
            "fov_rad": 0.9,
        }
        target = {"vehicle_class": "bus", "lane": 0, "along_m": 40, "speed_mps": 1}
        truth = _render(camera=camera, target=target).truth
        assert not truth.absent.any()
        assert truth.cut_by_image.all()
        assert np.isfinite(truth.boxes).all()
        assert truth.boxes[0, 2] > 160 and truth.boxes[0, 3] > 120

    def test_displacement_is_the_move_of_the_box_centre(self) -> None:
        truth = _render().truth
        middle = truth.boxes[:, :2] + truth.boxes[:, 2:] / 2
        assert np.isnan(truth.displacement_px[0])
        assert truth.displacement_px[1] == pytest.approx(
            np.hypot(*(middle[1] - middle[0]))
        )

    def test_a_vehicle_in_front_is_named_as_the_occluder(self) -> None:
        truth = _render(
            strangers=[
                {
                    "vehicle_class": "van",
                    "lane": 0,
                    "ahead_m": -16,
                    "speed_mps": 15,
                }
            ]
        ).truth
        assert truth.occluders[0] == "vehicle"
        assert truth.visible_fraction[0] < 0.3


@given(
    ids=arrays(np.uint16, (6, 8), elements=st.integers(0, 3)),
    samples=st.sampled_from([1, 2]),
)
def test_pixel_ids_never_invent_an_id(ids: np.ndarray, samples: int) -> None:
    chosen = pixel_ids(ids, samples)
    assert chosen.shape == (6 // samples, 8 // samples)
    for row in range(chosen.shape[0]):
        for column in range(chosen.shape[1]):
            block = ids[
                row * samples : (row + 1) * samples,
                column * samples : (column + 1) * samples,
            ]
            counts = np.bincount(block.ravel(), minlength=4)
            assert counts[chosen[row, column]] == counts.max()


def test_a_point_projects_to_the_pixel_computed_by_hand() -> None:
    camera = Camera.look_at(
        (0, 0, 0), (10, 0, 0), fov_rad=2 * np.arctan(0.5), width=100, height=50
    )
    pixel, depth = camera.project(np.array([10.0, 1.0, 2.0]))  # 1 m left, 2 m up
    assert pixel == pytest.approx([50 - 10, 25 - 20])  # focal length 100 px
    assert depth == pytest.approx(10.0)
