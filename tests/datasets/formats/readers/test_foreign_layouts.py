"""Layouts of others, made by hand after their documentation."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

import simbench
from simbench.core.box import Box
from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.clip_search import find_places
from simbench.datasets.formats.masks import indexed_png
from simbench.datasets.formats.readers.annotation import ReadOptions
from tests.datasets.formats.readers.written import (
    BOXES,
    HEIGHT,
    WIDTH,
    indices,
    picture,
    write_otb,
    write_pictures,
    write_rows,
)

CAR4 = (70, 51, 107, 87)
"""The first line of OTB's Car4, in a picture of 360 x 240 px."""


def lefts(sequence: Sequence) -> list[float]:
    return [float(left) for left in sequence.truth.boxes[:, 0]]


def names(path: Path) -> list[str]:
    return [place.name for place in find_places(path, ReadOptions())]


@pytest.mark.parametrize("between", [",", "\t", " ", ", ", "   "])
@pytest.mark.parametrize("pattern", ["{:04d}.jpg", "{:05d}.png", "{}.bmp"])
def test_otb_of_any_name_digits_and_separators(
    between: str, pattern: str, tmp_path: Path
) -> None:
    folder = write_otb(tmp_path / "my car", between=between, pattern=pattern)
    found = simbench.read_sequence(folder)
    assert (found.name, found.seed, len(found)) == ("my car", None, 4)
    assert lefts(found) == [9, 11, 13, 15]  # OTB's first pixel is number 1
    assert indices(found) == [0, 1, 2, 3]


def test_pictures_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    rows = [(10, 12, 8, 6)] * 11
    folder = write_otb(tmp_path / "a", rows, pattern="{}.png", frames=11)
    assert indices(simbench.read_sequence(folder)) == [*range(7), *range(4)]


def test_first_box_of_car4_counts_from_one(tmp_path: Path) -> None:
    folder = tmp_path / "Car4"
    for index in range(2):
        path = folder / "img" / f"{index + 1:04d}.jpg"
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path), np.zeros((240, 360), np.uint8))
    write_rows(folder / "groundtruth_rect.txt", [CAR4, CAR4])
    first = Box.from_array(simbench.read_sequence(folder).truth.boxes[0])
    assert first == Box(69.0, 50.0, 107.0, 87.0)
    as_written = simbench.read_sequence(folder, origin=0).truth.boxes[0]
    assert as_written.tolist() == list(CAR4)


def test_what_recorded_data_do_not_tell_is_unknown(tmp_path: Path) -> None:
    truth = simbench.read_sequence(write_otb(tmp_path / "a")).truth
    assert np.isnan(truth.visible_fraction).all()
    assert np.isnan(truth.visible_boxes).all()
    assert set(truth.occluders) == {"unknown"}
    assert truth.vehicles is None
    assert truth.displacement_px[1:].tolist() == [2, 5**0.5, 2]


def test_several_targets_of_otb_are_clips_of_their_own(tmp_path: Path) -> None:
    folder = write_otb(tmp_path / "Jogging")
    (folder / "groundtruth_rect.txt").rename(folder / "groundtruth_rect.1.txt")
    others = [(left + 20, *rest) for left, *rest in BOXES]
    write_rows(folder / "groundtruth_rect.2.txt", others)
    assert names(folder) == ["Jogging.1", "Jogging.2"]
    assert lefts(simbench.read_sequence(folder, target="2")) == [29, 31, 33, 35]
    with pytest.raises(DatasetError, match=r"one sequence, found 2: Jogging\.1, Jog"):
        simbench.read_sequence(folder)


def test_otb_sequences_with_more_pictures_than_boxes_are_cut(tmp_path: Path) -> None:
    rows = [(10 + 0.1 * i, 12, 8, 6) for i in range(215)]
    folder = write_otb(tmp_path / "Diving", rows, frames=231)
    assert len(simbench.read_sequence(folder)) == 215


def test_otb_attributes_hold_for_all_frames(tmp_path: Path) -> None:
    folder = write_otb(tmp_path / "a")
    (folder / "attrs.txt").write_text("IV, OCC\n")
    found = simbench.read_sequence(folder).attributes
    assert found["illumination_change"].tolist() == [1, 1, 1, 1]
    assert found["deformation"].tolist() == [0, 0, 0, 0]
    (folder / "attrs.txt").unlink()
    (folder / "cfg.json").write_text(json.dumps({"attributes": ["SV"]}))
    assert simbench.read_sequence(folder).attributes["scale_change"].all()


def test_tlp_has_frame_and_lost_beside_the_box(tmp_path: Path) -> None:
    rows = [(i + 1, *box, int(i == 2)) for i, box in enumerate(BOXES)]
    folder = write_otb(tmp_path / "Alladin", rows, pattern="{:05d}.jpg")
    assert [p.layout for p in find_places(folder, ReadOptions())] == ["tlp"]
    found = simbench.read_sequence(folder)
    assert found.truth.absent.tolist() == [False, False, True, False]
    np.testing.assert_array_equal(lefts(found), [9, 11, np.nan, 15])


def test_got10k_test_split_has_one_box_and_the_rest_is_unknown(tmp_path: Path) -> None:
    folder = tmp_path / "test" / "GOT-10k_Test_000001"
    write_pictures(folder, "{:08d}.jpg", range(1, 4))
    write_rows(folder / "groundtruth.txt", [(10.5, 12, 8, 6)])
    (folder / "meta_info.ini").write_text("[METAINFO]\nanno_fps: 10Hz\n")
    found = simbench.read_sequence(tmp_path)
    np.testing.assert_array_equal(lefts(found), [10.5, np.nan, np.nan])
    assert not found.truth.absent.any()
    assert found.frames[1].time_s == pytest.approx(0.1)


def _lasot(folder: Path) -> Path:
    write_pictures(folder / "img", "{:08d}.jpg", range(1, 5))
    write_rows(folder / "groundtruth.txt", BOXES)
    (folder / "full_occlusion.txt").write_text("0,1,0,0")
    (folder / "out_of_view.txt").write_text("0,0,1,0")
    (folder / "nlp.txt").write_text("a white car")
    return folder


def test_lasot_full_occlusion_is_hidden_and_out_of_view_is_absent(
    tmp_path: Path,
) -> None:
    _lasot(tmp_path / "car" / "car-1")
    found = simbench.read_sequence(tmp_path)
    truth = found.truth
    np.testing.assert_array_equal(truth.visible_fraction, [np.nan, 0, 0, np.nan])
    assert truth.absent.tolist() == [False, False, True, False]
    np.testing.assert_array_equal(lefts(found), [9, 11, np.nan, 15])
    assert found.attributes["out_of_view"].tolist() == [0, 0, 1, 0]


def _uav123(root: Path) -> Path:
    write_pictures(root / "data_seq" / "UAV123" / "car1", "{:06d}.jpg", range(1, 5))
    write_pictures(root / "data_seq" / "UAV123" / "bird1", "{:06d}.jpg", range(1, 9))
    rows = [*BOXES[:3], ("NaN", "NaN", "NaN", "NaN")]
    write_rows(root / "anno" / "UAV123" / "car1.txt", rows)
    write_rows(root / "anno" / "UAV123" / "bird1_2.txt", BOXES)
    struct = (
        "struct('name','{}','path','.\\data_seq\\UAV123\\{}\\','startFrame',{},"
        "'endFrame',{},'nz',6,'ext','jpg','init_rect',[0,0,0,0]),...\n"
    )
    (root / "configSeqs.m").write_text(
        struct.format("car1", "car1", 1, 4) + struct.format("bird1_2", "bird1", 3, 6)
    )
    return root


def test_uav123_boxes_are_apart_from_the_pictures(tmp_path: Path) -> None:
    root = _uav123(tmp_path)
    assert names(root) == ["bird1_2", "car1"]
    found = simbench.read_sequence(root / "data_seq" / "UAV123" / "car1")
    assert found.truth.absent.tolist() == [False, False, False, True]
    assert lefts(found)[:3] == [9, 11, 13]
    bird = simbench.read_sequence(root / "data_seq" / "UAV123" / "bird1")
    assert indices(bird) == [2, 3, 4, 5]  # numbers 3 to 6


def test_nfs_takes_every_eighth_box_at_30_frames_a_second(tmp_path: Path) -> None:
    folder = tmp_path / "airboard_1"
    write_pictures(folder / "30" / folder.name, "{:05d}.jpg", range(1, 4))
    rows = [
        (0, 10 + i, 12, 18 + i, 18, i, int(i == 8), 0, 1, '"air board"')
        for i in range(24)
    ]
    write_rows(folder / "30" / "airboard_1.txt", rows, " ")
    found = simbench.read_sequence(tmp_path)
    np.testing.assert_array_equal(lefts(found), [10, np.nan, 26])
    assert found.truth.boxes[2].tolist() == [26, 12, 8, 6]
    assert found.truth.absent.tolist() == [False, True, False]
    write_pictures(folder / "240" / folder.name, "{:05d}.jpg", range(1, 25))
    write_rows(folder / "240" / "airboard_1.txt", rows, " ")
    assert names(tmp_path) == ["airboard_1-30", "airboard_1-240"]


def _mot17(folder: Path) -> Path:
    write_pictures(folder / "img1", "{:06d}.jpg", range(1, 7))
    (folder / "seqinfo.ini").write_text("[Sequence]\nimDir=img1\nframeRate=25\n")
    rows = [(frame, 3, 10 + frame, 12, 8, 6, 1, 1, 0.5) for frame in (2, 3, 5)]
    rows += [(frame, 4, 30, 12, 8, 6, 1, 1, 1.0) for frame in range(1, 7)]
    write_rows(folder / "gt" / "gt.txt", rows)
    return folder


def test_mot17_target_is_chosen_by_its_id(tmp_path: Path) -> None:
    folder = _mot17(tmp_path / "MOT17-02-FRCNN")
    with pytest.raises(
        DatasetError, match=r"expected --target with one of its 2 objects: 3, 4$"
    ):
        simbench.read_sequence(folder)
    found = simbench.read_sequence(folder, target="3")
    assert found.name == "MOT17-02-FRCNN.3"
    # from its first row to its last; absent where it has none
    np.testing.assert_array_equal(lefts(found), [11, 12, np.nan, 14])
    assert found.truth.visible_fraction.tolist() == [0.5, 0.5, 0, 0.5]
    assert indices(found) == [1, 2, 3, 4]
    with pytest.raises(DatasetError, match=r"gt\.txt: expected rows of id 9, got none"):
        simbench.read_sequence(folder, target="9")


@pytest.mark.parametrize("size", ["480p", "1080p", ""])
def test_davis_objects_are_clips_where_they_have_pixels(
    size: str, tmp_path: Path
) -> None:
    write_pictures(tmp_path / "JPEGImages" / size / "swan", "{:05d}.jpg", range(3))
    folder = tmp_path / "Annotations" / size / "swan"
    folder.mkdir(parents=True)
    for index in range(3):
        numbers = np.zeros((HEIGHT, WIDTH), np.uint8)
        numbers[5:9, 10 + index : 20 + index] = 1
        if index < 2:
            numbers[20:30, 40:44] = 2
        numbers[9] = 255  # void
        (folder / f"{index:05d}.png").write_bytes(indexed_png(numbers))
    assert names(tmp_path) == ["swan.1", "swan.2"]
    found = simbench.read_sequence(tmp_path, target="1")
    assert found.truth.boxes[1].tolist() == [11, 5, 10, 4]
    second = simbench.read_sequence(tmp_path / "JPEGImages" / size / "swan", target="2")
    assert second.truth.absent.tolist() == [False, False, True]


def test_davis_2016_has_one_object_in_grey(tmp_path: Path) -> None:
    write_pictures(tmp_path / "JPEGImages" / "480p" / "bear", "{:05d}.jpg", range(2))
    folder = tmp_path / "Annotations" / "480p" / "bear"
    folder.mkdir(parents=True)
    for index in range(2):
        numbers = np.zeros((HEIGHT, WIDTH), np.uint8)
        numbers[5:9, 10:20] = 255
        cv2.imwrite(str(folder / f"{index:05d}.png"), numbers)
    found = simbench.read_sequence(tmp_path)
    assert (found.name, found.truth.boxes[0].tolist()) == ("bear", [10, 5, 10, 4])


def _vot(folder: Path, pictures: str, lines: list[str]) -> Path:
    count = len(lines)
    write_pictures(folder / pictures, "{:08d}.jpg", range(1, count + 1))
    (folder / "groundtruth.txt").write_text("\n".join(lines) + "\n")
    return folder


@pytest.mark.parametrize("pictures", ["color", "img", ""])
def test_vot_pictures_are_in_any_of_three_places(pictures: str, tmp_path: Path) -> None:
    folder = _vot(tmp_path / "a", pictures, ["10,12,8,6", "11,12,8,6"])
    assert lefts(simbench.read_sequence(folder)) == [10, 11]  # from 0


def test_vot_pictures_are_where_the_sequence_file_says(tmp_path: Path) -> None:
    folder = _vot(tmp_path / "a", "frames/left", ["10,12,8,6", "11,12,8,6"])
    (folder / "sequence").write_text(
        "channels.color=frames/left/%08d.jpg\nname=a\nfps=50\n"
    )
    found = simbench.read_sequence(folder)
    assert found.frames[1].time_s == pytest.approx(0.02)


def test_vot_regions_of_all_kinds(tmp_path: Path) -> None:
    lines = [
        "20,10,30,20,20,30,10,20",  # a square on its corner, of area 200
        "m10,12,4,2,1,2,2,1",  # pixels 11, 12 in line 12 and 11 in line 13
        "0",
        "0,0,0,0",
        "nan,nan,nan,nan",
    ]
    truth = simbench.read_sequence(_vot(tmp_path / "a", "color", lines)).truth
    side = 200**0.5
    assert truth.boxes[0] == pytest.approx([20 - side / 2] * 2 + [side] * 2)
    assert truth.boxes[1].tolist() == [11, 12, 2, 2]
    assert np.isnan(truth.boxes[2:]).all()
    # a code or NaN is not known, a region without area is known not to be there
    assert truth.absent.tolist() == [False, False, False, True, False]


def test_vot_labels_are_attributes_by_frame(tmp_path: Path) -> None:
    folder = _vot(tmp_path / "a", "color", ["10,12,8,6"] * 3)
    (folder / "occlusion.tag").write_text("0\n1\n0\n")
    (folder / "illum_change.label").write_text("1\n1\n")
    found = simbench.read_sequence(folder).attributes
    assert found["occlusion"].tolist() == [0, 1, 0]
    np.testing.assert_array_equal(found["illumination_change"], [1, 1, np.nan])


def test_vot_targets_of_their_own_files(tmp_path: Path) -> None:
    folder = _vot(tmp_path / "a", "color", ["10,12,8,6"] * 2)
    (folder / "groundtruth.txt").rename(folder / "groundtruth_dog.txt")
    (folder / "groundtruth_cat.txt").write_text("30,12,8,6\n" * 2)
    assert names(folder) == ["a.cat", "a.dog"]


@pytest.fixture
def video(tmp_path: Path) -> Path:
    path = tmp_path / "drive.avi"
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), code, 20.0, (WIDTH, HEIGHT))
    for index in range(6):
        writer.write(np.full((HEIGHT, WIDTH, 3), 40 * index, np.uint8))
    writer.release()
    return path


def test_video_is_decoded_in_any_order(video: Path) -> None:
    found = simbench.read_sequence(video, box=(10, 12, 8, 6))
    assert (found.name, len(found), found.width) == ("drive", 6, WIDTH)
    levels = [int(found.frames[i].image.mean()) // 40 for i in (0, 1, 5, 2, -1)]
    assert levels == pytest.approx([0, 1, 5, 2, 5], abs=1)
    assert found.frames[2].time_s == pytest.approx(0.1)
    assert found.truth.boxes[0].tolist() == [10, 12, 8, 6]
    assert np.isnan(found.truth.boxes[1:]).all()
    assert not found.truth.absent.any()


def test_video_and_pictures_need_a_box(video: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="expected --box left,top,width,height of"):
        simbench.read_sequence(video)
    write_pictures(tmp_path / "shots", "shot{}.png", range(3))
    with pytest.raises(DatasetError, match="beside the pictures, found none; pass --b"):
        simbench.read_sequence(tmp_path / "shots")
    found = simbench.read_sequence(tmp_path / "shots", box=(1, 2, 3, 4))
    assert (len(found), found.name) == (3, "shots")
    assert (found.frames[2].image == picture(2)).all()


def test_pictures_are_not_turned_by_their_exif(tmp_path: Path) -> None:
    folder = write_otb(tmp_path / "a")
    sideways = b"\x12\x01\x03\0\x01\0\0\0\x06\0\0\0"  # orientation 6
    turned = b"\xff\xe1\0\x22Exif\0\0II*\0\x08\0\0\0\x01\0" + sideways
    turned += b"\0" * (2 + 0x22 - len(turned))
    for path in (folder / "img").iterdir():
        content = path.read_bytes()
        path.write_bytes(content[:2] + turned + content[2:])
    found = simbench.read_sequence(folder)
    assert found.frames[0].image.shape == (HEIGHT, WIDTH, 3)
