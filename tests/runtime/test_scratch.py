"""Temporary folders: removed at the end, or after a kill by the next process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from simbench.core.errors import DatasetError
from simbench.runtime.scratch import SCRATCH_MARK, scratch_folder

WORKS = """
import pathlib, sys
from simbench.runtime.scratch import scratch_folder
with scratch_folder("one-") as one, scratch_folder("two-") as two:
    (pathlib.Path(one) / "file").write_text("x")
    print(one, flush=True)
    sys.stdin.read()
"""
NAME = "simbench-abcd_123.scratch"


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return tmp_path


def works() -> subprocess.Popen[str]:
    """Return a process that holds two folders, once it has made them."""
    process = subprocess.Popen(
        [sys.executable, "-c", WORKS],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert Path(process.stdout.readline().strip()).is_dir()
    return process


def test_process_leaves_nothing(place: Path) -> None:
    with works() as process:
        assert len(list(place.iterdir())) == 1
        process.communicate()
    assert process.returncode == 0
    assert list(place.iterdir()) == []


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_folders_of_a_killed_process_are_removed_by_the_next(
    place: Path, how: signal.Signals
) -> None:
    with works() as killed:
        killed.send_signal(how)
    with works() as living:
        assert len(list(place.iterdir())) == 1
        with works() as third:
            assert len(list(place.iterdir())) == 2  # that of a living one stays
            third.communicate()
        living.communicate()
    assert list(place.iterdir()) == []


def test_kill_between_two_steps_leaves_what_the_next_process_removes(
    place: Path,
) -> None:
    (place / NAME).mkdir()  # killed before it made the mark
    (place / "simbench-12345678.scratch").mkdir()
    (place / "simbench-12345678.scratch" / SCRATCH_MARK).touch()  # or wrote it
    with scratch_folder("x-") as folder:
        assert list(place.iterdir()) == [Path(folder).parent]


def test_folders_of_others_stay(place: Path) -> None:
    (place / NAME).mkdir()
    (place / NAME / "mine").touch()  # without our mark
    (place / "simbench-results").mkdir()
    other = place / "simbench-87654321.scratch"
    other.mkdir()
    (other / SCRATCH_MARK).write_text("another-machine")
    target = place / "target"
    target.mkdir()
    (target / SCRATCH_MARK).touch()
    (place / "simbench-linklink.scratch").symlink_to(target)
    before = {path.name for path in place.rglob("*")}
    with scratch_folder("x-") as folder:
        own = {Path(folder).parent.name, Path(folder).name}
        after = {path.name for path in place.rglob("*")}
    assert after - own == before


def test_forked_process_leaves_the_folders_of_its_parent(place: Path) -> None:
    with scratch_folder("x-") as folder:
        child = os.fork()
        if child == 0:
            try:
                from simbench.runtime.scratch import _Place

                _Place._known.clear()  # as at its end
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        assert Path(folder).is_dir()


def test_missing_place_is_told_in_one_line(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(place / "nowhere"))
    with pytest.raises(DatasetError, match=r"TMPDIR.: No such file") as caught:
        scratch_folder("x-")
    assert "\n" not in str(caught.value)
