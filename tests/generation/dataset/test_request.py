"""Requests for data sets: the seeds, names and keys of their sequences."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.core.errors import SimbenchError
from simbench.generation.dataset.request import DatasetRequest, SeededRecipe, spread
from simbench.scenarios.files.recipe import Recipe
from simbench.scenarios.schema.sumo_config import with_absolute_paths
from tests.generation.dataset.small_recipe import small_recipe

CROSSING = Path(__file__).parents[2] / "scenarios" / "network" / "crossing"
ONE, TWO, THREE = (small_recipe(name) for name in ("one", "two", "three"))


def test_count_is_spread_evenly_with_consecutive_seeds() -> None:
    recipes = spread([ONE, TWO, THREE], 7, first_seed=10)
    assert [list(seeds) for _, seeds in recipes] == [[10, 11, 12], [10, 11], [10, 11]]


@given(count=st.integers(1, 60), kinds=st.integers(1, 3))
def test_spread_is_complete_and_even(count: int, kinds: int) -> None:
    recipes = spread([ONE, TWO, THREE][:kinds], count)
    sizes = [len(seeds) for _, seeds in recipes]
    assert sum(sizes) == count
    assert max(sizes) - min(sizes) <= 1


def test_scenarios_take_turns() -> None:
    request = DatasetRequest(spread([ONE, TWO], 3))
    assert [sequence.name for sequence in request] == [
        "one-0000",
        "two-0000",
        "one-0001",
    ]
    assert len(request) == 3


def test_layout_may_give_names_of_its_own() -> None:
    names = [sequence.name for sequence in DatasetRequest(spread([ONE], 3), "otb")]
    assert len(set(names)) == 3
    assert "one-0000" not in names


def test_key_depends_on_all_that_decides_a_sequence() -> None:
    frames = small_recipe("one", frames=3)
    keys = [
        next(iter(request)).key
        for request in (
            DatasetRequest(spread([ONE], 1)),
            DatasetRequest(spread([ONE], 1, first_seed=1)),
            DatasetRequest(spread([ONE.shortened(1)], 1)),
            DatasetRequest(spread([frames], 1)),
            DatasetRequest(spread([ONE], 1), "vot"),
            DatasetRequest(spread([ONE], 1), "got10k"),
            DatasetRequest(spread([ONE], 1), "got10k", "train"),
            DatasetRequest(spread([ONE], 1), "got10k", channels=("depth",)),
        )
    ]
    assert max(Counter(keys).values()) == 1


def _key_on(road: dict[str, Any]) -> str:
    content = dict(ONE.content) | {"road": road}
    return next(iter(DatasetRequest(spread([Recipe(content, "one.yaml")], 1)))).key


@pytest.mark.parametrize(
    "road",
    [
        pytest.param({"sumo": "crossing.sumocfg"}, id="configuration"),
        pytest.param(
            {"sumo": "crossing.net.xml", "routes": "crossing.rou.xml"}, id="network"
        ),
        pytest.param(
            {"choice": [{"sumo": {"choice": ["crossing.sumocfg"]}, "begin_s": 3}]},
            id="sampled",
        ),
    ],
)
def test_key_depends_on_the_content_of_files_not_on_their_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, road: dict[str, Any]
) -> None:
    keys = []
    for place in ("here", "there"):
        shutil.copytree(CROSSING, tmp_path / place)
        monkeypatch.chdir(tmp_path / place)
        keys.append(_key_on(with_absolute_paths(road, tmp_path / place)))
    assert keys[0] == keys[1]
    routes = Path("crossing.rou.xml")
    routes.write_text(routes.read_text() + "<!-- changed -->")
    changed = _key_on(with_absolute_paths(road, tmp_path / "there"))
    assert changed != keys[1]
    shutil.rmtree(
        tmp_path / "there"
    )  # an error of the scenario, reported when it is made
    assert _key_on(with_absolute_paths(road, tmp_path / "there")) != changed


def test_key_is_the_same_whatever_else_is_requested() -> None:
    few = {sequence.name: sequence.key for sequence in DatasetRequest(spread([ONE], 2))}
    many = {
        sequence.name: sequence.key
        for sequence in DatasetRequest(spread([TWO, ONE], 9))
    }
    assert few.items() <= many.items()


def test_variant_is_part_of_a_name_that_any_table_can_hold() -> None:
    recipe = small_recipe("one", variant="noise=0.1, far")
    (sequence,) = DatasetRequest(spread([recipe], 1))
    assert sequence.name == "one-noise-0-1-far-0000"


@pytest.mark.parametrize(
    ("recipes", "layout", "words"),
    [
        pytest.param((), "native", "at least one", id="empty"),
        pytest.param(
            spread([ONE, ONE], 2), "native", "'one' more than", id="duplicate"
        ),
        pytest.param(
            (SeededRecipe(ONE, (1, 1)),), "native", "seeds must differ", id="seeds"
        ),
        pytest.param(spread([ONE], 1), "nosuch", "unknown format", id="layout"),
    ],
)
def test_impossible_data_set_is_refused_in_one_line(
    recipes: tuple[SeededRecipe, ...], layout: str, words: str
) -> None:
    with pytest.raises(SimbenchError, match=words):
        DatasetRequest(recipes, layout)
