"""What every layout keeps to: lossless, lazy, repeatable, and plain when it fails."""

from __future__ import annotations

import collections.abc
import json
import re
import weakref
from dataclasses import replace
from pathlib import Path
from typing import overload

import numpy as np
import pytest

from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.datasets import frames as frame_folder
from simbench.datasets.formats import FORMATS, SPLITS, find_format, sequence_name
from simbench.datasets.formats.otb import NAMES
from simbench.datasets.native import read_sequence, write_sequence

EVERY = pytest.mark.parametrize("layout_name", FORMATS)
DIVIDED = ("got10k", "mot17", "davis", "youtube-vis", "coco")


def _name(layout_name: str) -> str:
    return sequence_name(find_format(layout_name), 0, "staged-0007")


def _files(root: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(root)): path.read_bytes()
        for path in sorted(root.rglob("*"))
        if path.is_file()
    }


class OneByOne(collections.abc.Sequence[Frame]):
    """Frames that record when more than one of them is in memory."""

    def __init__(self, frames: collections.abc.Sequence[Frame]) -> None:
        self._frames = frames
        self._given: list[weakref.ref[np.ndarray[tuple[int, ...], np.dtype[np.uint8]]]]
        self._given = []
        self.requested: list[int] = []
        self.most_alive = 0

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> OneByOne: ...
    def __getitem__(self, index: int | slice) -> Frame | OneByOne:
        assert isinstance(index, int)
        frame = self._frames[index]
        image = frame.image.copy()
        self._given.append(weakref.ref(image))
        self.requested.append(index)
        alive = sum(one() is not None for one in self._given)
        self.most_alive = max(self.most_alive, alive)
        return replace(frame, image=image)


def test_names_of_layouts() -> None:
    assert set(FORMATS) == {"native", "vot", "otb", *DIVIDED}


@EVERY
def test_layout_is_found_by_its_name(layout_name: str) -> None:
    assert find_format(layout_name).name == layout_name


def test_unknown_layout_is_an_error_that_names_the_known_ones() -> None:
    with pytest.raises(
        DatasetError, match="unknown format 'lasot'; known: native, vot"
    ):
        find_format("lasot")


@pytest.mark.parametrize("layout_name", DIVIDED)
@pytest.mark.parametrize("split", SPLITS)
def test_split_is_in_the_paths(
    layout_name: str, split: str, staged: Sequence, tmp_path: Path
) -> None:
    layout = find_format(layout_name, split)
    entry = layout.write(staged, "one", tmp_path)
    paths = [*_files(tmp_path), *(path for path, _ in layout.index([entry]))]
    words = {word for path in paths for word in re.split(r"[/_.-]", path)}
    assert words & set(SPLITS) == {split}


def test_default_split_is_train_in_mot17_and_val_elsewhere() -> None:
    assert find_format("mot17") == find_format("mot17", "train")
    assert find_format("got10k") == find_format("got10k", "val")


def test_unknown_split_is_an_error() -> None:
    with pytest.raises(DatasetError, match="one of train, val, test, got 'dev'"):
        find_format("coco", "dev")


@pytest.mark.parametrize("layout_name", ["native", "vot", "otb"])
def test_split_is_an_error_where_the_layout_has_none(layout_name: str) -> None:
    with pytest.raises(DatasetError, match=f"format {layout_name}: .* have no splits"):
        find_format(layout_name, "val")


@EVERY
def test_same_sequence_gives_the_same_bytes(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    layout = find_format(layout_name)
    first, second = (
        layout.write(staged, _name(layout_name), tmp_path / folder)
        for folder in ("first", "second")
    )
    assert first == second
    assert _files(tmp_path / "first") == _files(tmp_path / "second")


@EVERY
def test_index_is_the_same_from_entries_read_from_json(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    layout = find_format(layout_name)
    entry = layout.write(staged, _name(layout_name), tmp_path)
    stored = json.loads(json.dumps(entry, allow_nan=False))
    plain, again = (
        {path: "".join(chunks) for path, chunks in layout.index([one])}
        for one in (entry, stored)
    )
    assert plain == again
    assert _name(layout_name) in "".join(plain.values())


@EVERY
def test_index_keeps_the_order_of_the_data_set(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    layout = find_format(layout_name)
    names = [sequence_name(layout, i, name) for i, name in enumerate(["z", "a"])]
    entries = [layout.write(staged, name, tmp_path) for name in names]
    _, chunks = next(iter(layout.index(entries)))
    text = "".join(chunks)
    assert 0 <= text.rindex(names[0]) < text.rindex(names[1])


@EVERY
def test_index_files_are_not_files_of_a_sequence(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    layout = find_format(layout_name)
    entry = layout.write(staged, _name(layout_name), tmp_path)
    written = _files(tmp_path)
    assert not {path for path, _ in layout.index([entry])} & set(written)


@EVERY
def test_pictures_are_read_once_and_kept_one_at_a_time(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    frames = OneByOne(staged.frames)
    find_format(layout_name).write(
        replace(staged, frames=frames), _name(layout_name), tmp_path
    )
    assert frames.requested == list(range(len(staged)))
    # the one that is being written and the one that follows it
    assert frames.most_alive <= 2


@EVERY
def test_pictures_of_a_folder_are_copied_to_the_byte_and_never_decoded(
    layout_name: str, staged: Sequence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_sequence(tmp_path / "recorded", staged)
    recorded = read_sequence(tmp_path / "recorded")
    monkeypatch.delattr(frame_folder, "decoded_picture")
    root = tmp_path / "root"
    find_format(layout_name).write(recorded, _name(layout_name), root)
    pictures = sorted(
        path
        for path in root.rglob("*")
        if path.suffix in (".jpg", ".png") and "Annotations" not in path.parts
    )
    originals = sorted((tmp_path / "recorded" / "frames").iterdir())
    assert [p.read_bytes() for p in pictures] == [p.read_bytes() for p in originals]


@EVERY
def test_missing_picture_is_an_error_that_names_it(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    write_sequence(tmp_path / "recorded", staged)
    recorded = read_sequence(tmp_path / "recorded")
    (tmp_path / "recorded" / "frames" / "000005.png").unlink()
    with pytest.raises(DatasetError, match=r"000005\.png: expected a picture"):
        find_format(layout_name).write(recorded, _name(layout_name), tmp_path / "root")


@EVERY
def test_unwritable_root_is_an_error_that_names_the_place(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    (tmp_path / "root").write_text("not a folder")
    with pytest.raises(DatasetError, match=r"root.*: cannot write: Not a directory"):
        find_format(layout_name).write(staged, _name(layout_name), tmp_path / "root")


@pytest.mark.parametrize("layout_name", ["mot17", "davis", "youtube-vis", "coco"])
def test_layout_of_vehicles_refuses_a_sequence_with_truth_of_its_target_only(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    bare = replace(staged, truth=replace(staged.truth, vehicles=None))
    with pytest.raises(DatasetError, match=f"format {layout_name}: staged: expected"):
        find_format(layout_name).write(bare, "one", tmp_path)
    assert not _files(tmp_path)


@pytest.mark.parametrize("layout_name", ["davis", "youtube-vis", "coco"])
def test_layout_of_masks_refuses_a_sequence_without_masks(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    assert staged.truth.vehicles is not None
    vehicles = replace(staged.truth.vehicles, masks=())
    bare = replace(staged, truth=replace(staged.truth, vehicles=vehicles))
    with pytest.raises(DatasetError, match="expected an instance mask"):
        find_format(layout_name).write(bare, "one", tmp_path)


@pytest.mark.parametrize("layout_name", ["otb", "davis", "youtube-vis", "coco"])
def test_index_that_reads_entries_twice_refuses_an_iterator(layout_name: str) -> None:
    with pytest.raises(ValueError, match="give no iterator"):
        list(find_format(layout_name).index(iter([])))


@EVERY
def test_native_is_exact_and_others_accept_recorded_sequences(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    recorded = replace(staged, seed=None, scenario=None)
    find_format(layout_name).write(recorded, _name(layout_name), tmp_path)
    if layout_name == "native":
        again = read_sequence(tmp_path / "staged-0007")
        np.testing.assert_array_equal(again.truth.boxes, staged.truth.boxes)
        np.testing.assert_array_equal(again.frames[3].image, staged.frames[3].image)


def test_name_is_kept_where_readers_accept_any() -> None:
    assert sequence_name(find_format("got10k"), 500, "poles-0500") == "poles-0500"


def test_name_is_borrowed_from_the_benchmark_in_otb() -> None:
    layout = find_format("otb")
    assert [sequence_name(layout, i, "x") for i in (0, 1)] == ["Car1", "Car2"]


def test_more_sequences_than_otb_has_names_are_an_error_that_says_how_many() -> None:
    layout = find_format("otb")
    assert sequence_name(layout, len(NAMES) - 1, "x") == NAMES[-1]
    with pytest.raises(DatasetError, match=f"at most {len(NAMES)} sequences"):
        sequence_name(layout, len(NAMES), "x")
