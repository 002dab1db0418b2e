"""What stands already: kept if whole and the same, refused, replaced or cleared if not.

The sequences are files that nobody filmed, the data set is a folder.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from simbench.core.errors import DatasetError
from simbench.datasets.store import FolderStore
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, spread
from simbench.generation.dataset.resume import (
    ExistingSequences,
    find_existing,
    require_same,
    tidy,
)
from simbench.scenarios.files.recipe import Recipe
from tests.datasets.entries import KEY, put_entry, put_file
from tests.generation.dataset.small_recipe import small_recipe

WANTED = DatasetRequest(spread([small_recipe()], 2))
KEYS = {wish.name: wish.key for wish in WANTED}
FIRST = KEYS["small-0000"]


class TestSurvey:
    """Nothing is changed by looking."""

    def test_finds_what_is_whole_made_otherwise_and_damaged(
        self, tmp_path: Path
    ) -> None:
        wanted = DatasetRequest(spread([small_recipe()], 4))
        keys = {wish.name: wish.key for wish in wanted}
        put_entry(tmp_path, "small-0000", keys["small-0000"])
        put_entry(tmp_path, "other-0000")
        stale = put_entry(tmp_path, "small-0001")
        damaged = f"entries/small-0002.{keys['small-0002']}.json"
        put_file(tmp_path, damaged, "")  # as a dying machine may leave it
        replaced = {"small-0001": [stale], "small-0002": [damaged]}
        found = find_existing(FolderStore(tmp_path), wanted)
        assert found == ExistingSequences({"small-0000"}, replaced, ["small-0001"])

    def test_makes_a_sequence_with_two_entries_again(self, tmp_path: Path) -> None:
        both = {put_entry(tmp_path, "small-0000", key) for key in (KEY, FIRST)}
        found = find_existing(FolderStore(tmp_path), WANTED)
        assert found.finished == set()
        assert set(found.replaced["small-0000"]) == both

    def test_names_a_damaged_entry_that_will_not_be_made_again(
        self, tmp_path: Path
    ) -> None:
        put_file(tmp_path, f"entries/other-0000.{KEY}.json", '{"name": "x"}')
        with pytest.raises(DatasetError, match=r"other-0000.*: key: Field required"):
            find_existing(FolderStore(tmp_path), WANTED)


class TestRefusal:
    """What is finished is not made again without a word."""

    @pytest.mark.parametrize(
        ("recipe", "how"),
        [
            pytest.param(small_recipe(), "by other code or library versions", id="key"),
            pytest.param(small_recipe(frames=3), "from another scenario", id="frames"),
        ],
    )
    def test_says_how_many_and_how_they_were_made(
        self, tmp_path: Path, recipe: Recipe, how: str
    ) -> None:
        for seed, name in enumerate(KEYS):
            told = recipe.scenario(seed).model_dump(mode="json")
            put_entry(tmp_path, name, seed=seed, scenario=told)
        store = FolderStore(tmp_path)
        standing = find_existing(store, WANTED)
        words = f"2 finished .* small-0000 was made {how}.*: say --replace"
        with pytest.raises(DatasetError, match=words) as caught:
            require_same(standing, WANTED, store)
        assert "\n" not in str(caught.value)

    def test_leaves_the_data_set_as_it_was(self, tmp_path: Path) -> None:
        record = '{"layout": 1, "format": "native", "split": "", "channels": [], '
        put_file(tmp_path, "dataset.json", record + '"productions": []}')
        put_entry(tmp_path, "small-0000")
        put_file(tmp_path, "small-0000/frames/1.png", "finished")
        put_file(tmp_path, f"entries/small-0001.{KEY}.part", "[]")
        before = {path: path.is_file() and path.read_text() for path in _all(tmp_path)}
        with pytest.raises(DatasetError, match="1 finished sequence would"):
            produce_dataset(WANTED, str(tmp_path), command="x")
        after = {path: path.is_file() and path.read_text() for path in _all(tmp_path)}
        assert after == before

    def test_lets_what_is_the_same_or_damaged_pass(self, tmp_path: Path) -> None:
        put_entry(tmp_path, "small-0000", FIRST)
        put_file(tmp_path, f"entries/small-0001.{KEYS['small-0001']}.json", "")
        store = FolderStore(tmp_path)
        require_same(find_existing(store, WANTED), WANTED, store)


class TestTidying:
    """What was on its way goes; what is whole stays, and so do foreign files."""

    @pytest.mark.parametrize(
        "listed",
        [
            pytest.param('["val/a-0000", "truth/a-0000"]', id="folders"),
            pytest.param('["val/a-0000/1.jpg", "truth/a-0000/x"]', id="files"),
        ],
    )
    def test_clears_a_sequence_that_was_on_its_way(
        self, tmp_path: Path, listed: str
    ) -> None:
        for path in ("val/a-0000/1.jpg", "val/b-0000/1.jpg", "truth/a-0000/x"):
            put_file(tmp_path, path, "")
        put_file(tmp_path, f"entries/a-0000.{KEY}.part", listed)
        tidy(FolderStore(tmp_path))
        left = {path.relative_to(tmp_path).as_posix() for path in _all(tmp_path)}
        assert left == {"val", "val/b-0000", "val/b-0000/1.jpg"}

    def test_removes_nothing_that_is_not_of_that_name(self, tmp_path: Path) -> None:
        put_file(tmp_path, "val/b-0000/1.jpg", "")
        put_file(tmp_path, f"entries/a-0000.{KEY}.part", '["..", "/", "", "val"]')
        tidy(FolderStore(tmp_path))
        assert (tmp_path / "val/b-0000/1.jpg").exists()

    @pytest.mark.parametrize("listed", ["", '["val/small-0', "3"])
    def test_leaves_a_list_that_was_cut_off_to_who_makes_its_sequence(
        self, tmp_path: Path, listed: str
    ) -> None:
        part = put_file(tmp_path, f"entries/small-0000.{FIRST}.part", listed)
        store = FolderStore(tmp_path)
        tidy(store)
        assert find_existing(store, WANTED) == ExistingSequences(
            set(), {"small-0000": [part]}, []
        )

    @pytest.mark.parametrize("key", [KEY, FIRST])
    def test_keeps_a_sequence_that_is_whole_or_not_yet_replaced(
        self, tmp_path: Path, key: str
    ) -> None:
        entry = put_entry(tmp_path, "small-0000", key)
        put_file(tmp_path, "small-0000/1.png", "")
        put_file(tmp_path, f"entries/small-0000.{FIRST}.part", '["small-0000"]')
        tidy(FolderStore(tmp_path))
        files = {path for path in _all(tmp_path) if path.is_file()}
        assert files == {tmp_path / entry, tmp_path / "small-0000/1.png"}


def _all(folder: Path) -> list[Path]:
    """Return what a data set holds but its lock and the files of who works on it."""
    return [path for path in folder.rglob("*") if not path.name.startswith(".")]
