"""Atomic writes: complete or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from simbench.core.atomic_write import atomic_write, atomic_write_folder
from simbench.core.errors import DatasetError


def test_file_appears_when_the_block_ends(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "file"
    with atomic_write(path) as temporary:
        temporary.write_text("new")
        assert not path.exists()
    assert path.read_text() == "new"
    assert [p.name for p in path.parent.iterdir()] == ["file"]


def test_file_stays_as_it_was_when_the_block_raises(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), atomic_write(path) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_folder_in_place_of_the_file_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years")
    with pytest.raises(DatasetError, match="expected the path of a file, got a folder"):
        atomic_write(tmp_path).__enter__()
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.txt"]


def test_working_folder_is_refused_as_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(DatasetError, match=r"^\.: expected the path of a file"):
        atomic_write(Path()).__enter__()


def test_folder_made_while_the_file_is_written_stays(tmp_path: Path) -> None:
    path = tmp_path / "file"
    with pytest.raises(DatasetError), atomic_write(path) as temporary:
        temporary.write_text("new")
        (path / "thesis").mkdir(parents=True)
    assert [p.name for p in path.iterdir()] == ["thesis"]
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_folder_replaces_a_folder(tmp_path: Path) -> None:
    path = tmp_path / "folder"
    path.mkdir()
    (path / "old").touch()
    with atomic_write_folder(path) as temporary:
        (temporary / "new").touch()
    assert [p.name for p in path.iterdir()] == ["new"]
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]


def test_folder_stays_as_it_was_when_the_block_raises(tmp_path: Path) -> None:
    path = tmp_path / "folder"
    path.mkdir()
    (path / "old").touch()
    with pytest.raises(KeyboardInterrupt), atomic_write_folder(path) as temporary:
        (temporary / "half").touch()
        raise KeyboardInterrupt
    assert [p.name for p in path.iterdir()] == ["old"]
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]


def test_file_that_a_link_leads_to_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("old")
    (tmp_path / "link").symlink_to("file")
    with atomic_write(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "new"


def test_device_pipe_or_loop_is_refused_and_left_alone(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "null").symlink_to("/dev/null")  # a root's mistake would remove it
    for name in ("pipe", "loop", "null"):
        with pytest.raises(DatasetError, match="expected the path of a file, got a "):
            atomic_write(tmp_path / name).__enter__()
    assert (tmp_path / "pipe").is_fifo()
    assert (tmp_path / "loop").is_symlink()
    assert Path("/dev/null").is_char_device()
