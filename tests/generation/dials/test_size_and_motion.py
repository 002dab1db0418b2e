"""Solver of the target's size and displacement."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.core.box import centers
from simbench.core.errors import ScenarioError
from simbench.generation.dials.probe import target_boxes
from simbench.generation.dials.size_and_motion import solve_size_and_motion
from simbench.scenarios.achieved_dials import apply_direct_dials
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import build_stage
from tests.generation.dials.roadside import roadside

pytestmark = pytest.mark.sumo


def _shown(scenario: Scenario) -> tuple[float, float]:
    boxes = target_boxes(build_stage(scenario, 0))
    moves = np.linalg.norm(np.diff(centers(boxes), axis=0), axis=-1)
    return float(np.nanmedian(moves)), float(np.nanmedian(boxes[:, 3]))


@pytest.mark.parametrize("requested_px", [1.5, 8.0, 15.0])
def test_displacement_is_reached_and_the_time_span_stays(requested_px: float) -> None:
    scenario = roadside()
    solved = solve_size_and_motion(
        scenario.with_dials({"displacement_px": requested_px}), 0, 0
    )
    assert _shown(solved)[0] == pytest.approx(requested_px, rel=0.1)
    assert solved.duration_s <= scenario.duration_s + 1e-9
    assert solved.duration_s > scenario.duration_s - solved.imaging.interval_s - 1e-9


def test_a_large_displacement_drops_frames_a_small_one_adds_some() -> None:
    scenario = roadside()
    large = solve_size_and_motion(scenario.with_dials({"displacement_px": 9}), 0, 0)
    small = solve_size_and_motion(scenario.with_dials({"displacement_px": 1}), 0, 0)
    assert large.imaging.keep_every > 1
    assert large.imaging.frame_rate_hz == 25
    assert large.frames < 40 < small.frames


@pytest.mark.parametrize("requested_px", [4.0, 14.0])
def test_where_the_aim_wanders_the_rate_corrects_what_the_stride_leaves(
    requested_px: float,
) -> None:
    wandering = {"motion": "follow", "wander_px": 30, "wander_period_s": 1.2}
    scenario = roadside(camera=roadside().camera.model_dump() | wandering)
    solved = solve_size_and_motion(
        scenario.with_dials({"displacement_px": requested_px}), 0, 0
    )
    moves, height = _shown(solved)
    assert moves == pytest.approx(requested_px, rel=0.1)
    assert height == pytest.approx(_shown(scenario)[1], rel=0.3)


def test_size_and_displacement_are_reached_together() -> None:
    requested = roadside().with_dials({"target_px": 16, "displacement_px": 10})
    moves, height = _shown(solve_size_and_motion(requested, 0, 0))
    assert moves == pytest.approx(10, rel=0.1)
    assert height == pytest.approx(16, rel=0.1)


def test_a_dial_that_is_reached_already_changes_nothing() -> None:
    scenario = roadside()
    moves, height = _shown(scenario)
    requested = scenario.with_dials({"target_px": height, "displacement_px": moves})
    assert solve_size_and_motion(requested, 0, 0) is requested


def test_at_a_held_frame_rate_the_focal_length_gives_the_displacement() -> None:
    requested = roadside().with_dials({"frame_rate_hz": 10, "displacement_px": 9})
    solved = solve_size_and_motion(apply_direct_dials(requested), 0, 0)
    assert 1 / solved.imaging.interval_s == pytest.approx(10)
    assert solved.camera.fov_rad != 0.75
    assert _shown(solved)[0] == pytest.approx(9, rel=0.1)


def test_dials_that_contradict_each_other_are_named() -> None:
    requested = roadside().with_dials(
        {"frame_rate_hz": 5, "target_px": 10, "displacement_px": 90}
    )
    with pytest.raises(ScenarioError) as caught:
        solve_size_and_motion(apply_direct_dials(requested), 0, 0)
    message = str(caught.value)
    assert "displacement_px 90 cannot be reached: at 5 Hz" in message
    assert "free target_px and frame_rate_hz" in message
    assert "\n" not in message


def test_a_camera_that_never_sees_the_target_is_named() -> None:
    away = {
        "position": {"along_m": 12, "lateral_m": -40, "height_m": 4},
        "look_at": {"along_m": 12, "lateral_m": -90, "height_m": 1},
    }
    with pytest.raises(ScenarioError, match="the camera does not see the target"):
        solve_size_and_motion(roadside(camera=away).with_dials({"target_px": 30}), 0, 0)
