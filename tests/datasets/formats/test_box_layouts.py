"""GOT-10k, VOT, OTB and MOT17: their files and what these contain."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.formats.got10k import Got10k
from simbench.datasets.formats.mot17 import Mot17
from simbench.datasets.formats.otb import Otb
from simbench.datasets.formats.vot import Vot
from tests.datasets.formats.staged_sequence import OTHER_ID, TARGET_ID

LABELS = {"absence.label", "cover.label", "cut_by_image.label", "meta_info.ini"}
DESCRIPTIONS = {
    "anchor.value",
    "displacement.value",
    "groundtruth.txt",
    "occlusion.tag",
    "sequence",
    "visibility.value",
}


def _lines(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines()


def test_got10k_folder_has_pictures_labels_and_files_for_vot(
    staged: Sequence, tmp_path: Path
) -> None:
    Got10k().write(staged, "one", tmp_path)
    pictures = {f"{number:08d}.jpg" for number in range(1, 13)}
    names = {path.name for path in (tmp_path / "val" / "one").iterdir()}
    assert names == pictures | LABELS | DESCRIPTIONS


def test_got10k_labels_are_absence_cuts_and_visible_eighths(
    staged: Sequence, tmp_path: Path
) -> None:
    Got10k().write(staged, "one", tmp_path)
    folder = tmp_path / "val" / "one"
    assert "".join(_lines(folder / "absence.label")) == "000000001100"
    assert "".join(_lines(folder / "cut_by_image.label")) == "000000110010"
    assert "".join(_lines(folder / "cover.label")) == "885048880088"
    assert "".join(_lines(folder / "occlusion.tag")) == "001110000000"
    assert _lines(folder / "visibility.value")[2] == "0.600000"
    assert _lines(folder / "displacement.value")[:2] == ["nan", "6.0000"]
    boxes = _lines(folder / "groundtruth.txt")
    # the box of the truth, a quarter of a pixel around pixels 2..12 and 4..12
    assert boxes[0] == "1.7500,3.7500,10.5000,8.5000"
    # over the right border of the picture, 48 px wide, and not cut there
    assert boxes[7] == "45.7500,3.7500,10.5000,8.5000"
    assert boxes[8] == "0.0000,0.0000,0.0000,0.0000"


def test_got10k_meta_has_the_order_that_pytracking_requires(
    staged: Sequence, tmp_path: Path
) -> None:
    Got10k().write(staged, "one", tmp_path)
    lines = _lines(tmp_path / "val" / "one" / "meta_info.ini")
    assert lines == [
        "[METAINFO]",
        "url: simbench:staged:7",
        "begin: 00:00:00",
        "end: 00:00:01",
        "anno_fps: 10Hz",
        "object_class: car",
        "motion_class: driving",
        "major_class: car",
        "root_class: vehicle",
        "motion_adverb: unknown",
        "resolution: (48, 32)",
    ]


def test_got10k_meta_class_is_unknown_without_vehicles(
    staged: Sequence, tmp_path: Path
) -> None:
    bare = replace(staged, seed=None, truth=replace(staged.truth, vehicles=None))
    Got10k().write(bare, "one", tmp_path)
    lines = _lines(tmp_path / "val" / "one" / "meta_info.ini")
    assert "object_class: unknown" in lines
    assert "url: simbench:staged" in lines


def test_vot_folder_has_its_own_pictures_and_tags(
    staged: Sequence, tmp_path: Path
) -> None:
    Vot().write(staged, "one", tmp_path)
    folder = tmp_path / "sequences" / "one"
    names = {path.name for path in folder.iterdir()}
    assert names == DESCRIPTIONS | {"color", "absence.tag", "cut_by_image.tag"}
    assert (folder / "color" / "00000012.png").is_file()
    assert "".join(_lines(folder / "absence.tag")) == "000000001100"
    facts = dict(line.split("=", 1) for line in _lines(folder / "sequence"))
    assert facts["channels.color"] == "color/%08d.png"
    assert (facts["fps"], facts["length"]) == ("10", "12")
    assert (facts["simbench.scenario"], facts["simbench.seed"]) == ("staged", "7")


def test_otb_names_are_mapped_to_scenarios_and_seeds(
    staged: Sequence, tmp_path: Path
) -> None:
    layout = Otb()
    entries = [layout.write(staged, "Car1", tmp_path)]
    entries += [layout.write(replace(staged, seed=None), "Car2", tmp_path)]
    files = {path: "".join(chunks) for path, chunks in layout.index(entries)}
    assert files["names.csv"] == "name,scenario,seed\nCar1,staged,7\nCar2,staged,\n"
    assert files["list.txt"] == "Car1\nCar2\n"
    assert (tmp_path / "Car1" / "img" / "0012.jpg").is_file()
    assert len(_lines(tmp_path / "Car1" / "groundtruth_rect.txt")) == 12


def test_otb_refuses_a_name_that_its_readers_would_skip(
    staged: Sequence, tmp_path: Path
) -> None:
    with pytest.raises(DatasetError, match="would silently skip 'poles-0001'"):
        Otb().write(staged, "poles-0001", tmp_path)


def test_otb_refuses_frames_that_its_readers_would_misorder(
    staged: Sequence, tmp_path: Path
) -> None:
    long = replace(staged, frames=[staged.frames[0]] * 10_000)
    with pytest.raises(DatasetError, match=r"at most 9999 frames.* got 10000 in stag"):
        Otb().write(long, "Car1", tmp_path)
    assert not any(tmp_path.iterdir())


def test_mot17_rows_count_from_one_and_have_the_visible_fraction(
    staged: Sequence, tmp_path: Path
) -> None:
    Mot17().write(staged, "one", tmp_path)
    rows = _lines(tmp_path / "MOT17-train" / "one" / "gt" / "gt.txt")
    mine = [row for row in rows if row.split(",")[1] == str(TARGET_ID)]
    # frame, id, left + 1, top + 1, width, height, considered, pedestrian, visible
    assert mine[0] == "1,5,2.7500,4.7500,10.5000,8.5000,1,1,1.000000"
    assert mine[3] == "4,5,21.7500,4.7500,10.5000,8.5000,1,1,0.000000"
    assert [int(row.split(",")[0]) for row in mine] == [*range(1, 9), 11, 12]


def test_mot17_rows_start_and_end_with_a_visible_vehicle(
    staged: Sequence, tmp_path: Path
) -> None:
    Mot17().write(staged, "one", tmp_path)
    rows = _lines(tmp_path / "MOT17-train" / "one" / "gt" / "gt.txt")
    other = [row.split(",") for row in rows if row.split(",")[1] == str(OTHER_ID)]
    assert [int(row[0]) for row in other] == list(range(2, 12))
    hidden = [int(row[0]) for row in other if float(row[8]) == 0.0]
    assert hidden == [6]


def test_mot17_visibility_is_zero_or_one_where_unknown(
    staged: Sequence, tmp_path: Path
) -> None:
    assert staged.truth.vehicles is not None
    vehicles = replace(staged.truth.vehicles, visible_fraction=None)
    bare = replace(staged, truth=replace(staged.truth, vehicles=vehicles))
    Mot17().write(bare, "one", tmp_path)
    rows = _lines(tmp_path / "MOT17-train" / "one" / "gt" / "gt.txt")
    assert {row.split(",")[8] for row in rows} == {"0.000000", "1.000000"}


def test_mot17_lists_the_classes_of_vehicles_beside_the_truth(
    staged: Sequence, tmp_path: Path
) -> None:
    Mot17().write(staged, "one", tmp_path)
    lines = _lines(tmp_path / "MOT17-train" / "one" / "gt" / "vehicles.csv")
    assert lines == [
        "id,name,class,length_m,width_m,height_m,colour",
        "3,other,truck,7.100,2.400,2.400,#0000fa",
        "5,target,car,4.500,1.800,1.500,#c8140a",
    ]


def test_mot17_index_has_the_header_that_readers_skip() -> None:
    ((path, chunks),) = Mot17().index([{"name": "a"}, {"name": "b"}])
    assert path == "seqmaps/MOT17-train.txt"
    assert "".join(chunks) == "name\na\nb\n"
