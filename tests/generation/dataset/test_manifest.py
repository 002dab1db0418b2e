"""Manifest and entries of a data set: damaged ones are refused in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from simbench.core.errors import DatasetError
from simbench.datasets.store import FolderStore
from simbench.generation.dataset.make_sequence import put_json
from simbench.generation.dataset.manifest import (
    MANIFEST,
    Entries,
    new_manifest,
    read_manifest,
)
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, spread
from tests.datasets.entries import KEY, put_entry
from tests.generation.dataset.small_recipe import small_recipe


@pytest.mark.parametrize(
    ("other", "words"),
    [
        pytest.param(
            DatasetRequest(spread([small_recipe()], 1), "vot"),
            "format 'otb', expected 'vot'",
            id="format",
        ),
        pytest.param(
            DatasetRequest(spread([small_recipe()], 2), "otb"),
            "another command",
            id="otb",
        ),
    ],
)
def test_data_set_that_cannot_be_added_to_is_left_alone(
    tmp_path: Path, other: DatasetRequest, words: str
) -> None:
    store = FolderStore(tmp_path)
    first = DatasetRequest(spread([small_recipe()], 1), "otb")
    put_json(store, MANIFEST, new_manifest(store, first, "first"))
    with pytest.raises(DatasetError, match=words):
        new_manifest(store, other, "second")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("", "not valid JSON", id="empty"),
        pytest.param("{", "not valid JSON", id="broken"),
        pytest.param("[]", "expected a mapping", id="no mapping"),
        pytest.param('{"layout": 99}', "layout: Input should be 1", id="version"),
        pytest.param(
            '{"layout": 1, "split": "", "channels": [], "productions": []}',
            "format: Field required",
            id="no format",
        ),
        pytest.param(
            '{"layout": 1, "format": "native", "split": "", "channels": [], '
            '"productions": [{"command": "x"}]}',
            r"productions\.0\.digest: Field required",
            id="foreign production",
        ),
    ],
)
def test_damaged_manifest_is_refused_in_one_line(
    tmp_path: Path, text: str, words: str
) -> None:
    (tmp_path / "dataset.json").write_text(text)
    with pytest.raises(DatasetError, match=rf"dataset\.json: {words}") as caught:
        produce_dataset(
            DatasetRequest(spread([small_recipe()], 1)), str(tmp_path), command="x"
        )
    assert "\n" not in str(caught.value)


def test_licence_is_kept_until_another_is_declared(tmp_path: Path) -> None:
    store = FolderStore(tmp_path)
    request = DatasetRequest(spread([small_recipe()], 1))
    for declared, kept in (("", ""), ("CC0", "CC0"), ("", "CC0"), ("MIT", "MIT")):
        put_json(store, MANIFEST, new_manifest(store, request, "x", declared))
        assert read_manifest(store)["licence"] == kept


def test_entries_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for seed in (9999, 10000, 3):
        put_entry(tmp_path, f"a-{seed:04d}", seed=seed)
    (tmp_path / "entries" / f"a-0004.{KEY}.part").write_text("[]")
    entries = Entries(FolderStore(tmp_path))
    assert len(entries) == 3
    for _ in range(2):  # a layout may iterate again
        assert [entry["seed"] for entry in entries] == [3, 9999, 10000]


def test_files_with_other_names_are_ignored(tmp_path: Path) -> None:
    put_entry(tmp_path, "a-0000")
    for name in ("notes.json", "a-0001.json", f"a-0002.{KEY}.json.bak"):
        (tmp_path / "entries" / name).write_text("{}")
    assert [entry["name"] for entry in Entries(FolderStore(tmp_path))] == ["a-0000"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        pytest.param({"files": 3}, "files: Input should be a valid list", id="type"),
        pytest.param({"layout": None}, "layout: Input should be", id="nothing"),
        pytest.param({"name": "b-0000"}, "is the entry of b-0000", id="another's"),
    ],
)
def test_damaged_entry_is_named_in_one_line(
    tmp_path: Path, content: dict[str, Any], words: str
) -> None:
    put_entry(tmp_path, "a-0000", **content)
    with pytest.raises(DatasetError, match=rf"a-0000\.{KEY}\.json: {words}"):
        list(Entries(FolderStore(tmp_path)))
