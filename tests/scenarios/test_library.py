"""The scenarios that ship with simbench: each has the effects that it claims."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.box import area, centers, clip
from simbench.generation.dials.probe import target_boxes
from simbench.scenarios.files.library import list_scenarios, mirrors_of
from simbench.scenarios.files.loading import (
    load_recipe,
    load_scenario,
    load_variants,
    variants_of,
)
from simbench.scenarios.files.samples import resolve_samples
from simbench.scenarios.schema import Mirror, Scenario
from simbench.scenarios.stage import build_stage

FAST_MOTION = [
    f"{what}-{side}-{camera}"
    for what in ("car", "motorcycle")
    for side in ("front", "rear", "above")
    for camera in ("still", "moving")
]
LEVELS = {"standard": (0.0, 40.0), "medium": (20.0, 60.0), "extreme": (20.0, 100.0)}
"""Displacement of the target between frames [px]; DSP, section 4.1."""
QUICK_LEVELS = [
    ("car-front-still", "medium"),
    ("motorcycle-above-still", "standard"),
    ("motorcycle-rear-moving", "extreme"),
]
QUICK = ["smoke", "two-way-curve", "ball-bounce"]
MIRRORS = {
    "dpf": {"video1", "video2", "video3"},
    "dsp": {
        *("car1", "car2", "car4", "racing", "tunnel"),
        *(f"car003fast{px}" for px in (40, 60, 100)),
        *(f"motorcycle00{n}fast{px}" for n in (1, 2, 3) for px in (40, 60, 100)),
    },
    "nbrf": {"low-frame-rate", "sudden-reversals", "both"},
}
"""Sequences that the papers' experiments name."""


def _marked(
    cases: Sequence[tuple[str, ...]], quick: Sequence[tuple[str, ...]]
) -> list[Any]:
    """Mark all cases but the quick ones as slow."""
    return [
        pytest.param(
            *case, id="@".join(case), marks=() if case in quick else pytest.mark.slow
        )
        for case in cases
    ]


def _boxes(scenario: Scenario, seed: int) -> NDArray[np.float64]:
    return target_boxes(build_stage(scenario, seed))


@pytest.mark.parametrize("name", list_scenarios())
def test_a_scenario_is_the_same_each_time_it_is_read(name: str) -> None:
    base = load_scenario(name)
    assert (base.name, base.variant) == (name, "")
    assert load_scenario(name).digest == base.digest
    if variants_of(name):
        variants = load_variants(f"{name}@all")
        assert [one.variant for one in variants] == variants_of(name)
        assert len({one.digest for one in variants}) == len(variants)


@pytest.mark.parametrize("name", list_scenarios())
def test_a_scenario_states_in_one_line_what_it_tests(name: str) -> None:
    scenario = load_scenario(name)
    assert re.fullmatch(r"[A-Z0-9][^\n]{30,250}\.", scenario.tests)
    assert scenario.tests.rstrip(".") != scenario.title


def test_no_two_scenarios_share_a_title_or_what_they_test() -> None:
    scenarios = [load_scenario(name) for name in list_scenarios()]
    for key in ("title", "tests"):
        assert len({getattr(one, key) for one in scenarios}) == len(scenarios)


def test_library_has_the_fast_motion_sequences_at_three_levels() -> None:
    assert len(FAST_MOTION) == 12
    for name in FAST_MOTION:
        assert variants_of(name) == list(LEVELS)
        standard = load_scenario(f"{name}@standard").for_seed(5)
        same = standard.model_copy(update={"variant": ""})
        assert same == load_scenario(name).for_seed(5)


def test_variants_leave_every_other_sample_as_it_is() -> None:
    for name in ("car-rear-moving", "motorcycle-above-still", "car003"):
        files = [load_recipe(f"{name}@{variant}") for variant in variants_of(name)]
        for seed in (0, 7):
            found = [resolve_samples(one.content, name, seed, "")[1] for one in files]
            assert found[0] == found[1] == found[2]


def test_dials_leave_every_sample_of_the_library_as_it_is() -> None:
    plain = load_scenario("poles")
    turned = plain.with_dials({"occlusion.hidden": 0.5, "noise": 0.1})
    for seed in (0, 7):
        dials = turned.for_seed(seed).dials
        assert dials.flat() == {"occlusion.hidden": 0.5, "noise": 0.1}
        assert plain.for_seed(seed).model_copy(
            update={"dials": dials}
        ) == turned.for_seed(seed)


def test_every_seed_of_a_scenario_is_another_instance_but_of_smoke() -> None:
    for name in list_scenarios():
        scenario = load_scenario(name)
        digests = {scenario.for_seed(seed).digest for seed in range(5)}
        assert len(digests) == (1 if name == "smoke" else 5), name


@pytest.mark.parametrize("paper", ["dsp", "nbrf", "dpf"])
def test_every_sequence_of_a_paper_has_a_mirror(paper: str) -> None:
    found = mirrors_of(paper)
    assert set(found) >= MIRRORS[paper]
    for sequence, name in found.items():
        mirrors = load_scenario(name).mirrors
        assert Mirror(paper=paper, sequence=sequence) in mirrors  # type: ignore[arg-type]


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("name", "level"),
    _marked([(name, level) for name in FAST_MOTION for level in LEVELS], QUICK_LEVELS),
)
def test_displacements_are_within_the_range_of_the_level(name: str, level: str) -> None:
    boxes = _boxes(load_scenario(f"{name}@{level}"), seed=0)
    assert not np.isnan(boxes).any()
    moves = np.linalg.norm(np.diff(centers(boxes), axis=0), axis=-1)
    low, high = np.quantile(moves, [0.05, 0.95])
    least, most = LEVELS[level]
    assert least <= low
    assert high <= most
    # it must use the range: fast motion starts at 20 px, and most of it is reached
    assert np.mean(moves > 20.0) > 0.12
    assert high > 0.65 * most


@pytest.mark.sumo
@pytest.mark.parametrize(
    "name", _marked([(name,) for name in list_scenarios()], [(name,) for name in QUICK])
)
def test_the_target_is_inside_the_picture_in_the_first_frame(name: str) -> None:
    scenario = load_scenario(name)
    boxes = _boxes(scenario, seed=0)
    size = scenario.imaging.width_px, scenario.imaging.height_px
    assert area(clip(boxes[:1], *size))[0] > 0.8 * area(boxes[:1])[0]
    assert boxes[0, 2:].min() >= 9.0
