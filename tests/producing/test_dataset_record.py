"""What a data set says of itself, and what is cleared when that is not so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from simbench.errors import DatasetError
from simbench.producing.dataset_record import Entries, Record, tidy
from simbench.producing.production import produce_dataset
from simbench.producing.store import FolderStore
from simbench.producing.wanted import Wanted, spread
from tests.producing.small_recipe import small_recipe

PART = "0123456789ab"


@pytest.mark.parametrize(
    ("other", "words"),
    [
        pytest.param(
            Wanted(spread([small_recipe()], 1), "vot"),
            "format 'otb', asked for 'vot'",
            id="format",
        ),
        pytest.param(
            Wanted(spread([small_recipe()], 2), "otb"), "another command", id="otb"
        ),
    ],
)
def test_data_set_that_cannot_be_added_to_is_left_alone(
    tmp_path: Path, other: Wanted, words: str
) -> None:
    store = FolderStore(tmp_path)
    Record.begun(store, Wanted(spread([small_recipe()], 1), "otb"), "first")
    with pytest.raises(DatasetError, match=words):
        Record.begun(store, other, "second")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("{", id="broken"),
        pytest.param("[]", id="no mapping"),
        pytest.param('{"layout": 99, "productions": []}', id="another version"),
    ],
)
def test_damaged_record_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "dataset.json").write_text(text)
    with pytest.raises(DatasetError, match=r"dataset\.json") as caught:
        produce_dataset(Wanted(spread([small_recipe()], 1)), str(tmp_path), command="x")
    assert "\n" not in str(caught.value)


class TestTidying:
    """What is half there, or made otherwise, goes; what is whole stays."""

    @staticmethod
    def put(folder: Path, **files: str) -> None:
        for name, text in files.items():
            path = folder / name.replace("__", ".").replace("_", "/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    @pytest.fixture
    def wanted(self) -> Wanted:
        return Wanted(spread([small_recipe()], 2))

    @pytest.mark.parametrize("notes", ['["val/a", "val/b"]', '["val/a", "va'])
    def test_clears_a_sequence_that_was_on_its_way(
        self, tmp_path: Path, wanted: Wanted, notes: str
    ) -> None:
        part = f"small-0000.{next(iter(wanted)).key}.part"
        self.put(tmp_path, val_a="picture")
        (tmp_path / "entries").mkdir()
        (tmp_path / "entries" / part).write_text(notes)
        assert tidy(FolderStore(tmp_path), wanted) == set()
        is_known = notes.endswith("]")
        assert (tmp_path / "val" / "a").exists() != is_known
        assert not (tmp_path / "entries" / part).exists()

    def test_keeps_a_sequence_that_arrived_as_the_process_died(
        self, tmp_path: Path, wanted: Wanted
    ) -> None:
        stem = f"small-0000.{next(iter(wanted)).key}"
        self.put(tmp_path, val_a="picture")
        (tmp_path / "entries").mkdir()
        (tmp_path / "entries" / f"{stem}.part").write_text('["val/a"]')
        (tmp_path / "entries" / f"{stem}.json").write_text('{"files": ["val/a"]}')
        assert tidy(FolderStore(tmp_path), wanted) == {"small-0000"}
        assert (tmp_path / "val" / "a").exists()
        (left,) = (tmp_path / "entries").iterdir()
        assert left.name == f"{stem}.json"

    def test_clears_what_was_made_otherwise_and_keeps_what_is_not_asked_for(
        self, tmp_path: Path, wanted: Wanted
    ) -> None:
        self.put(tmp_path, val_a="stale", val_b="of another command")
        entries = tmp_path / "entries"
        entries.mkdir()
        (entries / f"small-0000.{PART}.json").write_text('{"files": ["val/a"]}')
        (entries / f"other-0000.{PART}.json").write_text('{"files": ["val/b"]}')
        assert tidy(FolderStore(tmp_path), wanted) == set()
        assert not (tmp_path / "val" / "a").exists()
        assert (tmp_path / "val" / "b").exists()
        (left,) = entries.iterdir()
        assert left.name == f"other-0000.{PART}.json"


def test_entries_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    (tmp_path / "entries").mkdir()
    for seed in (9999, 10000, 3):
        path = tmp_path / "entries" / f"a-{seed:04d}.{PART}.json"
        path.write_text(json.dumps({"seed": seed}))
    (tmp_path / "entries" / f"a-0004.{PART}.part").write_text("[]")
    entries = Entries(FolderStore(tmp_path))
    assert len(entries) == 3
    for _ in range(2):  # a layout may walk through them again
        assert [entry["seed"] for entry in entries] == [3, 9999, 10000]
