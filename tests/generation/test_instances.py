"""Instances of the library: every seed is taken, has the point, and differs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from simbench.cli import execute
from simbench.generation.instances.probe import (
    Instance,
    mean_still,
    median_overlap,
    probe_instance,
)
from simbench.generation.instances.sheet import write_sheet
from simbench.scenarios.files.library import list_scenarios
from simbench.scenarios.files.loading import load_scenario, variants_of
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.point import Measure
from tests.scenarios.small_scenario import small_scenario

pytestmark = [pytest.mark.gl, pytest.mark.sumo]

QUICK = [
    "ball-bounce",
    "car-above-still@extreme",
    "lane-change",
    "poles",
    "tunnel",
    "twins",
]
EVERY = [
    one
    for name in list_scenarios()
    for one in [f"{name}@{variant}" for variant in variants_of(name)] or [name]
]
SAME_TRACK = "smoke"  # which says so in its file
DIFFERENT = 0.3
"""Most that two tracks overlap in the median, and that `still` scores."""


def _require_good(found: list[Instance]) -> None:
    assert [one.refusal for one in found if one.refusal] == []
    assert [(one.seed, one.misses) for one in found if one.misses] == []


@pytest.mark.parametrize("name", QUICK)
def test_seeds_are_taken_and_show_what_the_scenario_is_about(name: str) -> None:
    scenario = load_scenario(name)
    found = [probe_instance(scenario, seed) for seed in (0, 1)]
    _require_good(found)
    assert mean_still(found) < DIFFERENT
    assert median_overlap([one.boxes for one in found]) < 0.6


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", EVERY)
def test_twenty_seeds_have_the_point_and_different_tracks(name: str) -> None:
    scenario = load_scenario(name)
    found = [probe_instance(scenario, seed) for seed in range(20)]
    _require_good(found)
    if name != SAME_TRACK:
        assert median_overlap([one.boxes for one in found]) < DIFFERENT
        assert mean_still(found) < DIFFERENT


@pytest.mark.slow
@pytest.mark.timeout(14_400)
@pytest.mark.parametrize("name", EVERY)
def test_every_seed_is_taken(name: str) -> None:
    scenario = load_scenario(name)
    found = [probe_instance(scenario, seed) for seed in range(200)]
    assert {one.seed: one.refusal for one in found if one.refusal} == {}


def _small(**changes: Any) -> Scenario:
    return Scenario.model_validate(
        small_scenario().model_dump(exclude_unset=True) | changes
    )


def test_a_miss_names_the_measure_what_was_expected_and_what_came() -> None:
    found = probe_instance(_small(point={"lane_changes": {"least": 2}}), 0)
    assert found.misses == ("lane_changes: expected at least 2, got 0",)


def test_a_refusal_is_the_reason_of_generate() -> None:
    blind = _small(camera={"position": {"lateral_m": -40}, "look_at": {"along_m": -90}})
    found = probe_instance(blind, 0)
    assert "does not see the target" in found.refusal
    assert not len(found.boxes)


def test_a_range_holds_both_its_ends_and_no_nan() -> None:
    between = Measure(least=1, most=2)
    assert [between.holds(x) for x in (0.9, 1, 2, 2.1, np.nan)] == [
        False,
        True,
        True,
        False,
        False,
    ]


def test_probe_prints_a_row_a_scenario_and_writes_a_sheet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sheet = tmp_path / "sheet.png"
    arguments = ["probe", "smoke", "--seeds", "0:2", "--jobs", "1", "--sheet"]
    assert execute([*arguments, str(sheet)]) == 0
    printed = capsys.readouterr().out
    assert "beside the point" in printed
    assert "1.00" in printed  # the same track twice
    image = cv2.imread(str(sheet))
    assert image is not None
    assert image.shape == (16 + 240, 2 * 320, 3)


def test_a_sheet_leaves_refused_seeds_out(tmp_path: Path) -> None:
    taken = Instance("one", 0, np.zeros((60, 80, 3), np.uint8), np.ones((4, 4)))
    write_sheet([taken, Instance("one", 1, refusal="no")], tmp_path / "sheet.png")
    image = cv2.imread(str(tmp_path / "sheet.png"))
    assert image is not None
    assert image.shape[1] == 320
