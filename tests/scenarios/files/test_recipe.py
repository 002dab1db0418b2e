"""Recipes: draws by seed, the same for the same seed, every mistake in one line."""

from __future__ import annotations

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
from simbench.scenarios.files.loading import load_scenario, scenario_schema
from simbench.scenarios.files.recipe import Recipe, load_recipe, load_recipes
from simbench.scenarios.files.sample_schema import takes_whole_numbers
from simbench.scenarios.files.samples import drawn, samples_in
from tests.scenarios.stories import story


def _recipe(**parts: Any) -> Recipe:
    content = story().model_dump(mode="json", exclude_unset=True) | parts
    return Recipe(content, "mine.yaml")


def _file(folder: Path, **parts: Any) -> Path:
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(dict(_recipe(**parts).content), sort_keys=False))
    return path


def _target(**draws: Any) -> dict[str, Any]:
    return {"lane": 0, "along_m": 40, "speed_mps": 15} | draws


def test_file_without_draws_is_fixed_and_gives_what_load_scenario_gives() -> None:
    recipe = load_recipe("smoke")
    assert recipe.is_fixed
    assert recipe.scenario(0) == recipe.scenario(9) == load_scenario("smoke")


def test_same_seed_draws_the_same_scenario_and_another_seed_another() -> None:
    recipe = _recipe(target=_target(speed_mps={"range": [10, 20]}))
    assert not recipe.is_fixed
    assert recipe.scenario(3) == recipe.scenario(3)
    assert len({recipe.scenario(seed).target.speed_mps for seed in range(20)}) == 20


def test_range_is_even_between_its_ends() -> None:
    recipe = _recipe(target=_target(speed_mps={"range": [10, 20]}))
    speeds = [recipe.scenario(seed).target.speed_mps for seed in range(400)]
    assert 10 <= min(speeds) < 10.5
    assert 19.5 < max(speeds) <= 20
    # the mean of 400 draws has a standard error of 10 / sqrt(12) / 20 = 0.144
    assert np.mean(speeds) == pytest.approx(15, abs=0.6)


def test_log_range_gives_every_decade_as_much() -> None:
    recipe = _recipe(imaging={"noise": {"range": [0.0001, 0.1], "log": True}})
    noise = [recipe.scenario(seed).imaging.noise for seed in range(400)]
    # a third of the draws a decade, each count with a standard error below 10
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
    draw = {"choice": ["red", "blue", "green"], "weights": [3, 1, 0]}
    recipe = _recipe(target=_target(colour=draw))
    colours = [recipe.scenario(seed).target.colour for seed in range(400)]
    assert set(colours) == {"red", "blue"}
    # 300 expected, with a standard deviation of sqrt(400 * 3/4 * 1/4) = 8.7
    assert colours.count("red") == pytest.approx(300, abs=36)


def test_choice_may_be_between_parts_that_hold_draws() -> None:
    pole = {"along_m": 9, "lateral_m": -20, "width_m": {"range": [0.2, 0.9]}}
    recipe = _recipe(occluders={"choice": [[], [pole]]})
    widths = [
        [occluder.width_m for occluder in recipe.scenario(seed).occluders]
        for seed in range(20)
    ]
    assert [] in widths
    assert len({width for one in widths for width in one}) > 3


def test_draw_elsewhere_leaves_a_draw_as_it_was() -> None:
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


def test_variants_draw_alike(tmp_path: Path) -> None:
    path = _file(
        tmp_path,
        target=_target(speed_mps={"range": [10, 20]}),
        variants={"near": {}, "far": {"camera.fov_rad": 0.1}},
    )
    near, far = load_recipes(f"{path}@all")
    assert near.label == "story-near"
    assert near.scenario(4).target == far.scenario(4).target
    assert near.scenario(4).camera != far.scenario(4).camera


def test_variant_puts_its_draw_in_the_place_of_another(tmp_path: Path) -> None:
    path = _file(
        tmp_path,
        frames={"range": [3, 100], "log": True},
        variants={"short": {"frames": {"choice": [3, 4]}}},
    )
    assert load_recipe(f"{path}@short").scenario(0).frames in (3, 4)


def test_shortened_recipe_cuts_what_it_draws() -> None:
    recipe = _recipe(frames={"range": [5, 9]}).shortened(4)
    assert recipe.scenario(0).frames == 4
    assert recipe.digest != _recipe(frames={"range": [5, 9]}).digest


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        pytest.param({"range": [1]}, "range must be two numbers", id="one end"),
        pytest.param({"range": [2, 1]}, "range must not fall", id="falling"),
        pytest.param({"range": ["a", "b"]}, "two numbers", id="words"),
        pytest.param({"range": [0, float("nan")]}, "two numbers", id="nan"),
        pytest.param({"range": [0, 10**400]}, "two numbers", id="huge"),
        pytest.param(
            {"range": [0, 1], "log": True}, "above 0 where log", id="log of 0"
        ),
        pytest.param({"range": [1, 2], "log": 1}, "log must be true", id="log"),
        pytest.param({"range": [1, 2], "weights": [1]}, "'weights'", id="mixture"),
        pytest.param({"range": [1, 2], "choice": [1]}, "'choice'", id="both"),
        pytest.param({"choice": []}, "list of at least one value", id="nothing"),
        pytest.param({"choice": "red"}, "choice must be a list", id="no list"),
        pytest.param(
            {"choice": [1, 2], "weights": [1]}, "weights must be 2", id="few weights"
        ),
        pytest.param(
            {"choice": [1, 2], "weights": [1, -1]}, "weights must be 2", id="negative"
        ),
        pytest.param(
            {"choice": [1, 2], "weights": [0, 0]}, "must not all be 0", id="no weight"
        ),
        pytest.param(
            {"choice": [1, {"range": 3}]}, "two numbers", id="within a choice"
        ),
        pytest.param({"choice": [1, float("nan")]}, "must be finite", id="nan in it"),
        pytest.param({"choice": [{1: 2}]}, "unknown key 1", id="key that is no word"),
    ],
)
def test_draw_that_cannot_be_drawn_from_is_one_line_with_its_key(
    tmp_path: Path, draw: dict[str, Any], words: str
) -> None:
    path = _file(tmp_path, target=_target(speed_mps=draw))
    with pytest.raises(ScenarioError) as caught:
        load_recipe(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: target.speed_mps: ")
    assert words in message
    assert "\n" not in message


def test_file_that_is_one_draw_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("choice: [{name: one}, {name: two}]")
    for load in (load_recipe, load_scenario):
        with pytest.raises(
            ScenarioError, match=f"^{path}: must not be drawn as a whole"
        ):
            load(path)


def test_range_of_a_whole_number_must_be_whole(tmp_path: Path) -> None:
    path = _file(tmp_path, frames={"range": [2.5, 9]})
    with pytest.raises(ScenarioError, match=r"frames: range must be whole numbers"):
        load_recipe(path)


@pytest.mark.parametrize("key", ["name", "variant"])
def test_what_names_sequences_cannot_be_drawn(tmp_path: Path, key: str) -> None:
    path = _file(tmp_path, **{key: {"choice": ["one", "two"]}})
    with pytest.raises(ScenarioError, match=f"{key} must not be drawn"):
        load_recipe(path)


def test_drawn_value_out_of_range_names_key_value_and_seed() -> None:
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
        assert "drew target.speed_mps = 900)" in message


def test_drawn_values_that_do_not_go_together_are_named() -> None:
    recipe = _recipe(target=_target(lane={"choice": [3]}))
    with pytest.raises(ScenarioError) as caught:
        recipe.scenario(7)
    assert str(caught.value) == (
        "mine.yaml: target.lane must be below road.lanes = 2, got 3 "
        "(seed 7 drew target.lane = 3)"
    )


def test_mistake_beside_the_draws_is_found_when_the_file_is_read(
    tmp_path: Path,
) -> None:
    path = _file(tmp_path, target=_target(speed_mps={"range": [1, 2]}), lanes=3)
    with pytest.raises(ScenarioError, match=f"{path}: lanes: unknown key"):
        load_recipe(path)


def test_draw_of_which_nothing_is_valid_is_found_when_the_file_is_read(
    tmp_path: Path,
) -> None:
    path = _file(tmp_path, target=_target(colour={"range": [1, 2]}))
    with pytest.raises(ScenarioError, match=r"target\.colour: .*drew target\.colour"):
        load_recipe(path)


def test_draw_of_which_some_are_valid_is_no_mistake_of_the_file(tmp_path: Path) -> None:
    path = _file(tmp_path, target=_target(lane={"choice": [0, 9]}))
    assert load_recipe(path).name == "story"


def test_load_scenario_refuses_draws_in_one_line(tmp_path: Path) -> None:
    path = _file(tmp_path, frames={"range": [3, 4]})
    with pytest.raises(ScenarioError, match=r"frames is drawn anew for each seed"):
        load_scenario(path)


def test_schema_takes_a_draw_for_any_value_but_the_names() -> None:
    validator = Draft202012Validator(scenario_schema())
    content = dict(_recipe(frames={"range": [3, 9]}).content)
    assert validator.is_valid(content)
    lane = {"choice": [0, 1], "weights": [1, 2]}
    assert validator.is_valid(content | {"target": _target(lane=lane)})
    assert not validator.is_valid(content | {"target": _target(lane={"chioce": [0]})})
    assert not validator.is_valid(content | {"name": {"choice": ["a"]}})


def test_no_part_of_a_scenario_has_a_key_that_means_a_draw() -> None:
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
def test_schema_knows_where_whole_numbers_stand(key: str, whole: bool) -> None:
    assert takes_whole_numbers(tuple(key.split("."))) is whole


_NUMBERS = st.floats(-1e6, 1e6) | st.integers(-1000, 1000)
_PLAIN = _NUMBERS | st.text(max_size=5) | st.none() | st.booleans()
_ANY_DRAW = st.fixed_dictionaries(
    {},
    optional={
        "range": st.lists(_PLAIN, max_size=3) | _PLAIN,
        "choice": st.lists(_PLAIN, max_size=3) | _PLAIN,
        "weights": st.lists(_PLAIN, max_size=3) | _PLAIN,
        "log": _PLAIN,
    },
)


# the first text drawn makes a table of Unicode, which takes its time
@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(draw=_ANY_DRAW, seed=st.integers(0, 2**40))
def test_any_draw_is_drawn_or_refused_in_one_line(
    draw: dict[str, Any], seed: int
) -> None:
    content = {"camera": {"fov_rad": draw}}
    try:
        found = samples_in(content, "mine.yaml")
        filled, values = drawn(content, "mine", seed, "mine.yaml")
    except ScenarioError as error:
        assert "\n" not in str(error)
        return
    assert set(values) == set(found)
    value = filled["camera"]["fov_rad"]
    if "range" in draw:
        low, high = draw["range"]
        assert low <= value <= high
    elif "choice" in draw:
        assert value in draw["choice"]
    else:
        assert value == draw
