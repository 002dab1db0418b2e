"""A damaged sequence is refused in one line that names the file and the line in it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import simbench
from simbench.core.errors import DatasetError
from simbench.datasets.clip_search import find_places
from simbench.datasets.formats.masks import indexed_png
from simbench.datasets.formats.readers.annotation import ReadOptions
from simbench.datasets.read_clip import clip_digest, read_place
from tests.datasets.formats.readers.written import (
    BOXES,
    write_otb,
    write_picture,
    write_pictures,
    write_rows,
)

Damage = Callable[[Path], object]


def read_whole(folder: Path) -> str:
    """Read a sequence as ``simbench evaluate`` does before it runs trackers."""
    (place,) = find_places(folder, ReadOptions())
    _, read = read_place(place, ReadOptions())
    return clip_digest(place, ReadOptions(), read)


def lines(*rows: object) -> Damage:
    def damage(folder: Path) -> None:
        text = "\n".join(map(str, rows))
        (folder / "groundtruth_rect.txt").write_text(text + "\n")

    return damage


def cut(folder: Path) -> None:
    path = folder / "img" / "0003.jpg"
    path.write_bytes(path.read_bytes()[:-200])


def link_out(folder: Path) -> None:
    path = folder / "img" / "0002.jpg"
    path.rename(folder.parent / "elsewhere.jpg")
    path.symlink_to(folder.parent / "elsewhere.jpg")


def _sparse(folder: Path) -> None:
    os.truncate(folder / "groundtruth_rect.txt", 2**40)


BOX = "10,12,8,6"
CORNERS = [f"{44 + i},30,{52 + i},36" for i in range(4)]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        pytest.param(
            lines(BOX, BOX, BOX),
            r"groundtruth_rect\.txt:3: expected 4 boxes, one a picture, got 3$",
            id="fewer boxes",
        ),
        pytest.param(
            lines(BOX, BOX, BOX, BOX, BOX),
            r"rect\.txt:5: expected 4 boxes, one a picture, got 5$",
            id="more boxes",
        ),
        pytest.param(
            lines(BOX, "NaN,1,2,3", BOX, BOX),
            r"rect\.txt:2: expected left,top,width,height of a box, got not a number$",
            id="not a number",
        ),
        pytest.param(
            lines(BOX, BOX, "10,12,eight,6", BOX),
            r"rect\.txt:3: expected left,top,width,height, got '10,12,eight,6'$",
            id="words",
        ),
        pytest.param(
            lines(BOX, BOX, "", BOX),
            r"rect\.txt:3: expected left,top,width,height, got an empty line$",
            id="empty line",
        ),
        pytest.param(
            lines(BOX, "10,12,8", BOX, BOX),
            r"rect\.txt:2: expected left,top,width,height, got '10,12,8'$",
            id="three columns",
        ),
        pytest.param(
            lines(BOX, BOX, BOX, "10,12,-8,6"),
            r"rect\.txt:4: expected left,top,width,height of a box, got 10,12,-8,6$",
            id="negative width",
        ),
        pytest.param(
            lines(BOX, BOX, BOX, "10,12,1e30,6"),
            r"rect\.txt:4: expected numbers of at most 1000000, got",
            id="huge number",
        ),
        pytest.param(
            lines(*CORNERS),
            r"rect\.txt:1: expected left,top,width,height of a box in a picture of "
            r"64 x 48 px, got 44,30,52,36: its centre is outside, as that of 4 of 4; "
            r"are columns swapped, or is it two corners\?$",
            id="corners",
        ),
        pytest.param(
            lines("30,50,8,6", *["30,50,8,6"] * 3),
            r"rect\.txt:1: .* are columns swapped",
            id="swapped columns",
        ),
        pytest.param(
            lines("0,0,0,0", BOX, BOX, BOX),
            r"rect\.txt:1: expected a box of the target in the first frame, got none$",
            id="absent at first",
        ),
        pytest.param(
            lambda f: (f / "groundtruth_rect.txt").write_text(""),
            r"rect\.txt: expected a line a frame, got an empty file$",
            id="empty annotation",
        ),
        pytest.param(
            lambda f: (f / "groundtruth_rect.txt").write_bytes(b"\xff\xfe\x00"),
            r"rect\.txt: expected text, got other bytes$",
            id="no text",
        ),
        pytest.param(
            _sparse, r"rect\.txt: cannot be read: expected at most", id="endless"
        ),
        pytest.param(
            lambda f: (f / "img" / "0002.jpg").unlink(),
            r"img/0002\.jpg: missing, the next picture is 0003\.jpg$",
            id="missing frame",
        ),
        pytest.param(
            lambda f: write_picture(f / "img" / "2.png", 7),
            r"img/2\.png: expected one picture of number 2, got two$",
            id="number twice",
        ),
        pytest.param(
            cut, r"0003\.jpg: not a readable picture: the file is cut", id="cut"
        ),
        pytest.param(
            lambda f: (f / "img" / "0004.jpg").write_bytes(b""),
            r"0004\.jpg: expected a picture, got an empty file$",
            id="empty picture",
        ),
        pytest.param(
            lambda f: (f / "img" / "0001.jpg").write_bytes(b"GIF89a nothing"),
            r"0001\.jpg: expected a picture, got not a readable picture$",
            id="no picture",
        ),
        pytest.param(
            lambda f: write_picture(f / "img" / "0003.jpg", 3, 80, 48),
            r"0003\.jpg: expected 64 x 48 px as the first frame, got 80 x 48$",
            id="other size",
        ),
        pytest.param(
            link_out, r"0002\.jpg: .* a link that leads out of it$", id="link out"
        ),
    ],
)
def test_damage_of_a_sequence_is_one_line(
    damage: Damage, message: str, tmp_path: Path
) -> None:
    folder = write_otb(tmp_path / "a")
    damage(folder)
    with pytest.raises(DatasetError, match=message) as caught:
        read_whole(folder)
    assert str(folder) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_cut_png_is_found_without_decoding(tmp_path: Path) -> None:
    folder = write_otb(tmp_path / "a", pattern="{:04d}.png")
    path = folder / "img" / "0002.png"
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(DatasetError, match=r"0002\.png: .* the file is cut short"):
        read_whole(folder)


def test_damage_is_found_when_a_frame_is_used(tmp_path: Path) -> None:
    folder = write_otb(tmp_path / "a")
    write_picture(folder / "img" / "0003.jpg", 3, 80, 48)
    frames = simbench.read_sequence(folder).frames
    assert frames[1].index == 1
    with pytest.raises(DatasetError, match=r"0003\.jpg: expected 64 x 48 px"):
        _ = frames[2]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("cover.label", "8\n9\n8\n8\n", r"cover\.label:2: expected a level from 0 to"),
        ("absence.label", "0\n" * 5, r"absence\.label:5: expected 4 lines, one a fra"),
        ("occlusion.tag", "0\nyes\n", r"occlusion\.tag:2: expected one number, got"),
        ("visibility.value", "1\n2\n", r"visibility\.value:2: expected a share from"),
    ],
)
def test_damaged_labels_are_named(
    name: str, content: str, message: str, tmp_path: Path
) -> None:
    folder = tmp_path / "a"
    write_pictures(folder, "{:08d}.jpg", range(1, 5))
    write_rows(folder / "groundtruth.txt", BOXES)
    (folder / "meta_info.ini").write_text("[METAINFO]\n")
    (folder / name).write_text(content)
    with pytest.raises(DatasetError, match=message):
        read_whole(folder)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1,2,3,4,5,6,7", r"truth\.txt:2: expected .* got 7 numbers$"),
        ("10,12,-3,6", r"truth\.txt:2: .*of a box, got 10,12,-3,6$"),
        ("m1,2,3", r"truth\.txt:2: expected a mask of whole numbers"),
        ("m0,0,100000,100000,1", r"truth\.txt:2: expected a mask of at most 16777216"),
        ("m0,0,2,2,9", r"truth\.txt:2: expected runs of at most 4 pixels"),
        ("", r"truth\.txt:2: .* got an empty line"),
    ],
)
def test_damaged_regions_are_named(line: str, message: str, tmp_path: Path) -> None:
    write_pictures(tmp_path / "a" / "color", "{:08d}.jpg", range(1, 4))
    text = "\n".join(["10,12,8,6", line, "10,12,8,6"])
    (tmp_path / "a" / "groundtruth.txt").write_text(text)
    with pytest.raises(DatasetError, match=message):
        read_whole(tmp_path / "a")


def test_masks_of_another_size_are_named(tmp_path: Path) -> None:
    write_pictures(tmp_path / "JPEGImages" / "480p" / "a", "{:05d}.jpg", range(2))
    for index, size in enumerate([(48, 64), (48, 60)]):
        path = tmp_path / "Annotations" / "480p" / "a" / f"{index:05d}.png"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(indexed_png(np.ones(size, np.uint8)))
    with pytest.raises(DatasetError, match=r"00001\.png: expected 64 x 48 px as the"):
        read_whole(tmp_path)
