"""One dial changed, all else kept: images, trajectories and truth."""

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


def _rendered(scenario: Scenario) -> tuple[list[np.ndarray], Stage, np.ndarray]:
    images: dict[int, np.ndarray] = {}
    stage, truth = render_with_dials(scenario, 0, images.__setitem__)
    return [images[n] for n in sorted(images)], stage, 1 - truth.visible_fraction


def _short(**parts: Any) -> Scenario:
    surroundings = {"tree_spacing_m": 12, "lamp_spacing_m": 30}
    noisy = {"width_px": 240, "height_px": 120, "noise": 0.02, "blur_px": 0}
    content = {"frames": 12, "surroundings": surroundings, "imaging": noisy}
    return roadside(**(content | {"occluders": POLE} | parts))


def test_with_and_without_the_pole_images_differ_only_at_the_pole() -> None:
    scenario = _short()
    plain, bare, none = _rendered(scenario.with_dials({"occlusion.hidden": 0}))
    occluded, stage, hidden = _rendered(scenario.with_dials({"occlusion.hidden": 0.6}))
    assert (
        bare.trajectories.positions.tobytes() == stage.trajectories.positions.tobytes()
    )
    assert none.max() < 0.01
    assert hidden.max() == pytest.approx(0.6, abs=0.05)
    camera = stage.cameras[0]  # both the camera and the pole are fixed
    (pole,) = stage.occluders
    feet = pole.base + [[0, 0, 0], [0, 0, pole.height + 2]]
    middle = float(camera.project(feet)[0][:, 0].mean())
    reach = pole.width * 1.6 * camera.focal_px / 12 / 2 + 2
    for one, other in zip(plain, occluded, strict=True):
        columns = np.flatnonzero(np.any(one != other, axis=(0, 2)))
        assert len(columns)
        assert abs(columns - middle).max() <= reach


def test_in_sunlight_the_pole_adds_its_shadow_and_nothing_else() -> None:
    light = {"shadows": True, "sun_azimuth_rad": 0.6}
    clear = {"width_px": 240, "height_px": 120, "noise": 0, "blur_px": 0}
    scenario = _short(light=light, imaging=clear)
    plain, _, _ = _rendered(scenario.with_dials({"occlusion.hidden": 0}))
    occluded, stage, _ = _rendered(scenario.with_dials({"occlusion.hidden": 0.6}))
    camera = stage.cameras[0]
    (pole,) = stage.occluders
    middle = float(camera.project(pole.base[None])[0][0, 0])
    reach = pole.width * 1.6 * camera.focal_px / 12 / 2 + 2
    columns = np.arange(240)
    outside = abs(columns + 0.5 - middle) > reach
    for one, other in zip(plain, occluded, strict=True):
        brighter = other.astype(int) - one.astype(int)
        assert brighter[:, outside].max() <= 0


def test_more_noise_changes_images_but_not_the_truth() -> None:
    scenario = _short()
    quiet, first, hidden = _rendered(scenario.with_dials({"noise": 0}))
    noisy, second, still = _rendered(scenario.with_dials({"noise": 0.2}))
    assert np.array_equal(hidden, still)
    same = first.trajectories.positions, second.trajectories.positions
    assert same[0].tobytes() == same[1].tobytes()
    assert np.std(noisy[0].astype(float) - quiet[0]) > 20


def test_contrast_and_illumination_change_the_image() -> None:
    scenario = _short()
    plain, _, _ = _rendered(scenario)
    flat, _, _ = _rendered(scenario.with_dials({"contrast": 0.3}))
    dark, _, _ = _rendered(scenario.with_dials({"illumination": 0.3}))
    assert flat[0].std() < 0.5 * plain[0].std()
    assert dark[0].mean() < 0.8 * plain[0].mean()


def test_requested_and_achieved_are_recorded_and_within_tolerance() -> None:
    scenario = roadside(frames=30).with_dials(
        {
            "displacement_px": 6,
            "target_px": 12,
            "occlusion.hidden": 0.7,
            "distractors.count": 1,
        }
    )
    sequence = simbench.generate(scenario, 1)
    assert set(sequence.requested) <= set(sequence.achieved)
    assert sequence.achieved["displacement_px"] == pytest.approx(6, rel=0.1)
    assert sequence.achieved["target_px"] == pytest.approx(12, rel=0.1)
    assert sequence.achieved["occlusion.hidden"] == pytest.approx(0.7, abs=0.05)
    assert sequence.achieved["distractors.count"] == 1
    assert sequence.scenario is not None
    assert sequence.scenario["dials"]["displacement_px"] == 6
    assert cv2.Laplacian(sequence.frames[0].image, cv2.CV_64F).var() > 1


def test_unreached_dial_is_an_error_that_names_it() -> None:
    on_map = [{"kind": "pole", "along_m": 6, "lateral_m": -20, "width_m": 0.6}]
    scenario = _short(occluders=on_map).with_dials({"occlusion.hidden": 0})
    with pytest.raises(ScenarioError) as caught:
        simbench.generate(scenario, 0)
    assert str(caught.value).startswith(
        "story: dials.occlusion.hidden: expected 0 within 0.05, the sequence shows 0."
    )
    assert "\n" not in str(caught.value)
