"""One dial turned, all else kept: pictures, trajectories and what they show."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest

import simbench
from simbench.core.errors import ScenarioError
from simbench.generation.attempts import render_with_dials
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage
from tests.generation.dials.roadside import roadside

pytestmark = [pytest.mark.gl, pytest.mark.sumo]

POLE = [{"kind": "pole", "hides_at_s": 0.24, "distance_m": 12, "width_m": 0.5}]


def _filmed(scenario: Scenario) -> tuple[list[np.ndarray], Stage, np.ndarray]:
    pictures: dict[int, np.ndarray] = {}
    stage, truth = render_with_dials(scenario, 0, pictures.__setitem__)
    return [pictures[n] for n in sorted(pictures)], stage, 1 - truth.visible_fraction


def _short(**parts: Any) -> Scenario:
    surroundings = {"tree_spacing_m": 12, "lamp_spacing_m": 30}
    noisy = {"width_px": 240, "height_px": 120, "noise": 0.02, "blur_px": 0}
    content = {"frames": 12, "surroundings": surroundings, "imaging": noisy}
    return roadside(**(content | {"occluders": POLE} | parts))


def test_with_and_without_the_pole_pictures_differ_at_the_pole_alone() -> None:
    scenario = _short()
    plain, bare, none = _filmed(scenario.with_dials({"occlusion.hidden": 0}))
    poled, there, hidden = _filmed(scenario.with_dials({"occlusion.hidden": 0.6}))
    assert (
        bare.trajectories.positions.tobytes() == there.trajectories.positions.tobytes()
    )
    assert none.max() < 0.01
    assert hidden.max() == pytest.approx(0.6, abs=0.05)
    camera = there.cameras[0]  # it stands still, and so does the pole
    (pole,) = there.occluders
    feet = pole.base + [[0, 0, 0], [0, 0, pole.height + 2]]
    middle = float(camera.project(feet)[0][:, 0].mean())
    reach = pole.width * 1.6 * camera.focal_px / 12 / 2 + 2
    for one, other in zip(plain, poled, strict=True):
        columns = np.flatnonzero(np.any(one != other, axis=(0, 2)))
        assert len(columns)
        assert abs(columns - middle).max() <= reach


def test_with_the_sun_out_the_pole_adds_its_shadow_and_no_more() -> None:
    light = {"shadows": True, "sun_azimuth_rad": 0.6}
    clear = {"width_px": 240, "height_px": 120, "noise": 0, "blur_px": 0}
    scenario = _short(light=light, imaging=clear)
    plain, _, _ = _filmed(scenario.with_dials({"occlusion.hidden": 0}))
    poled, there, _ = _filmed(scenario.with_dials({"occlusion.hidden": 0.6}))
    camera = there.cameras[0]
    (pole,) = there.occluders
    middle = float(camera.project(pole.base[None])[0][0, 0])
    reach = pole.width * 1.6 * camera.focal_px / 12 / 2 + 2
    columns = np.arange(240)
    outside = abs(columns + 0.5 - middle) > reach
    for one, other in zip(plain, poled, strict=True):
        brighter = other.astype(int) - one.astype(int)
        assert brighter[:, outside].max() <= 0


def test_noise_turned_up_changes_pictures_but_no_truth() -> None:
    scenario = _short()
    quiet, first, hidden = _filmed(scenario.with_dials({"noise": 0}))
    noisy, second, still = _filmed(scenario.with_dials({"noise": 0.2}))
    assert np.array_equal(hidden, still)
    same = first.trajectories.positions, second.trajectories.positions
    assert same[0].tobytes() == same[1].tobytes()
    assert np.std(noisy[0].astype(float) - quiet[0]) > 20


def test_contrast_and_illumination_reach_the_picture() -> None:
    scenario = _short()
    plain, _, _ = _filmed(scenario)
    flat, _, _ = _filmed(scenario.with_dials({"contrast": 0.3}))
    dark, _, _ = _filmed(scenario.with_dials({"illumination": 0.3}))
    assert flat[0].std() < 0.5 * plain[0].std()
    assert dark[0].mean() < 0.8 * plain[0].mean()


def test_requested_stands_beside_achieved_and_within_tolerance() -> None:
    asked = roadside(frames=30).with_dials(
        {
            "displacement_px": 6,
            "target_px": 12,
            "occlusion.hidden": 0.7,
            "distractors.count": 1,
        }
    )
    sequence = simbench.generate(asked, 1)
    assert set(sequence.requested) <= set(sequence.achieved)
    assert sequence.achieved["displacement_px"] == pytest.approx(6, rel=0.1)
    assert sequence.achieved["target_px"] == pytest.approx(12, rel=0.1)
    assert sequence.achieved["occlusion.hidden"] == pytest.approx(0.7, abs=0.05)
    assert sequence.achieved["distractors.count"] == 1
    assert sequence.scenario is not None
    assert sequence.scenario["dials"]["displacement_px"] == 6
    assert cv2.Laplacian(sequence.frames[0].image, cv2.CV_64F).var() > 1


def test_what_the_film_does_not_show_is_an_error_that_names_it() -> None:
    on_map = [{"kind": "pole", "along_m": 6, "lateral_m": -20, "width_m": 0.6}]
    asked = _short(occluders=on_map).with_dials({"occlusion.hidden": 0})
    with pytest.raises(ScenarioError) as caught:
        simbench.generate(asked, 0)
    assert str(caught.value).startswith(
        "story: dials.occlusion.hidden: wanted 0 within 0.05, the film shows 0."
    )
    assert "\n" not in str(caught.value)
