from __future__ import annotations

import pytest

from simbench.render.world.scene import build_scene
from simbench.scenarios.stage import build_stage
from tests.scenarios.stories import story

pytestmark = pytest.mark.sumo


@pytest.mark.parametrize(
    ("motion", "least_behind_m"),
    [
        pytest.param("still", 50.0, id="what a still camera never sees is not built"),
        pytest.param("pan", 500.0, id="a panning camera will see both ways"),
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
    scene = build_scene(build_stage(story(camera=camera, target=along), seed=0))
    ground = scene.ground.positions[:, 0]
    assert ground.max() > 60 + 500
    assert ground.min() < 60 - least_behind_m
    assert (ground.min() > 60 - 200) == (motion == "still")


def test_trees_and_hills_stay_as_the_camera_takes_other_frames() -> None:
    moving = story().camera.model_dump() | {"motion": "follow"}
    green = {"tree_spacing_m": 15, "guard_rails": False}
    scenario = story(camera=moving, surroundings=green, frames=41)
    rate = scenario.imaging.frame_rate_hz
    whole, some, fewer = (
        build_scene(build_stage(told, seed=0))
        for told in (scenario, scenario.retimed(rate, 4), scenario.retimed(rate, 3))
    )
    assert whole.standing.positions.tobytes() == some.standing.positions.tobytes()
    # of 39 frames the camera comes less far, so that only trees far ahead may lack
    shared = len(fewer.standing.positions)
    assert shared > 0.9 * len(whole.standing.positions)
    assert (fewer.standing.positions == whole.standing.positions[:shared]).all()
    assert (whole.distant.positions == fewer.distant.positions).all()
