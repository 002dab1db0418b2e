"""All of a data set is compared: entries, files, index, and files too many."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simbench.generation.generate
from simbench.cli import execute
from simbench.datasets.frames import write_frame
from simbench.datasets.store import FolderStore
from simbench.generation.dataset.make_sequence import (
    ENTRIES,
    SequenceJob,
    make_sequence,
)
from simbench.generation.dataset.manifest import EntryFile
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, SeededRecipe
from simbench.generation.digests import made_with
from simbench.verification.compare_dataset import compare_dataset
from simbench.verification.compare_sequences import compare_sequences
from simbench.verification.difference import VerificationResult
from simbench.verification.regenerate import (
    entry_files,
    in_dataset,
    regenerated_files,
    verify_sequence,
)
from simbench.verification.verify import find_recorded_sequences
from tests.generation.dataset.small_recipe import small_recipe

pytestmark = [pytest.mark.gl, pytest.mark.sumo]

Change = Callable[[Path], None]


def make_dataset(
    layout: str, place: Path, count: int, channels: tuple[str, ...]
) -> None:
    request = DatasetRequest(
        (SeededRecipe(small_recipe(), range(count)),), layout, "", channels
    )
    produce_dataset(request, str(place), command="as typed", licence="CC0-1.0")


def entry_of(place: Path, number: int = 0) -> Path:
    return sorted((place / ENTRIES).glob("*.json"))[number]


def verified(place: Path, scratch: Path) -> VerificationResult:
    """Verify the first sequence of a data set in this process."""
    (sequence, *_), _ = find_recorded_sequences(str(place))
    return verify_sequence(sequence.name, sequence.read, scratch, lambda *_: None)


@pytest.fixture(scope="module")
def coco(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sequences of two frames."""
    place = tmp_path_factory.mktemp("coco") / "set"
    make_dataset("coco", place, 2, ())
    return place


@pytest.fixture(scope="module")
def native(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One sequence of two frames, with depth."""
    place = tmp_path_factory.mktemp("native") / "set"
    make_dataset("native", place, 1, ("depth",))
    return place


@pytest.fixture
def copied(coco: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(coco, tmp_path / "set"))


def changed(path: Path, change: Callable[[Any], object]) -> None:
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def in_entry(change: Callable[[dict[str, Any]], object]) -> Change:
    return lambda place: changed(entry_of(place), change)


def test_unchanged_data_set_is_identical(coco: Path, native: Path) -> None:
    for place in (coco, native):
        assert str(compare_dataset(str(place))) == "index and list of files: identical"
    assert compare_dataset(str(coco / "val")) is None


def write(path: str, text: str) -> Change:
    def change(place: Path) -> None:
        (place / path).parent.mkdir(parents=True, exist_ok=True)
        (place / path).write_text(text)

    return change


def remove(path: str) -> Change:
    return lambda place: (place / path).unlink()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(
            write("annotations/instances_val.json", "{}"),
            "index differs: not what the entries say: annotations/instances_val.json",
            id="other annotations",
        ),
        pytest.param(
            write("card.json", "{}"),
            "index differs: not what the entries say: card.json",
            id="another card",
        ),
        pytest.param(remove("CARD.md"), "files differ: missing: CARD.md", id="no card"),
        pytest.param(
            write("val/small-0001/000002.png", "x"),
            "files differ: of no sequence and not of the index: "
            "val/small-0001/000002.png",
            id="an image too many",
        ),
        pytest.param(
            write("notes/todo.txt", "x"),
            "files differ: of no sequence and not of the index: notes",
            id="a folder too many",
        ),
        pytest.param(
            remove("val/small-0001/000001.png"),
            "files differ: missing: val/small-0001/000001.png",
            id="an image too few",
        ),
        pytest.param(
            in_entry(lambda e: e["layout"].update(width=99)),
            "index differs: not what the entries say: annotations/instances_val.json",
            id="an entry that the index does not follow",
        ),
        pytest.param(
            lambda place: changed(
                place / "dataset.json",
                lambda r: r["productions"][-1].update(finished=False),
            ),
            "record differs: dataset.json says that its generation did not end: no "
            "index to compare",
            id="an unfinished production",
        ),
    ],
)
def test_index_and_file_names_are_compared(
    copied: Path, change: Change, message: str
) -> None:
    change(copied)
    assert str(compare_dataset(str(copied))) == f"index and list of files: {message}"


def test_removed_entry_and_its_files_are_reported(copied: Path) -> None:
    entry_of(copied).unlink()
    assert str(compare_dataset(str(copied))) == (
        "index and list of files: record differs: dataset.json says 2 sequences, 1 "
        "have an entry; index differs: not what the entries say: CARD.md, "
        "annotations/instances_val.json, card.json; files differ: of no sequence and "
        "not of the index: truth/small-0000, val/small-0000"
    )


def test_damaged_entry_is_a_fault_of_the_index_and_of_its_sequence(
    copied: Path, tmp_path: Path
) -> None:
    entry_of(copied).write_text('{"name": ')
    for result in (compare_dataset(str(copied)), verified(copied, tmp_path / "made")):
        assert "cannot be verified" in str(result)
        assert "not valid JSON" in str(result)


@pytest.fixture(scope="module")
def regenerated(coco: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first sequence of the data set, generated again, with its entry."""
    root = tmp_path_factory.mktemp("regenerated") / "root"
    job = SequenceJob(
        name="small-0000",
        key="0" * 12,
        scenario=small_recipe().scenario(0),
        seed=0,
        layout="coco",
        split="",
        channels=(),
        place=str(coco),
        local_folder=root,
    )
    assert make_sequence(job, lambda *_: None) == ("made", "")
    return root


def compared(place: Path, regenerated: Path) -> str:
    content = entry_of(place).read_bytes()
    recorded = entry_files(json.loads(content), content, FolderStore(place))
    found = compare_sequences(recorded, regenerated_files(regenerated))
    return "; ".join(map(str, found))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(lambda _: None, "", id="nothing"),
        pytest.param(
            in_entry(lambda e: e["summary"].update(frames=999)),
            "summary differs: frames: 999 recorded, 2 regenerated",
            id="summary",
        ),
        pytest.param(
            in_entry(lambda e: e["layout"]["pictures"][0][0].update(bbox=[0, 0, 1, 1])),
            "layout differs: pictures.0.0.bbox.0: 0 recorded, ",
            id="masks, which only the entry contains",
        ),
        pytest.param(
            in_entry(lambda e: e["summary"]["made_with"].update(opengl="Mesa 1")),
            "",
            id="what made it",
        ),
        pytest.param(
            in_entry(lambda e: e.pop("sha256")), "", id="an entry of an older version"
        ),
        pytest.param(
            in_entry(lambda e: e["files"].append("val/small-0000/000009.png")),
            "file names differ: only recorded: val/small-0000/000009.png",
            id="a file listed too many",
        ),
        pytest.param(
            in_entry(lambda e: e["files"].remove("val/small-0000/000001.png")),
            "file names differ: only regenerated: val/small-0000/000001.png",
            id="a file listed too few",
        ),
        pytest.param(
            write("truth/small-0000/target.parquet", "x"),
            "files differ: truth/small-0000/target.parquet (the files were changed "
            "after they were made)",
            id="a table",
        ),
    ],
)
def test_entry_is_compared_part_by_part(
    copied: Path, regenerated: Path, change: Change, message: str
) -> None:
    change(copied)
    found = compared(copied, regenerated)
    assert found.startswith(message) and bool(found) == bool(message)


def test_file_without_digest_is_not_called_changed(
    copied: Path, regenerated: Path
) -> None:
    in_entry(lambda e: e.pop("sha256"))(copied)
    write("truth/small-0000/target.parquet", "x")(copied)
    assert compared(copied, regenerated) == (
        "files differ: truth/small-0000/target.parquet"
    )


def test_image_in_other_bytes_was_changed_even_if_its_pixels_are_the_same(
    copied: Path, regenerated: Path
) -> None:
    folder = copied / "val" / "small-0000"
    with (folder / "000000.png").open("ab") as file:
        file.write(b"behind the end")
    assert compared(copied, regenerated) == (
        "files differ: val/small-0000/000000.png (the files were changed after they "
        "were made)"
    )


def test_unchanged_data_set_is_identical_on_another_machine(
    native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = {**made_with(), "processor": "Z80"}
    monkeypatch.setattr(simbench.generation.generate, "made_with", lambda: elsewhere)
    result = verified(native, tmp_path / "made")
    assert str(result) == "small-0000: identical"
    assert result.environment_changes["processor"][1] == "Z80"


def test_image_rendered_otherwise_is_not_called_changed(
    native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def darker(folder: Path, index: int, image: np.ndarray[Any, Any]) -> None:
        write_frame(folder, index, image - (image > 0))

    def digest(image: np.ndarray[Any, Any]) -> bytes:
        return b"other"

    monkeypatch.setattr(simbench.generation.generate, "write_frame", darker)
    monkeypatch.setattr(simbench.generation.generate, "frame_digest", digest)
    found = str(verified(native, tmp_path / "made"))
    assert found.startswith(
        "small-0000: frames differ from frame 0 on: at most 1 level"
    )
    assert "changed" not in found


def test_entries_are_not_read_before_their_turn(
    copied: Path,
) -> None:
    entry_of(copied).write_text("rubbish")
    (first, second), total = find_recorded_sequences(str(copied))
    assert (first.name, second.name, total) == ("small-0000", "small-0001", 2)
    assert isinstance(first.read, partial)
    assert first.read.func is in_dataset
    assert [type(part) for part in first.read.args] == [str, dict, EntryFile]
    assert [first.count_frames(), second.count_frames()] == [0, 2]


def test_sample_compares_the_whole_index_and_ends_with_1(
    copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (copied / "val" / "small-0001" / "000000.png").unlink()
    assert execute(["verify", str(copied), "--sample", "1", "-j", "1"]) == 1
    output = capsys.readouterr().out
    assert "small-0000: identical" in output
    assert "files differ: missing: val/small-0001/000000.png" in output
    assert "1 of 2 verified: 1 identical" in output


@pytest.mark.parametrize("part", ["frame", "folder"])
def test_what_a_link_outside_contains_is_not_identical(copied: Path, part: str) -> None:
    outside = copied.parent / "outside"
    shutil.copytree(copied, outside)
    entry = json.loads(entry_of(copied).read_text())
    frame = copied / next(one for one in entry["files"] if "truth" not in one)
    swapped = frame if part == "frame" else frame.parent
    shutil.rmtree(swapped) if swapped.is_dir() else swapped.unlink()
    swapped.symlink_to(outside / swapped.relative_to(copied))
    result = verified(copied, copied.parent / "scratch")
    assert "a link that leads out of it" in result.fault
    assert str(swapped.relative_to(copied)) in result.fault
    if part == "folder":
        index = compare_dataset(str(copied))
        name = swapped.relative_to(copied).as_posix()
        assert f"links that lead out of the data set: {name}" in str(index)


def test_names_outside_of_a_data_set_are_not_told(copied: Path) -> None:
    (copied.parent / "more").mkdir()
    (copied.parent / "more" / "secret-name").write_text("secret content")
    in_entry(lambda entry: entry["files"].append("../more/known"))(copied)
    told = str(compare_dataset(str(copied)))
    told += str(verified(copied, copied.parent / "scratch"))
    assert "expected a path inside this folder, got '../more/known'" in told
    assert "secret" not in told


def test_deep_json_in_an_entry_is_one_line(copied: Path) -> None:
    entry_of(copied).write_text("[" * 90_000 + "]" * 90_000)
    for result in (
        verified(copied, copied.parent / "scratch"),
        compare_dataset(str(copied)),
    ):
        assert "expected JSON of at most 64 levels" in str(result)


def test_an_index_that_is_no_file_is_not_read(copied: Path) -> None:
    index = copied / "annotations" / "instances_val.json"
    index.unlink()
    index.symlink_to("/dev/zero")
    told = str(compare_dataset(str(copied)))
    assert "not what the entries say: annotations/instances_val.json" in told
