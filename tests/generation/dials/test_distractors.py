"""Distractors: their lanes, and which vehicles they replace."""

from __future__ import annotations

from typing import Any

import pytest

from simbench.core.errors import ScenarioError
from simbench.generation.dials.distractors import add_distractors
from tests.generation.dials.roadside import roadside


@pytest.mark.parametrize(
    ("lateral_m", "lanes"),
    [
        pytest.param(-40, [2, 0, 2], id="camera on the right"),
        pytest.param(20, [0, 2, 0], id="camera on the left"),
    ],
)
def test_the_first_distractor_passes_behind_the_target(
    lateral_m: float, lanes: list[int]
) -> None:
    place = {"along_m": 12, "lateral_m": lateral_m, "height_m": 4}
    camera = roadside().camera.model_dump() | {"position": place}
    scenario = roadside(camera=camera).with_dials({"distractors.count": 3})
    assert [
        distractor.lane for distractor in add_distractors(scenario).strangers
    ] == lanes


def test_a_target_at_the_edge_has_distractors_on_its_one_side() -> None:
    target: dict[str, Any] = {"lane": 0, "along_m": 0, "speed_mps": 15}
    scenario = roadside(target=target).with_dials({"distractors.count": 2})
    assert [distractor.lane for distractor in add_distractors(scenario).strangers] == [
        1,
        1,
    ]


def test_without_a_lane_beside_the_target_distractors_are_refused() -> None:
    narrow = {"lanes": 1, "before_m": 100, "sections": [{"length_m": 400}]}
    target = {"lane": 0, "along_m": 0, "speed_mps": 15}
    scenario = roadside(road=narrow, target=target).with_dials({"distractors.count": 1})
    with pytest.raises(ScenarioError, match="expected a lane beside the target"):
        add_distractors(scenario)


def test_scripted_look_alikes_are_replaced_and_others_stay() -> None:
    alike = {"vehicle_class": "car", "colour": roadside().target.colour}
    other = {"vehicle_class": "bus", "colour": "white"}
    place = {"lane": 2, "ahead_m": 30, "speed_mps": 15}
    scenario = roadside(strangers=[alike | place, other | place]).with_dials(
        {"distractors.count": 1}
    )
    classes = [one.vehicle_class for one in add_distractors(scenario).strangers]
    assert classes == ["bus", "car"]
