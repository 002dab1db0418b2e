"""Scenes other than a highway: a floor with balls, a SUMO network."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simbench.core.errors import RenderError
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.world.scene import Scene, build_scene, vehicle_poses
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage
from tests.scenarios.network.test_network import crossing
from tests.scenarios.small_scenario import small_scenario

pytestmark = [pytest.mark.gl, pytest.mark.sumo]


def _render_first_frame(scenario: Scenario) -> tuple[Stage, Scene, RenderedFrame]:
    stage = build_stage(scenario, 0)
    scene = build_scene(stage)
    camera = stage.cameras[0]
    with SceneRenderer(scene, camera.width, camera.height, 1) as renderer:
        poses, present = vehicle_poses(stage.trajectories, 0)
        frame = renderer.render(camera, poses, present, stage.trajectories.target)
    return stage, scene, frame


def _seen(stage: Stage, frame: RenderedFrame, point: Any) -> NDArray[np.uint8]:
    """Return the colour of the pixel that shows a point of the road frame."""
    (x, y), _ = stage.cameras[0].project(np.asarray(point, np.float64))
    pixel: NDArray[np.uint8] = frame.image[int(y), int(x)]
    return pixel


def _floor(ball: dict[str, Any], **floor: Any) -> Scenario:
    return small_scenario(
        road={"floor": {"length_m": 6, "width_m": 4} | floor},
        target={"ball": {"along_m": 3, "speed_mps": 0, "spread": 0} | ball},
        light={"sun_azimuth_rad": 0.0},
        camera={
            "position": {"along_m": 3, "lateral_m": 0, "height_m": 9},
            "look_at": {"along_m": 3.001, "lateral_m": 0},
            "fov_rad": 0.9,
        },
    )


def test_a_ball_is_as_large_in_the_picture_as_geometry_says() -> None:
    stage, scene, frame = _render_first_frame(_floor({"diameter_m": 1.0}))
    columns = np.flatnonzero((frame.ids == scene.ids[0]).any(axis=0))
    # A sphere of radius r whose middle is d away covers 2 f r / sqrt(d^2 - r^2).
    wide = 2 * stage.cameras[0].focal_px * 0.5 / np.sqrt(8.5**2 - 0.5**2)
    assert np.ptp(columns) + 1 == pytest.approx(wide, abs=1.5)


def test_a_flying_ball_casts_its_shadow_away_from_the_sun() -> None:
    # The sun is 0.75 rad high: a ball 2 m up casts its shadow 2 / tan(0.75) away.
    stage, _, frame = _render_first_frame(_floor({"height_m": 2.0, "diameter_m": 0.5}))
    there = 3 - (2.0 + 0.25) / np.tan(0.75)
    shade = _seen(stage, frame, [there, 0.0, 0.0]).astype(int)
    light = _seen(stage, frame, [there, 1.2, 0.0]).astype(int)
    assert shade.sum() < 0.75 * light.sum()


@pytest.mark.parametrize("pattern", ["tiles", "boards", "plain"])
def test_a_floor_has_its_pattern_and_covers_all_of_its_area(pattern: str) -> None:
    scene = build_scene(build_stage(_floor({}, pattern=pattern, wall_m=0), 0))
    corners = scene.ground.positions.reshape(-1, 3, 3).astype(np.float64)
    middle = corners.mean(axis=1)
    inside = (middle[:, 0] > 0) & (middle[:, 0] < 6) & (np.abs(middle[:, 1]) < 2)
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(np.cross(first, second)[:, 2]) / 2
    assert area[inside].sum() == pytest.approx(24.0, rel=1e-5)
    assert (inside.sum() == 2) == (pattern == "plain")


def test_walls_surround_the_floor_and_hide_the_ground_behind() -> None:
    _, scene, frame = _render_first_frame(_floor({}, wall_m=0.5))
    wall = next(number for number, name in scene.labels.items() if name == "wall")
    assert (frame.ids == wall).sum() > 50
    assert not len(
        build_scene(build_stage(_floor({}, wall_m=0), 0)).static_objects.positions
    )


def _crossing_from_above(x_m: float, y_m: float) -> Scenario:
    camera = {
        "position": {"x_m": x_m, "y_m": y_m, "height_m": 40},
        "look_at": {"x_m": x_m + 0.01, "y_m": y_m},
        "fov_rad": 0.6,
    }
    imaging = {"width_px": 640, "height_px": 480}
    return crossing(frames=2, camera=camera, imaging=imaging)


def test_lanes_are_grey_and_the_ground_beside_them_is_green() -> None:
    stage, _, frame = _render_first_frame(_crossing_from_above(250, 212))
    origin = np.array(stage.line.map_origin)
    red, green, blue = _seen(stage, frame, [250, 212, 0] - origin).astype(int)
    assert max(red, green, blue) - min(red, green, blue) < 25
    red, green, blue = _seen(stage, frame, [250, 204, 0] - origin).astype(int)
    assert green > blue + 25


def test_markings_are_solid_at_the_edges_and_dashed_between_lanes() -> None:
    stage, _, frame = _render_first_frame(_crossing_from_above(262, 212))
    origin = np.array(stage.line.map_origin)
    along = np.arange(253, 271, 0.25)

    def brightness(y: float) -> NDArray[np.float64]:
        points = np.stack([along, np.full(len(along), y), np.zeros(len(along))], axis=1)
        return np.array([_seen(stage, frame, one - origin).mean() for one in points])

    solid, between, asphalt = (brightness(y) for y in (210.475, 213.6, 212.0))
    assert np.mean(solid > asphalt.mean() + 15) > 0.9
    assert 0.15 < np.mean(between > asphalt.mean() + 15) < 0.6


def test_trees_are_off_the_roads_and_the_line_of_sight() -> None:
    surroundings = {"tree_spacing_m": 8, "tree_lateral_m": 6}
    stage, scene, frame = _render_first_frame(
        crossing(frames=2, surroundings=surroundings)
    )
    assert stage.network is not None
    tree = next(number for number, name in scene.labels.items() if name == "tree")
    corners = scene.static_objects.positions[scene.static_objects.surface[:, 0] == tree]
    feet = corners[corners[:, 2] < 0.0, :2]
    lanes = [lane.shape for lane in stage.network.lanes.values()]
    roads = np.concatenate(
        [np.linspace(a, b, 50)[:, :2] for one in lanes for a, b in pairwise(one)]
    )
    apart = cKDTree(roads - stage.line.map_origin[:2]).query(feet)[0]
    assert len(feet) > 500 and apart.min() > 3.0
    assert not np.any(frame.ids[frame.target_silhouette] == tree)


def test_a_network_without_a_road_near_by_is_an_error() -> None:
    stage = build_stage(crossing(frames=2), 0)
    far = replace(stage.line, map_origin=(1e5, 0.0, 0.0))
    with pytest.raises(RenderError, match="a road within 700 m of the target"):
        build_scene(replace(stage, line=far))
