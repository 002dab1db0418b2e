"""Definition and tolerance of dials, and those that are settings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simbench.core.errors import ScenarioError
from simbench.scenarios.achieved_dials import (
    achieved_dials,
    apply_direct_dials,
    missed_dials,
    occlusions_of,
)
from simbench.scenarios.schema import DIAL_NAMES, Dials
from tests.scenarios.small_scenario import small_scenario
from tests.tiny_sequence import tiny_sequence


def test_an_occlusion_lasts_while_more_than_half_of_its_peak_is_hidden() -> None:
    found = occlusions_of(np.array([0, 0.39, 0.41, 0.8, 0.41, 0.39, 0]))
    assert found == (0.8, 3, 1)


def test_occlusions_are_counted_and_their_median_length_given() -> None:
    runs = [0, 0.6, 0, 0, 0.8, 0.8, 0.8, 0, 0, 0.7, 0.7, 0.7, 0.7, 0.7, 0]
    assert occlusions_of(np.array(runs)) == (0.8, 3, 3)


def test_one_lighter_frame_does_not_end_an_occlusion() -> None:
    assert occlusions_of(np.array([0.9, 0.1, 0.9])) == (0.9, 3, 1)
    assert occlusions_of(np.array([0.9, 0.1, 0.1, 0.9])).number == 2


def test_a_peak_below_the_minimum_is_no_occlusion() -> None:
    assert occlusions_of(np.array([0.0, 0.04, 0.0])) == (0.04, 0, 0)


def test_frames_without_the_target_hide_nothing() -> None:
    assert occlusions_of(np.array([0.0, np.nan, 0.6])) == (0.6, 1, 1)
    assert np.isnan(occlusions_of(np.full(3, np.nan)).peak)


@pytest.mark.parametrize(
    ("dial", "requested", "achieved", "is_missed"),
    [
        ("displacement_px", 20, 22, False),
        ("displacement_px", 20, 22.1, True),
        ("target_px", 20, 17.9, True),
        ("occlusion.hidden", 0.8, 0.85, False),
        ("occlusion.hidden", 0.8, 0.86, True),
        ("occlusion.frames", 12, 11, False),
        ("occlusion.frames", 12, 10, True),
        ("occlusion.count", 2, 3, True),
        ("displacement_px", 20, float("nan"), True),
    ],
)
def test_tolerances(
    dial: str, requested: float, achieved: float, is_missed: bool
) -> None:
    dials = Dials().with_values({dial: requested})
    assert (dial in missed_dials(dials, {dial: achieved})) == is_missed


def test_frames_are_not_missed_if_no_occlusion_is_requested() -> None:
    dials = Dials().with_values({"occlusion.hidden": 0, "occlusion.frames": 9})
    achieved = {"occlusion.hidden": 0.0, "occlusion.frames": 0.0}
    assert missed_dials(dials, achieved) == {}


def test_every_dial_can_be_set_and_is_listed() -> None:
    values: dict[str, Any] = dict.fromkeys(DIAL_NAMES, 1)
    values |= {"occlusion.by": "pole", "resolution": 100, "noise": 0.5}
    flat = Dials().with_values(values).flat()
    assert set(flat) == set(DIAL_NAMES) - {"occlusion.by"}


def test_setting_one_dial_leaves_the_others() -> None:
    scenario = small_scenario(dials={"target_px": 30, "occlusion": {"by": "sign"}})
    changed = scenario.with_dials({"occlusion.hidden": 0.5})
    assert changed.dials.target_px == 30
    assert changed.dials.occlusion is not None
    assert changed.dials.occlusion.by == "sign"
    assert changed.seeds == scenario.seeds


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"speed": 3}, "story: 'speed' is no dial; there are displacement_px, "),
        ({"occlusion.hidden": 1.5}, r"story: dials.occlusion.hidden: .* got 1.5$"),
        (
            {"displacement_px": "fast"},
            r"story: dials.displacement_px: expected a number, got 'fast'$",
        ),
    ],
)
def test_a_dial_out_of_range_is_an_error_in_one_line(settings: Any, words: str) -> None:
    with pytest.raises(ScenarioError, match=words) as caught:
        small_scenario().with_dials(settings)
    assert "\n" not in str(caught.value)


def test_settings_of_the_camera_are_set() -> None:
    requested = small_scenario().with_dials(
        {
            "noise": 0.1,
            "jpeg_quality": 40,
            "contrast": 0.5,
            "illumination": 2,
            "vibration_px": 3,
            "resolution": 320,
        }
    )
    ready = apply_direct_dials(requested)
    imaging = ready.imaging
    assert (imaging.noise, imaging.jpeg_quality, imaging.contrast) == (0.1, 40, 0.5)
    assert (imaging.width_px, imaging.height_px) == (320, 240)
    assert ready.light.illumination == 2
    assert ready.camera.vibration_px == 3
    assert (ready.road, ready.traffic, ready.seeds) == (
        requested.road,
        requested.traffic,
        requested.seeds,
    )


def test_wander_and_vibration_scale_with_the_resolution() -> None:
    shaky = {"wander_px": 40.0, "vibration_px": 2.0}
    scenario = small_scenario(camera=small_scenario().camera.model_dump() | shaky)
    width = scenario.imaging.width_px
    half = apply_direct_dials(scenario.with_dials({"resolution": width // 2})).camera
    assert (half.wander_px, half.vibration_px) == (20.0, 1.0)
    requested = {"resolution": width // 2, "vibration_px": 3.0}
    both = apply_direct_dials(scenario.with_dials(requested)).camera
    assert (both.wander_px, both.vibration_px) == (20.0, 3.0)


def test_another_frame_rate_keeps_the_duration() -> None:
    scenario = small_scenario(frames=51)  # 2 s
    slow = apply_direct_dials(scenario.with_dials({"frame_rate_hz": 5}))
    assert slow.frames == 11
    assert slow.duration_s == pytest.approx(scenario.duration_s)


def test_a_frame_rate_that_leaves_one_frame_is_named() -> None:
    requested = small_scenario(frames=40).with_dials(
        {"frame_rate_hz": 0.5}
    )  # of 1.56 s
    with pytest.raises(
        ScenarioError, match=r"frame_rate_hz 0\.5 leaves 1 frame of 1\.56 s"
    ):
        apply_direct_dials(requested)


def test_no_occlusion_and_a_hidden_share_contradict_each_other() -> None:
    with pytest.raises(ScenarioError, match="count 0"):
        small_scenario().with_dials({"occlusion.count": 0, "occlusion.hidden": 0.5})


def test_a_scenario_without_dials_does_not_change() -> None:
    scenario = small_scenario()
    assert apply_direct_dials(scenario).digest == scenario.digest


def test_distractors_within_the_gap_are_counted() -> None:
    truth = tiny_sequence().truth
    table = truth.vehicles
    assert table is not None
    target = next(v for v in table.vehicles if v.name == "target")
    distractor = replace(target, name="stranger.0")
    near, far = truth.boxes.copy(), truth.boxes.copy()
    near[:, 0] += truth.boxes[:, 2] + 5  # 5 px beside it
    far[:, 0] += truth.boxes[:, 2] + 50
    for boxes, limit, count in ((near, 5.0, 1), (far, 5.0, 0), (far, 50.0, 1)):
        vehicles = replace(
            table,
            vehicles=(target, distractor),
            ids=np.array([1, 2]),
            boxes=np.stack([truth.boxes, boxes], axis=1),
            visible_px=np.ones((len(boxes), 2)),
        )
        with_distractor = replace(truth, vehicles=vehicles)
        requested = small_scenario().with_dials({"distractors.gap_px": limit})
        achieved = achieved_dials(with_distractor, requested)
        assert achieved["distractors.count"] == count
