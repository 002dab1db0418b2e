from __future__ import annotations

import pytest

from simbench.render.world.scene import build_scene
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
