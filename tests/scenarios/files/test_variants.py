from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.loading import (
    load_scenario,
    load_variants,
    read_raw_scenario,
    variants_of,
)
from tests.scenarios.small_scenario import small_scenario


def _file(folder: Path, variants: object) -> Path:
    content = small_scenario(frames=9).model_dump(mode="json") | {"variants": variants}
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def test_a_variant_changes_what_it_names_and_nothing_else(tmp_path: Path) -> None:
    path = _file(tmp_path, {"far": {"camera.fov_rad": 0.1, "frames": 5}})
    base, far = load_scenario(path), load_scenario(f"{path}@far")
    assert (base.variant, far.variant) == ("", "far")
    assert (far.camera.fov_rad, far.frames) == (0.1, 5)
    camera = far.camera.model_copy(update={"fov_rad": base.camera.fov_rad})
    update = {"camera": camera, "frames": base.frames, "variant": ""}
    assert far.model_copy(update=update) == base


def test_nested_and_dotted_keys_mean_the_same(tmp_path: Path) -> None:
    nested = {"camera": {"look_at": {"along_m": 50}, "fov_rad": 0.3}}
    dotted = {"camera.look_at.along_m": 50, "camera.fov_rad": 0.3}
    path = _file(tmp_path, {"nested": nested, "dotted": dotted})
    one, other = load_scenario(f"{path}@nested"), load_scenario(f"{path}@dotted")
    assert one.camera == other.camera
    assert one.camera.look_at.lateral_m == load_scenario(path).camera.look_at.lateral_m


def test_a_list_is_replaced_as_a_whole(tmp_path: Path) -> None:
    pole = {"along_m": 9, "lateral_m": -20}
    path = _file(tmp_path, {"poles": {"occluders": [pole, pole]}, "bare": None})
    assert len(load_scenario(f"{path}@poles").occluders) == 2
    assert load_scenario(f"{path}@bare").occluders == ()


def test_a_variant_changes_one_of_two_places_with_one_alias(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("""
name: mine
title: t
tests: t
frames: 9
camera: {position: &place {along_m: 1, height_m: 3}, look_at: *place}
variants: {back: {camera.position.along_m: -50}}
""")
    camera = load_scenario(f"{path}@back").camera
    assert (camera.position.along_m, camera.look_at.along_m) == (-50, 1)
    raw = read_raw_scenario(path)["camera"]
    assert raw["position"] is not raw["look_at"]


def test_raw_content_is_a_new_mapping_each_time(tmp_path: Path) -> None:
    path = _file(tmp_path, {"far": {"camera.fov_rad": 0.1}})
    raw = read_raw_scenario(f"{path}@far")
    assert (raw["variant"], "variants" in raw) == ("far", False)
    raw["camera"]["fov_rad"] = 2.0
    assert read_raw_scenario(f"{path}@far")["camera"]["fov_rad"] == 0.1


def test_all_stands_for_every_variant_in_the_files_order(tmp_path: Path) -> None:
    path = _file(tmp_path, {"second": {}, "first": {"frames": 4}})
    assert variants_of(path) == ["second", "first"]
    for word in ("all", "*"):
        found = load_variants(f"{path}@{word}")
        assert [(s.variant, s.frames) for s in found] == [("second", 9), ("first", 4)]
    assert [s.variant for s in load_variants(path)] == [""]


def test_a_file_may_have_an_at_in_its_name(tmp_path: Path) -> None:
    path = _file(tmp_path, {"far": {}}).rename(tmp_path / "mine@home.yaml")
    assert load_scenario(path).variant == ""
    assert load_scenario(f"{path}@far").variant == "far"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        pytest.param("smoke@fast", ["smoke", "'fast'", "none"], id="has none"),
        pytest.param(
            "car-rear-still@xtreme",
            ["'xtreme'", "standard", "medium", "extreme"],
            id="another name",
        ),
        pytest.param("smoke@", ["smoke@", "after the @"], id="no name"),
        pytest.param("smok@fast", ["'smok'", "'smoke'"], id="no such scenario"),
        pytest.param("smoke@all", ["smoke", "no variants"], id="all of none"),
    ],
)
def test_an_unknown_variant_is_an_error_in_one_line_with_the_existing_ones(
    name: str, words: list[str]
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load_variants(name)
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in words), message


@pytest.mark.parametrize(
    ("variants", "words"),
    [
        pytest.param([1], ["variants", "mapping", "list"], id="a list"),
        pytest.param({"far": 3}, ["variants.far", "mapping", "int"], id="a number"),
        pytest.param({"Far Off": {}}, ["variants", "'Far Off'"], id="a bad name"),
        pytest.param({"all": {}}, ["variants", "'all'"], id="the reserved name"),
        pytest.param(
            {"far": {"name": "x"}}, ["far", "must not change name"], id="name"
        ),
        pytest.param(
            {"far": {"tests": "x"}}, ["far", "must not change tests"], id="tests"
        ),
        pytest.param(
            {"far": {"variants": {}}}, ["must not change variants"], id="variants"
        ),
        pytest.param(
            {"far": {"camera": {"fov_rad": 1}, "camera.fov_rad": 2}},
            ["variants.far.camera.fov_rad", "twice"],
            id="the same key twice",
        ),
        pytest.param(
            {"far": {"camera": 1, "camera.fov_rad": 2}},
            ["variants.far.camera", "twice"],
            id="a key and a part of it",
        ),
        pytest.param(
            {"far": {"camera.fov": 2}}, ["camera.fov", "unknown key"], id="unknown key"
        ),
    ],
)
def test_a_mistake_in_a_variant_is_one_line_with_file_and_key(
    tmp_path: Path, variants: object, words: list[str]
) -> None:
    path = _file(tmp_path, variants)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(f"{path}@far")
    message = str(caught.value)
    assert "\n" not in message
    assert all(word in message for word in [str(path), *words]), message
