"""Lock files and folders for temporary files: only what we made is ever changed."""

from __future__ import annotations

import errno
import fcntl
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from simbench.core.errors import DatasetError
from simbench.runtime.locks import empty_folder, is_lock_file, locked

HOLDS = """
import pathlib, sys
from simbench.runtime.locks import locked
with locked(pathlib.Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_lock_of_another_process_is_refused_until_it_is_killed(tmp_path: Path) -> None:
    lock = tmp_path / ".lock"
    with subprocess.Popen(
        [sys.executable, "-c", HOLDS, lock],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == "held\n"
        said = lock.read_text()
        assert said.startswith(f"simbench lock\nprocess {holder.pid} on ")
        with pytest.raises(DatasetError, match="another run is writing here"):
            with locked(lock):
                pass
        assert lock.read_text() == said
        holder.send_signal(signal.SIGKILL)
        holder.wait()
    with locked(lock):
        assert f"process {os.getpid()} on " in lock.read_text()
    assert lock.read_text() == "simbench lock\n"


def test_empty_lock_file_serves_and_stays_empty(tmp_path: Path) -> None:
    lock = tmp_path / ".lock"  # of version 0.2, or of another program
    lock.touch()
    with locked(lock), pytest.raises(DatasetError, match="another run is writing"):
        locked(lock).__enter__()
    assert lock.read_text() == ""
    assert not is_lock_file(lock)


@pytest.mark.parametrize("text", ["simbench lock\n", "simbench lock\nprocess 1\n"])
def test_own_lock_file_is_used_again(tmp_path: Path, text: str) -> None:
    lock = tmp_path / ".lock"
    lock.write_text(text)
    with locked(lock):
        assert is_lock_file(lock)
    assert is_lock_file(lock)


def test_lock_file_of_another_program_is_refused_as_it_is(tmp_path: Path) -> None:
    lock = tmp_path / ".lock"
    lock.write_text("pid 7 of a mail reader\n")
    with pytest.raises(DatasetError, match="expected a lock file of simbench, found"):
        with locked(lock):
            pass
    assert lock.read_text() == "pid 7 of a mail reader\n"
    assert not is_lock_file(lock)


def test_what_is_no_lock_file_is_refused_in_one_line(tmp_path: Path) -> None:
    other = tmp_path / "precious"
    other.write_text("")
    (tmp_path / "link").symlink_to(other)
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    names = [
        "link",
        "loop",
        "folder",
        "pipe",
        "x" * 300,
        "precious/.lock",
        "none/.lock",
    ]
    for name in [*names, "nul\0nul"]:
        with pytest.raises(DatasetError) as caught:
            with locked(tmp_path / name):
                pass
        assert "\n" not in str(caught.value)
        assert not is_lock_file(tmp_path / name)
    assert other.read_text() == ""


def test_file_system_without_locks_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flock(handle: int, how: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", flock)
    with pytest.raises(DatasetError, match="No locks available: expected a file sys"):
        with locked(tmp_path / ".lock"):
            pass


def test_scratch_folder_is_emptied_of_what_a_killed_run_left(tmp_path: Path) -> None:
    scratch = tmp_path / "a" / ".scratch"
    killed = empty_folder(scratch)
    with killed as folder:
        (folder / "deep").mkdir()
        (folder / "deep" / "file").write_text("x")
        (folder / "link").symlink_to(tmp_path)
        with empty_folder(scratch) as again:
            assert [path.name for path in again.iterdir()] == [".simbench-scratch"]
    assert not scratch.exists() and tmp_path.exists()


def test_scratch_folder_of_the_user_is_refused_as_it_is(tmp_path: Path) -> None:
    scratch = tmp_path / ".scratch"
    (scratch / ".git").mkdir(parents=True)
    (scratch / "notes").write_text("mine")
    with pytest.raises(DatasetError, match="temporary files of simbench, found other"):
        with empty_folder(scratch):
            pass
    assert (scratch / "notes").read_text() == "mine"
    assert sorted(path.name for path in scratch.iterdir()) == [".git", "notes"]


def test_place_that_cannot_be_a_scratch_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path)
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for name in ("file", "link", "loop", "file/below", "x" * 300):
        with pytest.raises(DatasetError) as caught:
            with empty_folder(tmp_path / name):
                pass
        assert "\n" not in str(caught.value)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["file", "link", "loop"]
