"""What a data set contains is read with bounds, and never from outside of it."""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.bounded_table import parse_table
from simbench.datasets.frames import decoded_as_stored, decoded_picture, encoded_png
from simbench.datasets.native import read_sequence, write_sequence
from simbench.datasets.parquet_footer import value_count
from simbench.datasets.store import open_store
from simbench.datasets.stored_files import open_file, read_files
from simbench.generation.dataset.manifest import EntryFile, read_manifest
from tests.datasets.entries import KEY, put_entry, put_file

Change = Callable[[Path], object]


@pytest.fixture
def folder(staged: Sequence, tmp_path: Path) -> Path:
    """A sequence on disk, and a copy of it outside."""
    write_sequence(tmp_path / "sequence", staged)
    shutil.copytree(tmp_path / "sequence", tmp_path / "outside")
    return tmp_path / "sequence"


def _read_all(folder: Path) -> None:
    sequence = read_sequence(folder)
    for frame in sequence.frames:
        assert frame.image.shape[2] == 3


@pytest.mark.parametrize(
    "part",
    [
        "sequence.json",
        "frames",
        "frames/000000.png",
        "frames/000007.png",
        "truth",
        "truth/target.parquet",
        "truth/masks.parquet",
    ],
)
def test_a_link_out_of_a_sequence_is_not_followed(folder: Path, part: str) -> None:
    path = folder / part
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    path.symlink_to(folder.parent / "outside" / part)  # the same content
    with pytest.raises(DatasetError, match="a link that leads out of it") as caught:
        _read_all(folder)
    assert str(folder / part) in str(caught.value)


def test_links_inside_of_a_sequence_are_followed(folder: Path) -> None:
    (folder / "frames").rename(folder / "pictures")
    (folder / "frames").symlink_to("pictures")
    _read_all(folder)


def _pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2**40)


@pytest.mark.parametrize("put", [_pipe, _sparse])
@pytest.mark.parametrize("part", ["sequence.json", "truth/masks.parquet"])
def test_pipes_and_endless_files_are_refused(
    folder: Path, part: str, put: Change
) -> None:
    put(folder / part)
    with pytest.raises(DatasetError):
        _read_all(folder)


@pytest.mark.parametrize(
    "values",
    [
        {"vehicles": [1]},
        {"vehicles": [{"name": "target"}]},
        {"lane_changes": [3]},
        {"channels": [[]]},
        {"width": 10**9},
        {"vehicles": [[[[]]]]},
    ],
)
def test_a_description_of_other_types_is_one_line(
    folder: Path, values: dict[str, Any]
) -> None:
    path = folder / "sequence.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | values))
    with pytest.raises(DatasetError) as caught:
        _read_all(folder)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(("column", "value"), [("height_px", 2**30), ("width_px", -1)])
def test_masks_of_another_size_than_their_runs_are_refused(
    folder: Path, column: str, value: int
) -> None:
    path = folder / "truth" / "masks.parquet"
    table = pq.read_table(path)
    index = table.schema.get_field_index(column)
    values = pa.array([value] * len(table), table.schema.field(index).type)
    pq.write_table(table.set_column(index, table.schema.field(index), values), path)
    with pytest.raises(DatasetError, match="runs of a mask must add up to"):
        read_sequence(folder)


def _written(table: pa.Table) -> bytes:
    content = io.BytesIO()
    pq.write_table(table, content)
    return content.getvalue()


def test_a_table_of_too_many_values_is_refused_before_it_is_decoded() -> None:
    one = pa.DictionaryArray.from_arrays(np.zeros(51_000_000, np.int8), ["x"])
    content = _written(pa.table({"a": one}))
    assert len(content) < 1_000_000
    with pytest.raises(DatasetError, match=r"^here: .*at most .* 50000000 values, got"):
        parse_table(content, "here")


def test_values_in_lists_are_counted_singly() -> None:
    nested = pa.array([[7] * 1000] * 60, pa.list_(pa.int64()))
    table = pa.table({"one": nested, "other": list(range(60))})
    assert value_count(_written(table)) == 60_060


def test_damaged_size_statistics_are_refused_and_end_no_process() -> None:
    content = bytearray(_TABLE)
    refused = 0
    for place in range(len(content) - 700, len(content) - 8):
        content[place] ^= 1  # among them the statistics at which PyArrow aborts
        try:
            parse_table(bytes(content), "here", ["frame"])
        except DatasetError:
            refused += 1
        content[place] ^= 1
    assert refused > 10


_TABLE = _written(pa.table({"frame": list(range(100)), "name": ["a", None] * 50}))


@settings(max_examples=200)
@given(st.data())
def test_any_bytes_are_a_table_or_refused_in_one_line(data: st.DataObject) -> None:
    content = bytearray(_TABLE)
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(
            st.integers(0, 255)
        )
    try:
        parse_table(bytes(content), "here", ["frame"])
    except DatasetError as error:
        assert len(str(error).splitlines()) == 1


def test_a_column_whose_name_is_no_text_is_refused_in_one_line() -> None:
    content = _TABLE.replace(b"frame", b"\x80rame")
    with pytest.raises(DatasetError, match="here: not a readable table"):
        parse_table(content, "here", ["frame"])


def _header(width: int, height: int) -> bytes:
    size = width.to_bytes(4, "big") + height.to_bytes(4, "big")
    return b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + size + b"\x08\x02\0\0\0" + b"\0" * 99


@pytest.mark.parametrize(
    "content",
    [
        _header(65_535, 65_535),
        _header(0, 5),
        b"II*\0" + b"\xff" * 20,
        b"MM\0*" + b"\0\0\0\x08" + b"\xff" * 20,
        b"BM" + b"\xff" * 60,
        b"",
    ],
)
def test_pictures_too_large_or_of_no_layout_are_refused(content: bytes) -> None:
    assert decoded_as_stored(content) is None
    with pytest.raises(DatasetError, match="here: not a readable picture"):
        decoded_picture(content, "here")


def test_pictures_of_both_layouts_are_decoded() -> None:
    depth = np.full((5, 7), np.inf, np.float32)
    _, tiff = cv2.imencode(".tiff", depth)
    stored = decoded_as_stored(tiff.tobytes())
    assert stored is not None and np.array_equal(stored, depth)
    image = np.arange(105, dtype=np.uint8).reshape(5, 7, 3)
    assert np.array_equal(decoded_picture(encoded_png(image), ""), image)


@settings(max_examples=100)
@given(st.data())
def test_any_bytes_are_a_picture_or_none(data: st.DataObject) -> None:
    start = data.draw(st.sampled_from([b"\x89PNG\r\n\x1a\n", b"II*\0", b"MM\0*", b""]))
    decoded_as_stored(start + data.draw(st.binary(max_size=200)))


def test_files_of_a_store_are_read_inside_of_it(tmp_path: Path) -> None:
    put_file(tmp_path, "secret", "secret content")
    put_file(tmp_path, "set/file", "mine")
    (tmp_path / "set" / "link").symlink_to("../secret")
    store = open_store(str(tmp_path / "set"))
    assert read_files(store, ["file"]) == [b"mine"]
    with open_file(store, "file") as file:
        assert file.read() == b"mine"
    for path in ("../secret", "link", str(tmp_path / "secret"), "", "a\0b"):
        for read in (
            lambda path: read_files(store, [path]),
            lambda p: open_file(store, p),
        ):
            with pytest.raises(DatasetError):
                read(path)
    with pytest.raises(DatasetError, match="at most 3 bytes"):
        read_files(store, ["file"], 3)


def test_files_in_memory_are_bounded_too() -> None:
    store = open_store("memory://bounded")
    store._system.pipe_file("/bounded/file", b"12345")
    assert read_files(store, ["file"]) == [b"12345"]
    with pytest.raises(DatasetError, match="file: expected at most 3 bytes, got 5"):
        read_files(store, ["file"], 3)
    with pytest.raises(DatasetError, match="expected a path inside"):
        read_files(store, ["../other"])


@pytest.mark.parametrize("path", ["../secret", "/etc/passwd", "a/../../x", "", "a\0b"])
def test_an_entry_that_names_a_file_outside_is_refused(
    tmp_path: Path, path: str
) -> None:
    entry = put_entry(tmp_path, "a-0000", files=[path])
    store = open_store(str(tmp_path))
    content = (tmp_path / entry).read_bytes()
    with pytest.raises(DatasetError, match="files: expected a path inside this folder"):
        EntryFile(entry, "a-0000", KEY).parse(content, store)


@pytest.mark.parametrize("text", ["[" * 50_000, '{"a":' * 50_000, "[" * 70 + "]" * 70])
def test_deep_json_in_a_data_set_is_refused_in_one_line(
    tmp_path: Path, text: str
) -> None:
    put_file(tmp_path, "dataset.json", text)
    store = open_store(str(tmp_path))
    with pytest.raises(
        DatasetError, match=r"dataset\.json: expected JSON of at most 64"
    ):
        read_manifest(store)
    with pytest.raises(DatasetError, match="expected JSON of at most 64 levels"):
        EntryFile("entries/a", "a", KEY).parse(text.encode(), store)
