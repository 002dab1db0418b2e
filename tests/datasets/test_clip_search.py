"""Sequences are found at any depth, and told apart by their files."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from simbench.cli.names import LAYOUTS as LAYOUTS_OF_THE_COMMAND_LINE
from simbench.core.errors import DatasetError
from simbench.datasets.clip_search import LAYOUTS, find_places
from simbench.datasets.formats.readers.annotation import ReadOptions
from tests.datasets.formats.readers.written import (
    BOXES,
    write_otb,
    write_pictures,
    write_rows,
)


def test_layouts_of_the_command_line_are_those_that_are_read() -> None:
    assert LAYOUTS_OF_THE_COMMAND_LINE == LAYOUTS


def test_sequences_are_found_below_a_folder_in_order(tmp_path: Path) -> None:
    for name in ("b/Two", "a/deep/er/One", "Zero"):
        write_otb(tmp_path / name)
    (tmp_path / "docs").mkdir()
    (tmp_path / ".hidden").mkdir()
    shutil.copytree(tmp_path / "Zero", tmp_path / ".hidden" / "Zero")
    (tmp_path / "circle").symlink_to(tmp_path)
    found = find_places(tmp_path, ReadOptions())
    assert [place.name for place in found] == ["Zero", "One", "Two"]


def test_a_link_out_of_a_data_set_is_left_out_and_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    write_otb(tmp_path / "set" / "inside")
    write_otb(tmp_path / "other")
    (tmp_path / "set" / "link").symlink_to(tmp_path / "other")
    found = find_places(tmp_path / "set", ReadOptions())
    assert [place.name for place in found] == ["inside"]
    assert f"{tmp_path}/set/link: left out, since it is a link out of" in caplog.text
    (place,) = find_places(tmp_path / "set" / "link", ReadOptions())
    assert place.name == "link"


def test_a_folder_of_two_layouts_is_ambiguous(tmp_path: Path) -> None:
    folder = write_otb(tmp_path / "a")
    write_rows(folder / "groundtruth.txt", BOXES)
    with pytest.raises(
        DatasetError, match="a: may be of the layouts otb and vot: pass --layout with"
    ):
        find_places(tmp_path, ReadOptions())
    for layout in ("otb", "vot"):
        (place,) = find_places(tmp_path, ReadOptions(layout=layout))
        assert place.layout == layout


@pytest.mark.parametrize(
    ("marks", "layout"),
    [
        (["meta_info.ini"], "got10k"),
        (["sequence", "meta_info.ini"], "got10k"),
        (["out_of_view.txt"], "lasot"),
        (["nlp.txt"], "lasot"),
        (["sequence"], "vot"),
        ([], "vot"),
    ],
)
def test_one_name_of_boxes_is_three_layouts(
    marks: list[str], layout: str, tmp_path: Path
) -> None:
    write_pictures(tmp_path / "a" / "img", "{:08d}.jpg", range(1, 5))
    write_rows(tmp_path / "a" / "groundtruth.txt", BOXES)
    for mark in marks:
        (tmp_path / "a" / mark).write_text("fps=30\n")
    (place,) = find_places(tmp_path / "a", ReadOptions())
    assert place.layout == layout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (ReadOptions(), "expected sequences of a known layout (native, otb, tlp, "),
        (ReadOptions(layout="vot"), "expected sequences of the layout vot, found none"),
        (ReadOptions(layout="vott"), "got 'vott' (did you mean 'vot'?)"),
        (ReadOptions(target="7"), "expected sequences with a target 7, found none"),
    ],
)
def test_nothing_known_is_one_line(
    options: ReadOptions, message: str, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("nothing")
    with pytest.raises(DatasetError) as caught:
        find_places(tmp_path, options)
    assert message in str(caught.value)


def test_nothing_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="none: expected a data set, found nothing"):
        find_places(tmp_path / "none", ReadOptions())


def test_a_box_for_data_that_have_boxes_is_refused(tmp_path: Path) -> None:
    write_otb(tmp_path / "a")
    with pytest.raises(DatasetError, match="--box is for a video or pictures without"):
        find_places(tmp_path, ReadOptions(box=(1, 2, 3, 4)))
