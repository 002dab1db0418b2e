from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.library import list_scenarios
from simbench.scenarios.files.loading import load_scenario, scenario_schema
from tests.scenarios.small_scenario import small_scenario


def _write(folder: Path, text: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def _smoke_with(folder: Path, **changes: object) -> Path:
    content = load_scenario("smoke").model_dump(mode="json") | changes
    return _write(folder, yaml.safe_dump(content))


@pytest.mark.parametrize("name", list_scenarios())
def test_every_library_scenario_loads_and_is_named_as_its_file(name: str) -> None:
    assert load_scenario(name).name == name


def test_library_has_the_first_five_scenarios() -> None:
    expected = {"smoke", "free-flow", "lane-change", "poles", "bridge"}
    assert expected <= set(list_scenarios())


def test_a_path_loads_as_a_name_does(tmp_path: Path) -> None:
    path = _smoke_with(tmp_path)
    assert load_scenario(path).digest == load_scenario("smoke").digest


def test_unknown_scenario_suggests_the_nearest() -> None:
    with pytest.raises(ScenarioError, match=r"unknown scenario 'pole'.*'poles'"):
        load_scenario("pole")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        pytest.param({"lanes": 3}, ["lanes", "unknown key", "3"], id="unknown key"),
        pytest.param(
            {"camera": {"fov_rad": 4.2}}, ["camera.fov_rad", "4.2"], id="out of range"
        ),
        pytest.param({"frames": "many"}, ["frames", "number", "many"], id="a word"),
        pytest.param({"frames": "4"}, ["frames", "number", "'4'"], id="quoted number"),
        pytest.param({"frames": True}, ["frames", "number", "True"], id="a boolean"),
        pytest.param(
            {"traffic": {"mix": {"car": "4"}}},
            ["traffic", "mix.car", "number", "'4'"],
            id="quoted number in a mapping",
        ),
        pytest.param(
            {"traffic": {"mix": {"car": 4, "van": True}}},
            ["traffic", "mix.van", "number", "True"],
            id="a boolean in a mapping",
        ),
        pytest.param(
            {"imaging": {"samples": True}},
            ["imaging", "samples", "number", "True"],
            id="a boolean for one of some numbers",
        ),
        pytest.param(
            {
                "target": {
                    "lane": 0,
                    "manoeuvres": [{"at_s": 0, "change_lane": "right"}],
                }
            },
            ["target.manoeuvres", "lane -1"],
            id="lane change off the road",
        ),
        pytest.param(
            {"target": {"manoeuvres": [{"at_s": 9, "change_lane": "left"}]}},
            ["target.manoeuvres.0.at_s", "0.92"],
            id="manoeuvre after the end",
        ),
        pytest.param(
            {"target": {"lane": 5}},
            ["target.lane", "road.lanes = 2"],
            id="no such lane",
        ),
        pytest.param(
            {"target": {"along_m": 1e4}}, ["target.along_m"], id="off the road"
        ),
        pytest.param(
            {"occluders": [{"kind": "pole", "along_m": 4}]},
            ["occluders.0", "either"],
            id="half a place",
        ),
        pytest.param(
            {"target": {"manoeuvres": [{"at_s": 1}]}},
            ["manoeuvres.0", "exactly one"],
            id="empty manoeuvre",
        ),
        pytest.param(
            {"camera": {"fov_rad": float("nan")}}, ["camera.fov_rad"], id="nan"
        ),
    ],
)
def test_a_mistake_is_one_line_with_file_and_key(
    tmp_path: Path, changes: dict[str, object], words: list[str]
) -> None:
    path = _smoke_with(tmp_path, **changes)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in [str(path), *words]), message


@pytest.mark.parametrize(
    ("text", "word"),
    [
        pytest.param("a: [1", "not YAML", id="broken"),
        pytest.param("a: 1\na: 2", "duplicate key 'a'", id="duplicate key"),
        pytest.param("- 1\n- 2", "mapping", id="list"),
        pytest.param("", "mapping", id="empty"),
        pytest.param("name: x", "required but missing", id="incomplete"),
        pytest.param("a: !!timestamp foo", "'foo' is no timestamp", id="no time"),
        pytest.param("a: 2026-13-45", "'2026-13-45' is no timestamp", id="no day"),
        pytest.param("a: !!bool foo", "'foo' is no bool", id="no boolean"),
        pytest.param("a: !!int ''", "'' is no int", id="no whole number"),
        pytest.param("a: !!float ''", "'' is no float", id="no number"),
        pytest.param('a: "\\UFFFFFFFF"', "not YAML", id="no character"),
        pytest.param("? [1]\n: 2", "cannot be a key", id="list as a key"),
        pytest.param("a: {<<: 3}", "mappings for merging", id="merge of a number"),
        pytest.param(
            "a: &a {b: 1}\nc: {<<: *a, d: 1, d: 2}",
            "duplicate key 'd'",
            id="duplicate key beside a merge",
        ),
    ],
)
def test_text_that_is_no_scenario_is_refused_in_one_line(
    tmp_path: Path, text: str, word: str
) -> None:
    with pytest.raises(ScenarioError, match=word) as caught:
        load_scenario(_write(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_a_merged_mapping_gives_what_its_own_keys_do_not(tmp_path: Path) -> None:
    text = """
name: merged
title: t
tests: t
frames: 9
camera:
  position: &place {along_m: 1, lateral_m: -7, height_m: 3}
  look_at: &other {<<: *place, height_m: 2}
occluders: [{<<: *other, kind: pole, along_m: 9}]
"""
    scenario = load_scenario(_write(tmp_path, text))
    place, pole = scenario.camera.look_at, scenario.occluders[0]
    assert (place.along_m, place.lateral_m, place.height_m) == (1, -7, 2)
    assert (pole.along_m, pole.lateral_m) == (9, -7)


def test_merges_of_merges_do_not_grow_exponentially(tmp_path: Path) -> None:
    ends = [
        f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}]}}" for n in range(1, 9)
    ]
    path = _write(tmp_path, "\n".join(["a0: &a0 {b: 1, c: 2}", *ends]))
    with pytest.raises(ScenarioError, match="required but missing"):
        load_scenario(path)


@pytest.mark.parametrize("name", ["x" * 300, "x" * 300 + "@far", "./x\0.yaml"])
def test_a_name_that_no_file_can_have_is_one_line(name: str) -> None:
    with pytest.raises(ScenarioError, match=r"^(unknown scenario|.*cannot be read)"):
        load_scenario(name)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"gone\.yaml: cannot be read"):
        load_scenario(tmp_path / "gone.yaml")


def test_the_schema_accepts_the_library_and_refuses_an_unknown_key() -> None:
    validator = Draft202012Validator(scenario_schema())
    content = load_scenario("poles").for_seed(0).model_dump(mode="json")
    assert validator.is_valid(content)
    assert not validator.is_valid(content | {"lanes": 3})


def test_digest_changes_with_any_value_and_not_with_key_order() -> None:
    one = small_scenario(frames=3)
    assert one.digest == small_scenario(frames=3).digest
    assert one.digest != small_scenario(frames=4).digest


def test_shortened_never_lengthens() -> None:
    assert small_scenario(frames=5).shortened(3).frames == 3
    assert small_scenario(frames=5).shortened(9).frames == 5


def test_shortened_removes_later_occluders() -> None:
    later = {"hides_at_s": 0.2, "distance_m": 9}
    always = {"along_m": 9, "lateral_m": -20}
    cut = small_scenario(frames=9, occluders=[later, always]).shortened(3)
    assert [occluder.along_m for occluder in cut.occluders] == [9]


def test_shortened_requests_no_occlusion_by_removed_occluders() -> None:
    first = {"hides_at_s": 0.1, "distance_m": 9}
    second = {"hides_at_s": 0.3, "distance_m": 9}
    dials = {"target_px": 30, "occlusion": {"hidden": 0.5, "count": 2}}
    whole = small_scenario(frames=9, occluders=[first, second], dials=dials)
    assert whole.shortened(9).dials.flat()["occlusion.count"] == 2
    assert whole.shortened(6).dials.flat() == {"target_px": 30, "occlusion.hidden": 0.5}
    assert whole.shortened(2).dials.flat() == {"target_px": 30}


@pytest.mark.parametrize(
    "text",
    [
        "frames: &a [*a]",
        "frames: &a {x: *a}",
        "\n".join(
            ["a0: &a0 [0, 0, 0, 0, 0, 0, 0, 0, 0]"]
            + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
        ),
    ],
    ids=["list in itself", "mapping in itself", "nine to the ninth"],
)
def test_endless_aliases_are_an_error_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "endless.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert "\n" not in str(caught.value)


def test_dials_that_are_not_set_are_not_requested() -> None:
    dials = {"occlusion": {"hidden": 0.5, "frames": 4}}
    flat = small_scenario(dials=dials).dials.flat()
    assert flat == {"occlusion.hidden": 0.5, "occlusion.frames": 4}
