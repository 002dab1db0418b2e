from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.render.world.road_surface import highway_ground
from simbench.render.world.scene import build_scene
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Road
from simbench.scenarios.stage import build_stage
from tests.scenarios.small_scenario import small_scenario

pytestmark = pytest.mark.sumo


@pytest.mark.parametrize(
    ("motion", "least_behind_m"),
    [
        pytest.param("still", 50.0, id="a still camera: only what it sees"),
        pytest.param("pan", 500.0, id="a panning camera: both ways"),
    ],
)
def test_the_road_reaches_as_far_as_the_camera_will_see(
    motion: str, least_behind_m: float
) -> None:
    camera = {
        "motion": motion,
        "position": {"along_m": 60, "lateral_m": -20, "height_m": 5},
        "look_at": {"along_m": 100 if motion == "still" else 0, "lateral_m": -7},
    }
    along = {"along_m": 80, "speed_mps": 15}  # ahead of the camera from the first frame
    scene = build_scene(
        build_stage(small_scenario(camera=camera, target=along), seed=0)
    )
    ground = scene.ground.positions[:, 0]
    assert ground.max() > 60 + 500
    assert ground.min() < 60 - least_behind_m
    assert (ground.min() > 60 - 200) == (motion == "still")


def test_trees_and_hills_do_not_depend_on_the_number_of_frames() -> None:
    moving = small_scenario().camera.model_dump() | {"motion": "follow"}
    green = {"tree_spacing_m": 15, "guard_rails": False}
    scenario = small_scenario(camera=moving, surroundings=green, frames=41)
    rate = scenario.imaging.frame_rate_hz
    whole, some, fewer = (
        build_scene(build_stage(variant, seed=0))
        for variant in (
            scenario,
            scenario.with_frame_rate(rate, 4),
            scenario.with_frame_rate(rate, 3),
        )
    )
    assert (
        whole.static_objects.positions.tobytes()
        == some.static_objects.positions.tobytes()
    )
    # with 39 frames the camera path is shorter: only trees far ahead may be missing
    shared = len(fewer.static_objects.positions)
    assert shared > 0.9 * len(whole.static_objects.positions)
    assert (
        fewer.static_objects.positions == whole.static_objects.positions[:shared]
    ).all()
    assert (whole.distant.positions == fewer.distant.positions).all()


def _corners_at(line: RoadLine, lateral_m: float) -> NDArray[np.float64]:
    """Return arc length and lateral position, (N, 2) m, of the ground's corners there.

    In the order of their arc length; corners of several triangles may be repeated.
    """
    ground = highway_ground(line, -100.0, 400.0, "summer")
    located = line.locate(np.unique(ground.positions.astype(np.float64), axis=0))
    there = located[np.abs(located[:, 1] - lateral_m) < 0.03]
    return there[np.argsort(there[:, 0])]


@pytest.fixture
def bend() -> RoadLine:
    sections = [{"length_m": 300.0, "curve_radius_m": 800.0}]
    return RoadLine.from_road(Road.model_validate({"lanes": 2, "sections": sections}))


def test_the_ground_of_a_bend_follows_the_line_to_a_centimetre(bend: RoadLine) -> None:
    # the inner line of the carriageway: a band's edge, without dashes
    lateral = float(bend.lane_lateral(2)) + bend.road.lane_width_m / 2.0
    along = _corners_at(bend, lateral)[:, 0]
    along = along[np.diff(along, append=np.inf) > 0.01]  # each node once
    chords, turns = np.diff(along), np.abs(np.diff(bend.heading_at(along)))
    assert (chords * turns / 8.0).max() < 0.0125  # sagitta of an arc
    assert chords.max() > 15.0  # where it is straight
    assert 7.0 < np.median(chords[turns > 0.008]) < 9.0  # of a radius of 800 m


def test_dashes_leave_no_gap_to_the_asphalt_beside_them(bend: RoadLine) -> None:
    low, high = bend.lane_lateral([0, 1])
    edge = float(low + high) / 2.0 - 0.075  # of the dashes, and of the lane beside them
    corners = _corners_at(bend, edge)
    points = bend.point(*corners.T)[:, :2]
    nodes = _corners_at(bend, float(bend.lane_lateral(2)) + 1.75)[:, 0]
    is_node = np.abs(corners[:, :1] - nodes).min(axis=1) < 0.05
    assert is_node.sum() > 20
    assert (~is_node).sum() > 20
    chosen = np.flatnonzero(is_node)
    after = np.searchsorted(chosen, np.flatnonzero(~is_node))
    first, last = points[chosen[after - 1]], points[chosen[after]]
    way = (last - first) / np.linalg.norm(last - first, axis=1, keepdims=True)
    x, y = (points[~is_node] - first).T
    assert np.abs(way[:, 0] * y - way[:, 1] * x).max() < 1e-3
