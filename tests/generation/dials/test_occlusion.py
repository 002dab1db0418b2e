"""Solver of the occlusion dial: hidden share, frames and count."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simbench.core.errors import ScenarioError
from simbench.generation.dials.occlusion import TrafficOccludesTargetError
from simbench.generation.dials.probe import OcclusionProbe
from simbench.generation.dials.solver import solve_dials
from simbench.scenarios.achieved_dials import OcclusionSummary, occlusions_of
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import build_stage
from tests.generation.dials.roadside import roadside

pytestmark = [pytest.mark.sumo, pytest.mark.gl]


def _shown(scenario: Scenario) -> OcclusionSummary:
    with OcclusionProbe(build_stage(scenario, 0)) as probe:
        sighted = [o for o in scenario.occluders if o.hides_at_s is not None]
        frames = range(len(probe.boxes))
        return occlusions_of(probe.hidden(sighted, frames))


@pytest.mark.parametrize(
    ("by", "hidden"), [("pole", 0.3), ("pole", 1.0), ("tree", 0.6), ("sign", 0.8)]
)
def test_the_peak_hidden_share_is_reached(by: str, hidden: float) -> None:
    requested = roadside().with_dials({"occlusion.hidden": hidden, "occlusion.by": by})
    solved = solve_dials(requested, 0)
    assert [occluder.kind for occluder in solved.occluders] == [by]
    found = _shown(solved)
    assert found.peak == pytest.approx(hidden, abs=0.03)
    assert found.number == 1


def test_a_gantry_hides_what_a_camera_sees_from_above() -> None:
    above = {
        "position": {"along_m": -30, "lateral_m": -8, "height_m": 9},
        "look_at": {"along_m": 20, "lateral_m": -8, "height_m": 0},
        "fov_rad": 0.5,
    }
    requested = roadside(camera=above).with_dials(
        {"occlusion.hidden": 0.6, "occlusion.by": "gantry"}
    )
    assert _shown(solve_dials(requested, 0)).peak == pytest.approx(0.6, abs=0.03)
    low = roadside().with_dials({"occlusion.hidden": 0.6, "occlusion.by": "gantry"})
    with pytest.raises(ScenarioError, match="a gantry hides what a camera sees from"):
        solve_dials(low, 0)


@pytest.mark.parametrize(
    ("hidden", "frames"), [(0.5, 18), pytest.param(0.9, 24, marks=pytest.mark.slow)]
)
def test_a_sign_hides_a_share_for_a_time(hidden: float, frames: int) -> None:
    requested = roadside().with_dials(
        {"occlusion.hidden": hidden, "occlusion.frames": frames}
    )
    found = _shown(solve_dials(requested, 0))
    assert found.peak == pytest.approx(hidden, abs=0.03)
    assert abs(found.frames - frames) <= 1


def test_the_number_of_occlusions_is_reached() -> None:
    requested = roadside(frames=50).with_dials(
        {"occlusion.hidden": 0.4, "occlusion.count": 2, "displacement_px": 3.5}
    )
    found = _shown(solve_dials(requested, 0))
    assert found.number == 2
    assert found.peak == pytest.approx(0.4, abs=0.03)


@pytest.mark.parametrize(
    ("count", "frames", "words"),
    [
        pytest.param(20, None, "expected at least 3 frames .* got 1 of 40", id="many"),
        pytest.param(3, 12, "expected at least 13 frames .* of 40 frames", id="long"),
    ],
)
def test_occlusions_that_would_merge_are_refused_before_the_search(
    count: int, frames: int | None, words: str
) -> None:
    dials = {"occlusion.hidden": 0.4, "occlusion.count": count}
    if frames is not None:
        dials["occlusion.frames"] = frames
    with pytest.raises(ScenarioError, match=words):
        solve_dials(roadside(frames=40).with_dials(dials), 0)


def test_each_tree_is_probed_with_the_shape_it_is_rendered_with() -> None:
    requested = roadside(frames=50).with_dials(
        {"occlusion.hidden": 0.5, "occlusion.count": 2, "occlusion.by": "tree"}
        | {"displacement_px": 3.5}
    )
    solved = solve_dials(requested, 0)
    with OcclusionProbe(build_stage(solved, 0)) as probe:
        frames = range(len(probe.boxes))
        for number, tree in enumerate(solved.occluders):
            hidden = probe.hidden([tree], frames, first=number)
            assert np.nanmax(hidden) == pytest.approx(0.5, abs=0.02)


def test_a_hidden_share_of_zero_removes_the_occluders() -> None:
    poles = [{"kind": "pole", "hides_at_s": 0.8, "distance_m": 10, "width_m": 0.4}]
    scenario = roadside(occluders=poles)
    assert _shown(scenario).peak > 0.1
    assert solve_dials(scenario.with_dials({"occlusion.hidden": 0}), 0).occluders == ()


def test_an_occluder_of_the_scenario_changes_its_width_and_keeps_its_place() -> None:
    poles = [{"kind": "pole", "hides_at_s": 0.8, "distance_m": 10, "width_m": 0.4}]
    requested = roadside(occluders=poles).with_dials({"occlusion.hidden": 0.7})
    (pole,) = solve_dials(requested, 0).occluders
    assert (pole.hides_at_s, pole.distance_m) == (0.8, 10)
    assert pole.width_m > 0.4


def test_a_scenario_with_the_requested_occlusion_is_not_changed() -> None:
    poles = [{"kind": "pole", "hides_at_s": 0.8, "distance_m": 10, "width_m": 0.4}]
    scenario = roadside(occluders=poles)
    peak = round(_shown(scenario).peak, 2)
    requested = scenario.with_dials({"occlusion.hidden": peak})
    assert solve_dials(requested, 0) == requested


@pytest.mark.parametrize("hidden", [0.5, pytest.param(0.95, marks=pytest.mark.slow)])
def test_a_vehicle_drives_between_camera_and_target(hidden: float) -> None:
    beside: dict[str, Any] = {
        "position": {"along_m": 0, "lateral_m": 14, "height_m": 2.5},
        "look_at": {"along_m": 0, "lateral_m": -8, "height_m": 1},
        "motion": "follow",
        "mount": "car",
        "fov_rad": 0.8,
    }
    requested = roadside(frames=120, camera=beside).with_dials(
        {"occlusion.hidden": hidden, "occlusion.by": "vehicle"}
    )
    solved = solve_dials(requested, 0)
    assert len(solved.strangers) == 1
    assert _shown(solved).peak == pytest.approx(hidden, abs=0.05)


def test_traffic_that_hides_the_target_is_rejected_at_any_requested_share() -> None:
    low = {
        "position": {"along_m": 12, "lateral_m": -20, "height_m": 1.6},
        "look_at": {"along_m": 12, "lateral_m": -9, "height_m": 0.7},
        "fov_rad": 0.75,
    }
    busy = roadside(
        frames=30,
        camera=low,
        target={"lane": 2, "along_m": 5, "speed_mps": 12, "clear_m": 12},
        traffic={"density_per_km_lane": 25, "warm_up_s": 5},
    )
    with OcclusionProbe(build_stage(busy, 1)) as probe:
        shown = range(len(probe.boxes))
        assert max(probe.frame_occlusion(f).by_traffic for f in shown) > 0.05
    for hidden in (0.0, 0.5, 0.94):
        with pytest.raises(TrafficOccludesTargetError):
            solve_dials(busy.with_dials({"occlusion.hidden": hidden}), 1)


def test_an_occluder_at_a_time_without_the_target_is_named() -> None:
    late = [{"kind": "pole", "hides_at_s": 1.5, "distance_m": 10}]
    fast = {"lane": 1, "along_m": 0, "speed_mps": 40}
    requested = roadside(occluders=late, target=fast).with_dials(
        {"occlusion.hidden": 0.5}
    )
    with pytest.raises(ScenarioError, match=r"hides at 1\.5 s, when the target is not"):
        solve_dials(requested, 0)


def test_a_camera_straight_above_is_named() -> None:
    above = {
        "position": {"along_m": 0, "lateral_m": -5, "height_m": 30},
        "look_at": {"along_m": 0.1, "lateral_m": -5, "height_m": 0},
        "motion": "follow",
    }
    requested = roadside(camera=above).with_dials({"occlusion.hidden": 0.5})
    with pytest.raises(ScenarioError, match="from straight above"):
        solve_dials(requested, 0)


def test_a_time_too_short_for_any_edge_to_pass_is_named() -> None:
    requested = roadside().with_dials({"occlusion.hidden": 0.5, "occlusion.frames": 3})
    with pytest.raises(ScenarioError, match="frames 3 cannot be reached: the target"):
        solve_dials(requested, 0)


def test_a_pole_that_hides_for_another_time_is_named() -> None:
    requested = roadside().with_dials(
        {"occlusion.hidden": 0.5, "occlusion.frames": 30, "occlusion.by": "pole"}
    )
    with pytest.raises(
        ScenarioError, match=r"expected 30 frames, got .*: ask for occlusion\.by: sign"
    ):
        solve_dials(requested, 0)


def test_the_probe_measures_what_the_sequence_will_show() -> None:
    from simbench.generation.generate import generate

    poles = [{"kind": "pole", "hides_at_s": 0.2, "distance_m": 10, "width_m": 0.4}]
    scenario = roadside(frames=9, occluders=poles)
    rendered = 1.0 - generate(scenario, 0).truth.visible_fraction
    with OcclusionProbe(build_stage(scenario, 0)) as probe:
        probed = probe.hidden(scenario.occluders, range(9))
    assert rendered.max() > 0.1
    assert np.abs(rendered - probed).max() < 0.03
