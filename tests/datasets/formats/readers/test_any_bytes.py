"""Whatever bytes a file has, a reader returns, or refuses it in one line."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simbench.core.errors import DatasetError
from simbench.datasets.clip_search import find_places
from simbench.datasets.formats.masks import indexed_png
from simbench.datasets.formats.readers.annotation import ReadOptions
from simbench.datasets.formats.readers.boxes import region_box
from simbench.datasets.formats.readers.indexed_png import object_numbers
from simbench.datasets.frames import (
    decoded_picture,
    encoded_png,
)
from simbench.datasets.picture_header import is_complete_picture, picture_size
from simbench.datasets.read_clip import clip_digest, read_place
from tests.datasets.formats.readers.written import (
    BOXES,
    picture,
    write_otb,
    write_pictures,
    write_rows,
)

LINES = st.text("0123456789.,-+einfaNm \t\n", max_size=80).map(str.encode)
CONTENTS = st.one_of(st.binary(max_size=60), LINES)
FILES = (
    "otb/a/groundtruth_rect.txt",
    "otb/a/attrs.txt",
    "otb/a/cfg.json",
    "vot/b/groundtruth.txt",
    "vot/b/sequence",
    "vot/b/occlusion.tag",
    "got10k/c/cover.label",
    "got10k/c/meta_info.ini",
    "lasot/d/full_occlusion.txt",
    "mot17/e/gt/gt.txt",
    "mot17/e/seqinfo.ini",
    "coco/annotations/instances_val.json",
    "youtube/instances.json",
    "davis/objects.csv",
    "uav123/configSeqs.m",
    "uav123/anno/UAV123/f.txt",
    "nfs/g/30/g.txt",
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One sequence of each layout."""
    root = tmp_path_factory.mktemp("whole")
    write_otb(root / "otb" / "a")
    for folder, pictures in (("vot/b", "color"), ("lasot/d", "img"), ("got10k/c", "")):
        write_pictures(root / folder / pictures, "{:08d}.jpg", range(1, 5))
        write_rows(root / folder / "groundtruth.txt", BOXES)
    (root / "got10k" / "c" / "meta_info.ini").write_text("[METAINFO]\n")
    (root / "lasot" / "d" / "full_occlusion.txt").write_text("0,0,0,0")
    write_pictures(root / "mot17" / "e" / "img1", "{:06d}.jpg", range(1, 5))
    rows = [(i + 1, 3, *box, 1, 1, 1) for i, box in enumerate(BOXES)]
    write_rows(root / "mot17" / "e" / "gt" / "gt.txt", rows)
    write_pictures(root / "coco" / "val" / "h", "{:06d}.jpg", range(4))
    (root / "coco" / "annotations").mkdir()
    write_pictures(root / "youtube" / "JPEGImages" / "i", "{:05d}.jpg", range(4))
    write_pictures(root / "davis" / "JPEGImages" / "480p" / "j", "{}.jpg", range(1))
    masks = root / "davis" / "Annotations" / "480p" / "j"
    masks.mkdir(parents=True)
    (masks / "0.png").write_bytes(indexed_png(picture(1)[..., 0] % 2))
    images = root / "uav123" / "data_seq" / "UAV123" / "f"
    write_pictures(images, "{:06d}.jpg", range(1, 5))
    write_rows(root / "uav123" / "anno" / "UAV123" / "f.txt", BOXES)
    write_pictures(root / "nfs" / "g" / "30" / "g", "{:05d}.jpg", range(1, 5))
    return root


@pytest.fixture(scope="module")
def there(whole: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    copy = tmp_path_factory.mktemp("there") / "sets"
    shutil.copytree(whole, copy)
    yield copy


@settings(max_examples=150)
@given(name=st.sampled_from(FILES), content=CONTENTS)
def test_any_bytes_of_a_file_are_read_or_refused_in_one_line(
    whole: Path, there: Path, name: str, content: bytes
) -> None:
    _read_or_refuse(whole, there, name, content)


def _read_or_refuse(whole: Path, there: Path, name: str, content: bytes) -> None:
    (there / name).write_bytes(content)
    try:
        for place in find_places(there / name.partition("/")[0], ReadOptions()):
            sequence, read = read_place(place, ReadOptions())
            clip_digest(place, ReadOptions(), read)
            assert len(sequence) == len(sequence.truth.boxes)
    except DatasetError as error:
        assert len(str(error).splitlines()) == 1
    finally:
        (there / name).unlink()
        if (whole / name).exists():
            shutil.copyfile(whole / name, there / name)


JSON = st.recursive(
    st.sampled_from([None, 1, -1, 0.5, "x", "h/000000.jpg", "..", True]),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(
            st.sampled_from(
                "images annotations videos id file_name file_names image_id video_id "
                "track_id bbox bboxes is_target".split()
            ),
            inner,
            max_size=5,
        ),
    ),
    max_leaves=20,
)


@settings(max_examples=200)
@given(value=JSON)
def test_any_json_is_read_or_refused_in_one_line(
    whole: Path, there: Path, value: object
) -> None:
    content = json.dumps(value).encode()
    for file in ("coco/annotations/instances_val.json", "youtube/instances.json"):
        _read_or_refuse(whole, there, file, content)


@settings(max_examples=200)
@given(st.text("0123456789.,-einfaNm ", max_size=60))
def test_any_text_is_a_region_or_refused(line: str) -> None:
    try:
        box, _ = region_box(line, "here")
        assert len(box) == 4
    except DatasetError as error:
        assert str(error).startswith("here: ")


_PNG = encoded_png(picture(0, 16, 12))
_NUMBERS = indexed_png(picture(0, 16, 12)[..., 0] % 5)


@settings(max_examples=200)
@given(data=st.data())
def test_any_picture_is_decoded_or_refused(data: st.DataObject) -> None:
    base = data.draw(st.sampled_from([_PNG, _NUMBERS, b"\xff\xd8\xff\xe0", b"RIFF"]))
    start = data.draw(st.integers(0, len(base)))
    put = data.draw(st.binary(max_size=40))
    content = base[:start] + put + base[start + len(put) :]
    assert all(isinstance(one, int) for one in picture_size(content))
    is_complete_picture(content)
    for decode in (decoded_picture, object_numbers):
        try:
            decode(content, Path("here"))
        except DatasetError as error:
            assert str(error).startswith("here: ")
