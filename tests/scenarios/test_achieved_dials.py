"""What dials mean, when they count as reached, and those that are mere settings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simbench.core.errors import ScenarioError
from simbench.scenarios.achieved_dials import (
    achieved_dials,
    missed,
    occlusions_of,
    set_up,
)
from simbench.scenarios.schema import DIAL_NAMES, Dials
from tests.scenarios.stories import story
from tests.tiny_sequence import tiny_sequence


def test_an_occlusion_lasts_while_more_than_half_of_its_peak_is_hidden() -> None:
    found = occlusions_of(np.array([0, 0.39, 0.41, 0.8, 0.41, 0.39, 0]))
    assert found == (0.8, 3, 1)


def test_occlusions_are_counted_and_their_median_length_told() -> None:
    runs = [0, 0.6, 0, 0, 0.8, 0.8, 0.8, 0, 0, 0.7, 0.7, 0.7, 0.7, 0.7, 0]
    assert occlusions_of(np.array(runs)) == (0.8, 3, 3)


def test_one_lighter_frame_does_not_end_an_occlusion() -> None:
    assert occlusions_of(np.array([0.9, 0.1, 0.9])) == (0.9, 3, 1)
    assert occlusions_of(np.array([0.9, 0.1, 0.1, 0.9])).number == 2


def test_next_to_nothing_hidden_is_no_occlusion() -> None:
    assert occlusions_of(np.array([0.0, 0.04, 0.0])) == (0.04, 0, 0)


def test_frames_without_the_target_hide_nothing() -> None:
    assert occlusions_of(np.array([0.0, np.nan, 0.6])) == (0.6, 1, 1)
    assert np.isnan(occlusions_of(np.full(3, np.nan)).peak)


@pytest.mark.parametrize(
    ("dial", "asked", "reached", "is_missed"),
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
def test_tolerances(dial: str, asked: float, reached: float, is_missed: bool) -> None:
    dials = Dials().turned({dial: asked})
    assert (dial in missed(dials, {dial: reached})) == is_missed


def test_where_nothing_is_to_be_hidden_no_frames_are_missed() -> None:
    dials = Dials().turned({"occlusion.hidden": 0, "occlusion.frames": 9})
    reached = {"occlusion.hidden": 0.0, "occlusion.frames": 0.0}
    assert missed(dials, reached) == {}


def test_every_dial_can_be_turned_and_is_told_back() -> None:
    values: dict[str, Any] = dict.fromkeys(DIAL_NAMES, 1)
    values |= {"occlusion.by": "pole", "resolution": 100, "noise": 0.5}
    flat = Dials().turned(values).flat()
    assert set(flat) == set(DIAL_NAMES) - {"occlusion.by"}


def test_turning_one_dial_leaves_the_others() -> None:
    scenario = story(dials={"target_px": 30, "occlusion": {"by": "sign"}})
    turned = scenario.with_dials({"occlusion.hidden": 0.5})
    assert turned.dials.target_px == 30
    assert turned.dials.occlusion is not None
    assert turned.dials.occlusion.by == "sign"
    assert turned.seeds == scenario.seeds


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"speed": 3}, "story: 'speed' is no dial; there are displacement_px, "),
        ({"occlusion.hidden": 1.5}, r"story: dials.occlusion.hidden: .* found 1.5"),
        (
            {"displacement_px": "fast"},
            r"story: dials: displacement_px must be a number, found 'fast'$",
        ),
    ],
)
def test_a_dial_out_of_range_is_one_line(settings: Any, words: str) -> None:
    with pytest.raises(ScenarioError, match=words) as caught:
        story().with_dials(settings)
    assert "\n" not in str(caught.value)


def test_settings_of_the_camera_are_set() -> None:
    asked = story().with_dials(
        {
            "noise": 0.1,
            "jpeg_quality": 40,
            "contrast": 0.5,
            "illumination": 2,
            "vibration_px": 3,
            "resolution": 320,
        }
    )
    ready = set_up(asked)
    imaging = ready.imaging
    assert (imaging.noise, imaging.jpeg_quality, imaging.contrast) == (0.1, 40, 0.5)
    assert (imaging.width_px, imaging.height_px) == (320, 240)
    assert ready.light.illumination == 2
    assert ready.camera.vibration_px == 3
    assert (ready.road, ready.traffic, ready.seeds) == (
        asked.road,
        asked.traffic,
        asked.seeds,
    )


def test_what_moves_the_picture_does_so_in_proportion_to_its_resolution() -> None:
    shaky = {"wander_px": 40.0, "vibration_px": 2.0}
    scenario = story(camera=story().camera.model_dump() | shaky)
    width = scenario.imaging.width_px
    half = set_up(scenario.with_dials({"resolution": width // 2})).camera
    assert (half.wander_px, half.vibration_px) == (20.0, 1.0)
    asked = {"resolution": width // 2, "vibration_px": 3.0}
    both = set_up(scenario.with_dials(asked)).camera
    assert (both.wander_px, both.vibration_px) == (20.0, 3.0)


def test_another_frame_rate_keeps_the_span_of_the_story() -> None:
    scenario = story(frames=51)  # 2 s
    slow = set_up(scenario.with_dials({"frame_rate_hz": 5}))
    assert slow.frames == 11
    assert slow.duration_s == pytest.approx(scenario.duration_s)


def test_a_frame_rate_that_leaves_one_frame_is_named() -> None:
    asked = story(frames=40).with_dials({"frame_rate_hz": 0.5})  # of 1.56 s
    with pytest.raises(ScenarioError, match=r"frame_rate_hz 0\.5 leaves 1 frame of a"):
        set_up(asked)


def test_no_occlusion_and_a_hidden_share_contradict_each_other() -> None:
    with pytest.raises(ScenarioError, match="count 0"):
        story().with_dials({"occlusion.count": 0, "occlusion.hidden": 0.5})


def test_a_story_without_dials_stays_itself() -> None:
    scenario = story()
    assert set_up(scenario) is scenario


def test_doubles_are_counted_where_they_come_near() -> None:
    truth = tiny_sequence().truth
    everyone = truth.vehicles
    assert everyone is not None
    target = next(v for v in everyone.vehicles if v.name == "target")
    double = replace(target, name="stranger.0")
    near, far = truth.boxes.copy(), truth.boxes.copy()
    near[:, 0] += truth.boxes[:, 2] + 5  # 5 px beside it
    far[:, 0] += truth.boxes[:, 2] + 50
    for boxes, limit, count in ((near, 5.0, 1), (far, 5.0, 0), (far, 50.0, 1)):
        company = replace(
            everyone,
            vehicles=(target, double),
            ids=np.array([1, 2]),
            boxes=np.stack([truth.boxes, boxes], axis=1),
            visible_px=np.ones((len(boxes), 2)),
        )
        seen = replace(truth, vehicles=company)
        asked = story().with_dials({"distractors.gap_px": limit})
        achieved = achieved_dials(seen, asked)
        assert achieved["distractors.count"] == count
