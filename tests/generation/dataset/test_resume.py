"""Existing sequences: kept if complete and up to date; refused, replaced or removed.

The sequences are placeholder files, the data set is a folder.
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
    refuse_outdated,
    remove_unfinished,
)
from simbench.scenarios.files.recipe import Recipe
from tests.datasets.entries import KEY, put_entry, put_file
from tests.generation.dataset.small_recipe import small_recipe

REQUEST = DatasetRequest(spread([small_recipe()], 2))
KEYS = {sequence.name: sequence.key for sequence in REQUEST}
FIRST = KEYS["small-0000"]


class TestFindExisting:
    """Reading the entries changes nothing."""

    def test_finds_complete_outdated_and_damaged_sequences(
        self, tmp_path: Path
    ) -> None:
        request = DatasetRequest(spread([small_recipe()], 4))
        keys = {sequence.name: sequence.key for sequence in request}
        put_entry(tmp_path, "small-0000", keys["small-0000"])
        put_entry(tmp_path, "other-0000")
        stale = put_entry(tmp_path, "small-0001")
        damaged = f"entries/small-0002.{keys['small-0002']}.json"
        put_file(tmp_path, damaged, "")  # as a machine that loses power may leave it
        to_replace = {"small-0001": [stale], "small-0002": [damaged]}
        found = find_existing(FolderStore(tmp_path), request)
        assert found == ExistingSequences({"small-0000"}, to_replace, {"small-0001"})

    def test_makes_a_sequence_with_two_entries_again(self, tmp_path: Path) -> None:
        both = {put_entry(tmp_path, "small-0000", key) for key in (KEY, FIRST)}
        found = find_existing(FolderStore(tmp_path), REQUEST)
        assert found.finished == set()
        assert set(found.to_replace["small-0000"]) == both

    def test_names_a_damaged_entry_that_will_not_be_made_again(
        self, tmp_path: Path
    ) -> None:
        put_file(tmp_path, f"entries/other-0000.{KEY}.json", '{"name": "x"}')
        with pytest.raises(DatasetError, match=r"other-0000.*: key: Field required"):
            find_existing(FolderStore(tmp_path), REQUEST)


class TestRefuseOutdated:
    """Finished sequences are not replaced unless requested."""

    @pytest.mark.parametrize(
        ("recipe", "how"),
        [
            pytest.param(small_recipe(), "by other code or another", id="key"),
            pytest.param(small_recipe(frames=3), "from another scenario", id="frames"),
        ],
    )
    def test_says_how_many_and_how_they_were_made(
        self, tmp_path: Path, recipe: Recipe, how: str
    ) -> None:
        for seed, name in enumerate(KEYS):
            scenario = recipe.scenario(seed).model_dump(mode="json")
            put_entry(tmp_path, name, seed=seed, scenario=scenario)
        store = FolderStore(tmp_path)
        existing = find_existing(store, REQUEST)
        words = f"2 finished .* small-0000 was made {how}.*: pass --replace"
        with pytest.raises(DatasetError, match=words) as caught:
            refuse_outdated(existing, REQUEST, store)
        assert "\n" not in str(caught.value)

    def test_leaves_the_data_set_as_it_was(self, tmp_path: Path) -> None:
        record = '{"layout": 1, "format": "native", "split": "", "channels": [], '
        put_file(tmp_path, "dataset.json", record + '"productions": []}')
        put_entry(tmp_path, "small-0000")
        put_file(tmp_path, "small-0000/frames/1.png", "finished")
        put_file(tmp_path, f"entries/small-0001.{KEY}.part", "[]")
        before = {path: path.is_file() and path.read_text() for path in _all(tmp_path)}
        with pytest.raises(DatasetError, match="1 finished sequence would"):
            produce_dataset(REQUEST, str(tmp_path), command="x")
        after = {path: path.is_file() and path.read_text() for path in _all(tmp_path)}
        assert after == before

    def test_accepts_sequences_that_are_up_to_date_or_damaged(
        self, tmp_path: Path
    ) -> None:
        put_entry(tmp_path, "small-0000", FIRST)
        put_file(tmp_path, f"entries/small-0001.{KEYS['small-0001']}.json", "")
        store = FolderStore(tmp_path)
        refuse_outdated(find_existing(store, REQUEST), REQUEST, store)


class TestRemoveUnfinished:
    """Unfinished sequences are removed; complete ones and other files are kept."""

    @pytest.mark.parametrize(
        "listed",
        [
            pytest.param('["val/a-0000", "truth/a-0000"]', id="folders"),
            pytest.param('["val/a-0000/1.jpg", "truth/a-0000/x"]', id="files"),
        ],
    )
    def test_removes_a_sequence_that_was_being_delivered(
        self, tmp_path: Path, listed: str
    ) -> None:
        for path in ("val/a-0000/1.jpg", "val/b-0000/1.jpg", "truth/a-0000/x"):
            put_file(tmp_path, path, "")
        put_file(tmp_path, f"entries/a-0000.{KEY}.part", listed)
        remove_unfinished(FolderStore(tmp_path))
        left = {path.relative_to(tmp_path).as_posix() for path in _all(tmp_path)}
        assert left == {"val", "val/b-0000", "val/b-0000/1.jpg"}

    def test_removes_nothing_of_another_name(self, tmp_path: Path) -> None:
        put_file(tmp_path, "val/b-0000/1.jpg", "")
        put_file(tmp_path, f"entries/a-0000.{KEY}.part", '["..", "/", "", "val"]')
        remove_unfinished(FolderStore(tmp_path))
        assert (tmp_path / "val/b-0000/1.jpg").exists()

    @pytest.mark.parametrize("listed", ["", '["val/small-0', "3"])
    def test_keeps_a_truncated_list_until_its_sequence_is_made_again(
        self, tmp_path: Path, listed: str
    ) -> None:
        part = put_file(tmp_path, f"entries/small-0000.{FIRST}.part", listed)
        store = FolderStore(tmp_path)
        remove_unfinished(store)
        assert find_existing(store, REQUEST) == ExistingSequences(
            set(), {"small-0000": [part]}, set()
        )

    @pytest.mark.parametrize("key", [KEY, FIRST])
    def test_keeps_a_sequence_that_is_complete_or_not_yet_replaced(
        self, tmp_path: Path, key: str
    ) -> None:
        entry = put_entry(tmp_path, "small-0000", key)
        put_file(tmp_path, "small-0000/1.png", "")
        put_file(tmp_path, f"entries/small-0000.{FIRST}.part", '["small-0000"]')
        remove_unfinished(FolderStore(tmp_path))
        files = {path for path in _all(tmp_path) if path.is_file()}
        assert files == {tmp_path / entry, tmp_path / "small-0000/1.png"}


def _all(folder: Path) -> list[Path]:
    """Return the paths in a data set but its lock and temporary files."""
    return [path for path in folder.rglob("*") if not path.name.startswith(".")]
