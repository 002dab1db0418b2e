from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage
from tests.scenarios.small_scenario import small_scenario

pytestmark = pytest.mark.sumo


def _stage(scenario: Scenario, seed: int = 0) -> Stage:
    return build_stage(scenario, seed)


def _eyes(stage: Stage) -> np.ndarray:
    return np.stack([camera.position for camera in stage.cameras])


def test_a_still_camera_does_not_move_and_looks_at_look_at() -> None:
    stage = _stage(small_scenario())
    assert np.ptp(_eyes(stage), axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    aim = stage.line.point(40.0, -7.25, 1.5)
    pixel, depth = stage.cameras[0].project(aim)
    assert pixel == pytest.approx([80.0, 60.0])
    assert depth == pytest.approx(40.0)


def test_a_following_camera_keeps_its_gap_up_to_the_sway() -> None:
    camera = {
        "motion": "follow",
        "position": {"along_m": -20, "lateral_m": -5, "height_m": 2},
        "look_at": {"along_m": 5, "lateral_m": -5, "height_m": 1},
        "sway_m": 3,
        "sway_period_s": 4,
    }
    stage = _stage(small_scenario(frames=101, camera=camera))
    target = stage.trajectories.positions[:, stage.trajectories.target, 0]
    gap = target - _eyes(stage)[:, 0]
    assert gap.min() == pytest.approx(17.0, abs=0.05)
    assert gap.max() == pytest.approx(23.0, abs=0.05)


def test_vibration_moves_the_picture_by_the_requested_pixels() -> None:
    camera = small_scenario().camera.model_dump() | {
        "vibration_px": 2.0,
        "vibration_hz": 60,
    }
    stage = _stage(small_scenario(frames=400, camera=camera, target={"speed_mps": 5}))
    aim = stage.line.point(40.0, -7.25, 1.5)
    places = np.stack([camera.project(aim)[0] for camera in stage.cameras])
    # 400 nearly independent samples: the standard error of a spread is 2 / sqrt(800).
    assert places.std(axis=0) == pytest.approx([2.0, 2.0], abs=4 * 2 / 800**0.5)


def test_bursts_confine_the_vibration_to_their_times() -> None:
    camera = small_scenario().camera.model_dump() | {
        "vibration_px": 2.0,
        "vibration_bursts": [{"at_s": 1.0, "lasts_s": 2.0}],
    }
    scenario = small_scenario(frames=125, camera=camera, target={"speed_mps": 5})
    stage, always = _stage(scenario), _stage(_always_shaken(scenario))
    aim = stage.line.point(40.0, -7.25, 1.5)
    places, steady = (
        np.stack([camera.project(aim)[0] for camera in one.cameras])
        for one in (stage, always)
    )
    moved = np.abs(places - [80.0, 60.0]).max(axis=1) > 1e-6
    times = stage.trajectories.times
    assert not moved[(times < 1.0) | (times > 3.0)].any()
    inside = (times >= 1.0) & (times <= 3.0)
    # within a burst the camera moves as if it vibrated all the time
    assert places[inside] == pytest.approx(steady[inside])


def _always_shaken(scenario: Scenario) -> Scenario:
    view = scenario.camera.model_copy(update={"vibration_bursts": ()})
    return scenario.model_copy(update={"camera": view})


def test_a_camera_at_its_own_look_at_is_an_error() -> None:
    place = {"along_m": 0, "lateral_m": 0, "height_m": 3}
    camera = {"position": place, "look_at": place}
    with pytest.raises(ScenarioError, match=r"camera\.look_at must differ"):
        _stage(small_scenario(camera=camera))


def test_an_occluder_on_the_line_of_sight_stands_on_it() -> None:
    occluder = {"kind": "pole", "hides_at_s": 0.04, "distance_m": 12, "width_m": 0.2}
    camera = {
        "position": {"along_m": 0, "lateral_m": -20, "height_m": 5},
        "look_at": {"along_m": 40, "lateral_m": -7, "height_m": 0},
        "fov_rad": 0.6,
    }
    stage = _stage(small_scenario(occluders=[occluder], camera=camera))
    pole = stage.occluders[0]
    eye = stage.cameras[1].position
    body = stage.trajectories.positions[1, stage.trajectories.target]
    body = body + [0.0, 0.0, 0.73]
    assert np.linalg.norm(pole.base[:2] - eye[:2]) == pytest.approx(12.0, abs=1e-3)
    sight = eye + (body - eye) * 12.0 / np.linalg.norm((body - eye)[:2])
    assert pole.base[:2] == pytest.approx(sight[:2], abs=1e-3)
    assert pole.sight_height == pytest.approx(sight[2] - pole.base[2], abs=1e-6)


@pytest.mark.parametrize(
    ("occluder", "words"),
    [
        pytest.param(
            {"hides_at_s": 5, "distance_m": 9}, r"hides_at_s.*last frame", id="too late"
        ),
        pytest.param(
            {"hides_at_s": 0, "distance_m": 90}, r"distance_m.*less than", id="too far"
        ),
    ],
)
def test_an_occluder_that_cannot_hide_is_an_error(
    occluder: dict[str, float], words: str
) -> None:
    with pytest.raises(ScenarioError, match=words):
        _stage(small_scenario(occluders=[occluder]))


def _seen_target(stage: Stage) -> np.ndarray:
    target = stage.trajectories.positions[:, stage.trajectories.target]
    pairs = zip(stage.cameras, target, strict=True)
    return np.stack([camera.project(place)[0] for camera, place in pairs])


def test_a_panning_camera_does_not_move_and_keeps_the_target_in_the_middle() -> None:
    camera = {
        "motion": "pan",
        "position": {"along_m": 60, "lateral_m": -30, "height_m": 5},
        "look_at": {"along_m": 0, "lateral_m": -7.25, "height_m": 0},
    }
    stage = _stage(small_scenario(frames=50, camera=camera))
    assert np.ptp(_eyes(stage), axis=0) == pytest.approx([0, 0, 0], abs=1e-9)
    # two lanes of 3.5 m: lane 0 lies at 1.5 + 0.5 + 1.5 * 3.5 m from the middle
    middle = np.tile([80.0, 60.0], (50, 1))
    assert _seen_target(stage) == pytest.approx(middle, abs=1e-6)


def test_a_driving_camera_keeps_its_own_speed() -> None:
    camera = {"motion": "drive", "speed_mps": 25}
    eyes = _eyes(_stage(small_scenario(frames=26, camera=camera)))
    assert np.diff(eyes[:, 0]) == pytest.approx(np.full(25, 1.0))  # 25 m/s * 0.04 s
    assert np.ptp(eyes[:, 1:], axis=0) == pytest.approx([0, 0], abs=1e-9)


@pytest.mark.parametrize(
    "camera",
    [
        pytest.param({"motion": "drive"}, id="no speed to drive at"),
        pytest.param({"motion": "pan", "speed_mps": 20}, id="a speed while panning"),
    ],
)
def test_only_a_driving_camera_has_a_speed(camera: dict[str, object]) -> None:
    with pytest.raises(
        ValidationError, match="motion: drive, and no other, needs speed_mps"
    ):
        small_scenario(camera=camera)


def test_a_wandering_aim_moves_the_picture_on_an_ellipse() -> None:
    camera = {
        "motion": "pan",
        "position": {"along_m": 60, "lateral_m": -30, "height_m": 5},
        "look_at": {"along_m": 0, "lateral_m": -7.25, "height_m": 0},
        "fov_rad": 0.2,
        "wander_px": 40,
        "wander_shape": 0.5,
        "wander_period_s": 2,
    }
    off = _seen_target(_stage(small_scenario(frames=51, camera=camera))) - [80.0, 60.0]
    # 50 frames a period; the small-angle error of 40 px at a focal length of 797 px
    # is below 40 * (40 / 797)**2 / 2 = 0.05 px
    assert np.hypot(off[:, 0], off[:, 1] / 0.5) == pytest.approx(np.full(51, 40), 0.01)
    assert off[50] == pytest.approx(off[0], abs=1e-6)


def test_the_phase_of_the_wander_differs_by_seed() -> None:
    camera = small_scenario().camera.model_dump() | {"wander_px": 40.0}
    one, other = (
        _stage(small_scenario(camera=camera), seed).cameras[0] for seed in (0, 1)
    )
    assert not np.allclose(one.rotation, other.rotation)


def test_a_shortened_or_resampled_scenario_has_the_same_camera() -> None:
    shaky = {"wander_px": 40.0, "vibration_px": 2.0, "motion": "follow"}
    scenario = small_scenario(
        camera=small_scenario().camera.model_dump() | shaky, frames=9
    )
    whole = _stage(scenario).cameras
    cut = _stage(scenario.shortened(4)).cameras
    for one, other in zip(cut, whole, strict=False):
        assert one.rotation.tobytes() == other.rotation.tobytes()
    half = _stage(scenario.with_frame_rate(scenario.imaging.frame_rate_hz, 2)).cameras
    assert half[0].rotation.tobytes() == whole[0].rotation.tobytes()
