"""Recipes: samples by seed, the same for the same seed, every mistake in one line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from pydantic import BaseModel

from simbench.core.errors import ScenarioError
from simbench.scenarios import schema
from simbench.scenarios.files.loading import (
    load_recipe,
    load_recipes,
    load_scenario,
    scenario_schema,
)
from simbench.scenarios.files.recipe import Recipe
from simbench.scenarios.files.samples import (
    resolve_samples,
    samples_in,
    takes_whole_numbers,
)
from simbench.scenarios.schema import Scenario
from tests.scenarios.small_scenario import small_scenario

_LENS = {"range": [0.5, 0.8]}


def _recipe(**parts: Any) -> Recipe:
    content = small_scenario().model_dump(mode="json", exclude_unset=True) | parts
    return Recipe(content, "mine.yaml")


def _file(folder: Path, **parts: Any) -> Path:
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(dict(_recipe(**parts).content), sort_keys=False))
    return path


def _target(**samples: Any) -> dict[str, Any]:
    return {"lane": 0, "along_m": 40, "speed_mps": 15} | samples


def test_file_without_samples_is_fixed_and_gives_what_load_scenario_gives() -> None:
    recipe = load_recipe("smoke")
    assert recipe.is_fixed
    assert recipe.scenario(0) == recipe.scenario(9) == load_scenario("smoke")


def test_same_seed_gives_the_same_scenario_and_another_seed_another() -> None:
    recipe = _recipe(target=_target(speed_mps={"range": [10, 20]}))
    assert not recipe.is_fixed
    assert recipe.scenario(3) == recipe.scenario(3)
    assert len({recipe.scenario(seed).target.speed_mps for seed in range(20)}) == 20


def test_range_is_uniform_between_its_ends() -> None:
    recipe = _recipe(target=_target(speed_mps={"range": [10, 20]}))
    speeds = [recipe.scenario(seed).target.speed_mps for seed in range(400)]
    assert 10 <= min(speeds) < 10.5
    assert 19.5 < max(speeds) <= 20
    # the mean of 400 samples has a standard error of 10 / sqrt(12) / 20 = 0.144
    assert np.mean(speeds) == pytest.approx(15, abs=0.6)


def test_log_range_gives_every_decade_the_same_share() -> None:
    recipe = _recipe(imaging={"noise": {"range": [0.0001, 0.1], "log": True}})
    noise = [recipe.scenario(seed).imaging.noise for seed in range(400)]
    # a third of the samples a decade, each count with a standard error below 10
    decades = np.histogram(np.log10(noise), bins=[-4, -3, -2, -1])[0]
    assert decades == pytest.approx([133, 133, 133], abs=40)


@pytest.mark.parametrize("log", [False, True])
def test_range_of_whole_numbers_gives_each_of_them_both_ends_included(
    log: bool,
) -> None:
    recipe = _recipe(frames={"range": [2, 5], "log": log})
    frames = [recipe.scenario(seed).frames for seed in range(100)]
    assert set(frames) == {2, 3, 4, 5}
    assert all(type(count) is int for count in frames)


def test_choice_follows_its_weights() -> None:
    colour = {"choice": ["red", "blue", "green"], "weights": [3, 1, 0]}
    recipe = _recipe(target=_target(colour=colour))
    colours = [recipe.scenario(seed).target.colour for seed in range(400)]
    assert set(colours) == {"red", "blue"}
    # 300 expected, with a standard deviation of sqrt(400 * 3/4 * 1/4) = 8.7
    assert colours.count("red") == pytest.approx(300, abs=36)


def test_choice_may_be_between_parts_with_samples() -> None:
    pole = {"along_m": 9, "lateral_m": -20, "width_m": {"range": [0.2, 0.9]}}
    recipe = _recipe(occluders={"choice": [[], [pole]]})
    widths = [
        [occluder.width_m for occluder in recipe.scenario(seed).occluders]
        for seed in range(20)
    ]
    assert [] in widths
    assert len({width for one in widths for width in one}) > 3


def test_sample_elsewhere_does_not_change_a_sample() -> None:
    speed = {"range": [10, 20]}
    one = _recipe(target=_target(speed_mps=speed))
    more = _recipe(
        frames={"range": [3, 9]},
        target=_target(colour={"choice": ["red", "blue"]}, speed_mps=speed),
    )
    for seed in range(5):
        assert one.scenario(seed).target.speed_mps == (
            more.scenario(seed).target.speed_mps
        )


def test_variants_have_the_same_sampled_values(tmp_path: Path) -> None:
    path = _file(
        tmp_path,
        target=_target(speed_mps={"range": [10, 20]}),
        variants={"near": {}, "far": {"camera.fov_rad": 0.1}},
    )
    near, far = load_recipes(f"{path}@all")
    assert near.label == "story-near"
    assert near.scenario(4).target == far.scenario(4).target
    assert near.scenario(4).camera != far.scenario(4).camera


def test_variant_replaces_a_sample_by_another(tmp_path: Path) -> None:
    path = _file(
        tmp_path,
        frames={"range": [3, 100], "log": True},
        variants={"short": {"frames": {"choice": [3, 4]}}},
    )
    assert load_recipe(f"{path}@short").scenario(0).frames in (3, 4)


def test_shortened_recipe_limits_the_sampled_frames() -> None:
    recipe = _recipe(frames={"range": [5, 9]}).shortened(4)
    assert recipe.scenario(0).frames == 4
    assert recipe.digest != _recipe(frames={"range": [5, 9]}).digest


@pytest.mark.parametrize(
    ("sample", "words"),
    [
        pytest.param({"range": [1]}, "range: .* at least 2 items", id="one end"),
        pytest.param({"range": [1, 2, 3]}, "range: .* at most 2", id="three ends"),
        pytest.param({"range": 3}, "range: expected a list", id="no list"),
        pytest.param({"range": [2, 1]}, r"must not fall, got \[2, 1\]", id="falling"),
        pytest.param(
            {"range": ["a", "b"]}, r"range\.0: .* number, got 'a'", id="words"
        ),
        pytest.param({"range": [0, True]}, r"range\.1: .* number", id="boolean"),
        pytest.param({"range": [0, float("nan")]}, r"range\.1: .* finite", id="nan"),
        pytest.param({"range": [0, 10**90]}, r"range\.1: .* at most 1e\+15", id="huge"),
        pytest.param(
            {"range": [0, 1], "log": True}, "above 0 where log", id="log of 0"
        ),
        pytest.param(
            {"range": [1, 2], "log": 1}, "log: .* true or false, got 1", id="log"
        ),
        pytest.param(
            {"range": [1, 2], "weights": [1]}, "weights: unknown key", id="mixture"
        ),
        pytest.param(
            {"range": [1, 2], "choice": [1]}, "choice: unknown key", id="both"
        ),
        pytest.param({"choice": []}, "choice: .* at least 1 item", id="no choice"),
        pytest.param({"choice": "red"}, "choice: expected a list", id="a word"),
        pytest.param(
            {"choice": [1, 2], "weights": [1]}, "weights must be 2 numbers", id="few"
        ),
        pytest.param(
            {"choice": [1, 2], "weights": [1, -1]}, r"weights\.1: ", id="negative"
        ),
        pytest.param(
            {"choice": [1, 2], "weights": [0, 0]}, "must not all be 0", id="no weight"
        ),
        pytest.param(
            {"choice": [1, {"range": 3}]},
            "range: expected a list",
            id="within a choice",
        ),
        pytest.param({"choice": [1, float("nan")]}, "must be finite", id="nan in it"),
        pytest.param({"choice": [{1: 2}]}, "unknown key 1", id="key that is no word"),
    ],
)
def test_invalid_sample_is_an_error_in_one_line_with_its_key(
    tmp_path: Path, sample: dict[str, Any], words: str
) -> None:
    path = _file(tmp_path, target=_target(speed_mps=sample))
    with pytest.raises(ScenarioError) as caught:
        load_recipe(path)
    message = str(caught.value)
    assert re.match(rf"{path}:\d+: target\.speed_mps[.:].*{words}", message), message
    assert "\n" not in message


def test_file_that_is_one_sample_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("choice: [{name: one}, {name: two}]")
    for load in (load_recipe, load_scenario):
        with pytest.raises(
            ScenarioError, match=f"^{path}: a whole file cannot be a sample"
        ):
            load(path)


def test_range_of_a_whole_number_must_be_whole(tmp_path: Path) -> None:
    path = _file(tmp_path, frames={"range": [2.5, 9]})
    with pytest.raises(
        ScenarioError, match=r"frames\.range\.0: .* a whole number, got 2\.5"
    ):
        load_recipe(path)


@pytest.mark.parametrize("key", ["name", "variant"])
def test_name_and_variant_cannot_be_sampled(tmp_path: Path, key: str) -> None:
    path = _file(tmp_path, **{key: {"choice": ["one", "two"]}})
    with pytest.raises(ScenarioError, match=f"{key}: must not be a sample"):
        load_recipe(path)


def test_sampled_value_out_of_range_names_key_value_and_seed() -> None:
    recipe = _recipe(target=_target(speed_mps={"choice": [15, 900]}))
    messages = []
    for seed in range(10):
        try:
            recipe.scenario(seed)
        except ScenarioError as error:
            messages.append(str(error))
    assert 0 < len(messages) < 10
    for message in messages:
        assert message.startswith("mine.yaml: target.speed_mps: ")
        assert "sampled target.speed_mps = 900)" in message


def test_sampled_values_that_are_invalid_together_are_named() -> None:
    recipe = _recipe(target=_target(lane={"choice": [3]}))
    with pytest.raises(ScenarioError) as caught:
        recipe.scenario(7)
    assert str(caught.value) == (
        "mine.yaml: target.lane: must be below road.lanes = 2, got 3 "
        "(seed 7 sampled target.lane = 3)"
    )


def test_mistake_beside_the_samples_is_found_when_the_file_is_read(
    tmp_path: Path,
) -> None:
    path = _file(tmp_path, target=_target(speed_mps={"range": [1, 2]}), lanes=3)
    with pytest.raises(ScenarioError, match=rf"{path}:\d+: lanes: unknown key"):
        load_recipe(path)


def test_sample_without_valid_values_is_found_when_the_file_is_read(
    tmp_path: Path,
) -> None:
    path = _file(tmp_path, target=_target(colour={"range": [1, 2]}))
    with pytest.raises(
        ScenarioError, match=r"target\.colour: .*sampled target\.colour"
    ):
        load_recipe(path)


def test_sample_with_some_valid_values_is_no_mistake_of_the_file(
    tmp_path: Path,
) -> None:
    path = _file(tmp_path, target=_target(lane={"choice": [0, 9]}))
    assert load_recipe(path).name == "story"


def test_a_loaded_scenario_gives_what_the_recipe_gives_for_each_seed(
    tmp_path: Path,
) -> None:
    path = _file(tmp_path, frames={"range": [3, 400]}, camera={"fov_rad": _LENS})
    scenario, recipe = load_scenario(path), load_recipe(path)
    for seed in range(5):
        assert scenario.for_seed(seed) == recipe.scenario(seed)
    assert scenario.for_seed(3).for_seed(4) == scenario.for_seed(3)


def test_a_scenario_with_samples_survives_its_record(tmp_path: Path) -> None:
    scenario = load_scenario(_file(tmp_path, camera={"fov_rad": _LENS}))
    read = Scenario.model_validate(scenario.shortened(7).model_dump(mode="json"))
    assert read.digest == scenario.shortened(7).digest != scenario.digest
    assert read.for_seed(2) == scenario.for_seed(2).shortened(7)


def test_dials_leave_every_sample_as_it_is(tmp_path: Path) -> None:
    scenario = load_scenario(_file(tmp_path, camera={"fov_rad": _LENS}))
    turned = scenario.with_dials({"noise": 0.1}).shortened(5)
    found, plain = turned.for_seed(3), scenario.for_seed(3).shortened(5)
    assert found.dials.noise == 0.1
    assert found.model_copy(update={"dials": plain.dials}) == plain


def test_a_part_replaced_in_python_is_so_for_every_seed(tmp_path: Path) -> None:
    scenario = load_scenario(
        _file(tmp_path, camera={"fov_rad": _LENS, "vibration_px": {"range": [1, 2]}})
    )
    lens = scenario.camera.model_copy(update={"fov_rad": 0.9})
    found = scenario.model_copy(update={"camera": lens}).for_seed(4)
    assert found.camera.fov_rad == 0.9
    assert found.camera.vibration_px == scenario.for_seed(4).camera.vibration_px
    assert scenario.for_seed(4).camera.vibration_px != scenario.camera.vibration_px


def test_a_value_can_follow_another_one(tmp_path: Path) -> None:
    target = {
        "colour": {"choice": ["red", "blue", "green"]},
        "lane": {"choice": [0, 1]},
        "speed_mps": {"range": [18, 22]},
    }
    stranger = {
        "ahead_m": 20,
        "colour": {"same_as": "target.colour"},
        "lane": {"same_as": "target.lane", "times": -1, "plus": 1},
        "speed_mps": {"same_as": "target.speed_mps", "plus": {"range": [1, 2]}},
    }
    recipe = load_recipe(_file(tmp_path, target=target, strangers=[stranger]))
    gains = set()
    for seed in range(12):
        own, (other,) = recipe.scenario(seed).target, recipe.scenario(seed).strangers
        assert other.colour == own.colour
        assert other.lane == 1 - own.lane
        gains.add(other.speed_mps - own.speed_mps)
    assert 1 < min(gains) < max(gains) < 2


@pytest.mark.parametrize(
    ("link", "words"),
    [
        ({"same_as": "target.lene"}, "a key with a value, got 'target.lene'"),
        ({"same_as": "target.colour", "plus": 1}, "a number, got 'target.colour'"),
        ({"same_as": "strangers.0.lane"}, "a key with a value"),
    ],
)
def test_a_link_to_nothing_is_one_line(
    tmp_path: Path, link: dict[str, Any], words: str
) -> None:
    target = {"colour": "red"}
    stranger = {"ahead_m": 20, "lane": link}
    path = _file(tmp_path, target=target, strangers=[stranger])
    with pytest.raises(ScenarioError, match=rf"strangers\.0\.lane: .*{words}"):
        load_recipe(path)


def test_schema_accepts_a_sample_for_any_value_but_the_names() -> None:
    validator = Draft202012Validator(scenario_schema())
    content = dict(_recipe(frames={"range": [3, 9]}).content)
    assert validator.is_valid(content)
    lane = {"choice": [0, 1], "weights": [1, 2]}
    assert validator.is_valid(content | {"target": _target(lane=lane)})
    assert not validator.is_valid(content | {"target": _target(lane={"chioce": [0]})})
    mix = {"mix": {"car": {"range": [1, 2]}}}
    assert validator.is_valid(content | {"traffic": mix, "occluders": [lane]})
    assert not validator.is_valid(content | {"name": {"choice": ["a"]}})


def test_no_part_of_a_scenario_has_a_key_of_a_sample() -> None:
    parts = [part for part in vars(schema).values() if isinstance(part, type)]
    models = [part for part in parts if issubclass(part, BaseModel)]
    assert len(models) > 10
    assert not {"range", "choice"} & {key for m in models for key in m.model_fields}


@pytest.mark.parametrize(
    ("key", "whole"),
    [
        pytest.param("frames", True, id="whole number"),
        pytest.param("imaging.samples", True, id="one of some whole numbers"),
        pytest.param("imaging.jpeg_quality", True, id="whole number or null"),
        pytest.param("strangers.0.lane", True, id="within a list"),
        pytest.param("dials.occlusion.frames", True, id="of a part that may be null"),
        pytest.param("camera.fov_rad", False, id="real number"),
        pytest.param("traffic.mix.car", False, id="within a mapping"),
        pytest.param("target.colour", False, id="word"),
        pytest.param("nowhere.at.all", False, id="unknown"),
    ],
)
def test_keys_of_whole_numbers_are_known(key: str, whole: bool) -> None:
    assert takes_whole_numbers(tuple(key.split("."))) is whole


_NUMBERS = st.floats(-1e6, 1e6) | st.integers(-1000, 1000)
_PLAIN = _NUMBERS | st.text(max_size=5) | st.none() | st.booleans()
_ANY_SAMPLE = st.fixed_dictionaries(
    {},
    optional={
        "range": st.lists(_PLAIN, max_size=3) | _PLAIN,
        "choice": st.lists(_PLAIN, max_size=3) | _PLAIN,
        "weights": st.lists(_PLAIN, max_size=3) | _PLAIN,
        "log": _PLAIN,
    },
)


# the first text makes a table of Unicode, which is slow
@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(sample=_ANY_SAMPLE, seed=st.integers(0, 2**40))
def test_any_sample_has_a_value_or_is_refused_in_one_line(
    sample: dict[str, Any], seed: int
) -> None:
    content = {"camera": {"fov_rad": sample}}
    try:
        found = samples_in(content, "mine.yaml")
        filled, values = resolve_samples(content, "mine", seed, "mine.yaml")
    except ScenarioError as error:
        assert "\n" not in str(error)
        return
    assert set(values) == set(found)
    value = filled["camera"]["fov_rad"]
    if "range" in sample:
        low, high = sample["range"]
        assert low <= value <= high
    elif "choice" in sample:
        assert value in sample["choice"]
    else:
        assert value == sample
