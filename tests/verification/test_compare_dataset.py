"""Of a data set everything is compared: entries, files, index and what is too much."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simbench.generation.generate
from simbench.cli import execute
from simbench.datasets.frames import write_frame
from simbench.datasets.store import FolderStore
from simbench.generation.dataset.make_sequence import ENTRIES, SequenceJob, produce
from simbench.generation.dataset.manifest import EntryFile
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import Batch, DatasetRequest
from simbench.generation.digests import made_with
from simbench.verification.compare_dataset import compare_whole
from simbench.verification.compare_entries import entry_differences
from simbench.verification.compare_sequences import VerificationResult
from simbench.verification.remake import remake_entry
from simbench.verification.verify import find_targets_to_verify
from tests.generation.dataset.small_recipe import small_recipe

pytestmark = [pytest.mark.gl, pytest.mark.sumo]

Change = Callable[[Path], None]


def produced(layout: str, place: Path, count: int, channels: tuple[str, ...]) -> None:
    wanted = DatasetRequest(
        (Batch(small_recipe(), range(count)),), layout, "", channels
    )
    produce_dataset(wanted, str(place), command="as typed", licence="CC0-1.0")


def entry_of(place: Path, number: int = 0) -> Path:
    return sorted((place / ENTRIES).glob("*.json"))[number]


def remade(place: Path, scratch: Path) -> VerificationResult:
    """Make the first sequence of a data set anew, in this process."""
    (subject, *_), _ = find_targets_to_verify(str(place))
    assert subject.remake is remake_entry
    return subject.remake(*subject.arguments, scratch, lambda *_: None)


@pytest.fixture(scope="module")
def coco(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sequences of two frames."""
    place = tmp_path_factory.mktemp("coco") / "set"
    produced("coco", place, 2, ())
    return place


@pytest.fixture(scope="module")
def native(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One sequence of two frames, with depth."""
    place = tmp_path_factory.mktemp("native") / "set"
    produced("native", place, 1, ("depth",))
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


def test_a_data_set_as_it_was_made_is_the_same_as_a_whole(
    coco: Path, native: Path
) -> None:
    for place in (coco, native):
        assert str(compare_whole(str(place))) == "index and list of files: identical"
    assert compare_whole(str(coco / "val")) is None


def write(path: str, text: str) -> Change:
    def change(place: Path) -> None:
        (place / path).parent.mkdir(parents=True, exist_ok=True)
        (place / path).write_text(text)

    return change


def remove(path: str) -> Change:
    return lambda place: (place / path).unlink()


@pytest.mark.parametrize(
    ("change", "said"),
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
            id="a picture too many",
        ),
        pytest.param(
            write("notes/todo.txt", "x"),
            "files differ: of no sequence and not of the index: notes",
            id="a folder too many",
        ),
        pytest.param(
            remove("val/small-0001/000001.png"),
            "files differ: missing: val/small-0001/000001.png",
            id="a picture too few",
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
            "record differs: dataset.json says that making it did not end: there is no "
            "index to compare",
            id="an unfinished production",
        ),
    ],
)
def test_what_no_sequence_tells_is_compared(
    copied: Path, change: Change, said: str
) -> None:
    change(copied)
    assert str(compare_whole(str(copied))) == f"index and list of files: {said}"


def test_a_removed_entry_is_missed_and_its_files_belong_to_nobody(copied: Path) -> None:
    entry_of(copied).unlink()
    assert str(compare_whole(str(copied))) == (
        "index and list of files: record differs: dataset.json says 2 sequences, 1 "
        "have an entry; index differs: not what the entries say: CARD.md and 2 more; "
        "files differ: of no sequence and not of the index: truth/small-0000 and 1 more"
    )


def test_a_damaged_entry_is_one_line_of_the_whole_and_of_its_sequence(
    copied: Path, tmp_path: Path
) -> None:
    entry_of(copied).write_text('{"name": ')
    for finding in (compare_whole(str(copied)), remade(copied, tmp_path / "made")):
        assert "cannot be verified" in str(finding)
        assert "not valid JSON" in str(finding)


@pytest.fixture(scope="module")
def anew(coco: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the first sequence of the data set, made anew, and its entry."""
    root = tmp_path_factory.mktemp("anew") / "root"
    order = SequenceJob(
        name="small-0000",
        key="0" * 12,
        scenario=small_recipe().scenario(0),
        seed=0,
        layout="coco",
        split="",
        channels=(),
        place=str(coco),
        left_at=root,
    )
    assert produce(order, lambda *_: None) == ("made", "")
    return root


def compared(place: Path, anew: Path) -> str:
    entry = json.loads(entry_of(place).read_text())
    made = json.loads((anew / "entry.json").read_text())
    found = entry_differences(FolderStore(place), entry, made, anew)
    return "; ".join(map(str, found))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        pytest.param(lambda _: None, "", id="nothing"),
        pytest.param(
            in_entry(lambda e: e["summary"].update(frames=999)),
            "summary differs: frames: 999 kept, 2 made",
            id="summary",
        ),
        pytest.param(
            in_entry(lambda e: e["layout"]["pictures"][0][0].update(bbox=[0, 0, 1, 1])),
            "layout differs: pictures.0.0.bbox.0: 0 kept, ",
            id="masks, which live nowhere else",
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
            "files differ: its entry lists what is not made here: "
            "val/small-0000/000009.png",
            id="a file listed too many",
        ),
        pytest.param(
            in_entry(lambda e: e["files"].remove("val/small-0000/000001.png")),
            "files differ: its entry lacks what is made here: "
            "val/small-0000/000001.png",
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
def test_an_entry_is_compared_part_by_part(
    copied: Path, anew: Path, change: Change, said: str
) -> None:
    change(copied)
    found = compared(copied, anew)
    assert found.startswith(said) and bool(found) == bool(said)


def test_without_digests_of_files_nobody_is_accused(copied: Path, anew: Path) -> None:
    in_entry(lambda e: e.pop("sha256"))(copied)
    write("truth/small-0000/target.parquet", "x")(copied)
    assert compared(copied, anew) == ("files differ: truth/small-0000/target.parquet")


def test_a_picture_in_other_bytes_was_changed_even_if_it_shows_the_same(
    copied: Path, anew: Path
) -> None:
    folder = copied / "val" / "small-0000"
    with (folder / "000000.png").open("ab") as file:
        file.write(b"behind the end")
    assert compared(copied, anew) == (
        "files differ: val/small-0000/000000.png (the files were changed after they "
        "were made)"
    )


def test_an_untouched_data_set_is_the_same_on_another_machine(
    native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = made_with() | {"processor": "Z80"}
    monkeypatch.setattr(simbench.generation.generate, "made_with", lambda: there)
    finding = remade(native, tmp_path / "made")
    assert str(finding) == "small-0000: identical"
    assert finding.elsewhere["processor"][1] == "Z80"


def test_a_picture_that_is_drawn_otherwise_elsewhere_accuses_nobody(
    native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def darker(folder: Path, index: int, image: np.ndarray[Any, Any]) -> None:
        write_frame(folder, index, image - (image > 0))

    def digest(image: np.ndarray[Any, Any]) -> bytes:
        return b"other"

    monkeypatch.setattr(simbench.generation.generate, "write_frame", darker)
    monkeypatch.setattr(simbench.generation.generate, "frame_digest", digest)
    found = str(remade(native, tmp_path / "made"))
    assert found.startswith(
        "small-0000: frames differ from frame 0 on: at most 1 level"
    )
    assert "changed" not in found


def test_subjects_hold_the_path_of_an_entry_and_none_of_its_content(
    copied: Path,
) -> None:
    entry_of(copied).write_text("rubbish")
    (first, second), total = find_targets_to_verify(str(copied))
    assert (first.name, second.name, total) == ("small-0000", "small-0001", 2)
    assert [type(part) for part in first.arguments] == [str, dict, EntryFile]
    assert [first.count_frames(), second.count_frames()] == [0, 2]


def test_a_sample_still_compares_the_whole_and_ends_with_1(
    copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (copied / "val" / "small-0001" / "000000.png").unlink()
    assert execute(["verify", str(copied), "--sample", "1", "-j", "1"]) == 1
    said = capsys.readouterr().out
    assert "small-0000: identical" in said
    assert "files differ: missing: val/small-0001/000000.png" in said
    assert "1 of 2 verified: 1 identical" in said
