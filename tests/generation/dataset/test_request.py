"""What is asked of a data set: how sequences spread, what they are called and keyed."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.core.errors import SimbenchError
from simbench.generation.dataset.request import Batch, DatasetRequest, spread
from simbench.scenarios.files.recipe import Recipe
from simbench.scenarios.schema.sumo_config import placed
from tests.generation.dataset.small_recipe import small_recipe

CROSSING = Path(__file__).parents[2] / "scenarios" / "network" / "crossing"
ONE, TWO, THREE = (small_recipe(name) for name in ("one", "two", "three"))


def test_count_is_spread_evenly_with_seeds_counted_up() -> None:
    batches = spread([ONE, TWO, THREE], 7, first_seed=10)
    assert [list(b.seeds) for b in batches] == [[10, 11, 12], [10, 11], [10, 11]]


@given(count=st.integers(1, 60), kinds=st.integers(1, 3))
def test_spread_is_whole_and_even(count: int, kinds: int) -> None:
    batches = spread([ONE, TWO, THREE][:kinds], count)
    sizes = [len(batch.seeds) for batch in batches]
    assert sum(sizes) == count
    assert max(sizes) - min(sizes) <= 1


def test_scenarios_take_turns() -> None:
    wanted = DatasetRequest(spread([ONE, TWO], 3))
    assert [wish.name for wish in wanted] == ["one-0000", "two-0000", "one-0001"]
    assert len(wanted) == 3


def test_layout_may_give_names_of_its_own() -> None:
    names = [wish.name for wish in DatasetRequest(spread([ONE], 3), "otb")]
    assert len(set(names)) == 3
    assert "one-0000" not in names


def test_key_follows_all_that_makes_a_sequence() -> None:
    frames = small_recipe("one", frames=3)
    keys = [
        next(iter(wanted)).key
        for wanted in (
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
            id="drawn",
        ),
    ],
)
def test_key_follows_what_files_hold_and_not_where_they_lie(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, road: dict[str, Any]
) -> None:
    keys = []
    for place in ("here", "there"):
        shutil.copytree(CROSSING, tmp_path / place)
        monkeypatch.chdir(tmp_path / place)
        keys.append(_key_on(placed(road, tmp_path / place)))
    assert keys[0] == keys[1]
    routes = Path("crossing.rou.xml")
    routes.write_text(routes.read_text() + "<!-- otherwise -->")
    changed = _key_on(placed(road, tmp_path / "there"))
    assert changed != keys[1]
    shutil.rmtree(tmp_path / "there")  # a mistake of the scenario's, told when drawn
    assert _key_on(placed(road, tmp_path / "there")) != changed


def test_key_is_the_same_whatever_else_is_asked() -> None:
    few = {wish.name: wish.key for wish in DatasetRequest(spread([ONE], 2))}
    many = {wish.name: wish.key for wish in DatasetRequest(spread([TWO, ONE], 9))}
    assert few.items() <= many.items()


def test_variant_is_part_of_a_name_that_any_table_can_hold() -> None:
    recipe = small_recipe("one", variant="noise=0.1, far")
    (wish,) = DatasetRequest(spread([recipe], 1))
    assert wish.name == "one-noise-0-1-far-0000"


@pytest.mark.parametrize(
    ("batches", "layout", "words"),
    [
        pytest.param((), "native", "at least one", id="nothing"),
        pytest.param(spread([ONE, ONE], 2), "native", "'one' more than", id="twice"),
        pytest.param((Batch(ONE, (1, 1)),), "native", "seeds must differ", id="seeds"),
        pytest.param(spread([ONE], 1), "nosuch", "unknown format", id="layout"),
    ],
)
def test_what_cannot_be_a_data_set_is_refused_in_one_line(
    batches: tuple[Batch, ...], layout: str, words: str
) -> None:
    with pytest.raises(SimbenchError, match=words):
        DatasetRequest(batches, layout)
