"""Temporary folders that do not outlive a process for long, however it ends.

All temporary folders of a process are in one, ``simbench-XXXXXXXX.scratch`` in the
system's place for temporary files. A file in it names the machine and is kept locked by
the process. One that is killed cannot remove its folder, but its lock ends; the next
process that needs a temporary folder removes those without owner.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import socket
import tempfile
import weakref
from pathlib import Path
from typing import ClassVar

from simbench.core.errors import DatasetError

__all__ = ["SCRATCH_MARK", "remove_content", "scratch_folder"]

SCRATCH_MARK = ".simbench-scratch"
"""File in each folder for temporary files that says that we made it."""

_PREFIX, _SUFFIX = "simbench-", ".scratch"
_NAME = re.compile(rf"{_PREFIX}[a-z0-9_]{{8}}{re.escape(_SUFFIX)}")


def scratch_folder(
    prefix: str, within: Path | None = None
) -> tempfile.TemporaryDirectory[str]:
    """Return a new temporary folder, as `tempfile.TemporaryDirectory` does.

    Parameters
    ----------
    prefix : str
        Of its name, to tell what it is for.
    within : Path, optional
        Folder for it that is removed anyway; by default that of this process.

    Raises
    ------
    DatasetError
        If it cannot be made.
    """
    try:
        if within is None:
            within = _Place.of_this_process(tempfile.gettempdir()).folder
        return tempfile.TemporaryDirectory(prefix=prefix, dir=within)
    except OSError as error:
        raise DatasetError(
            f"{error.filename or 'temporary files'}: expected a place for temporary "
            f"files (TMPDIR): {error.strerror}"
        ) from error


def remove_content(folder: Path) -> None:
    """Remove all that is in a folder of ours, except the file that marks it.

    Raises
    ------
    OSError
    """
    for path in folder.iterdir():
        if path.name == SCRATCH_MARK:
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()


class _Place:
    """The folder of this process in a place for temporary files; removed at its end."""

    _known: ClassVar[dict[tuple[int, str], _Place]] = {}

    def __init__(self, parent: str) -> None:
        _remove_abandoned(Path(parent))
        self.folder, handle = _made(parent)
        weakref.finalize(self, _remove_own, self.folder, handle, os.getpid())

    @classmethod
    def of_this_process(cls, parent: str) -> _Place:
        """Return the one of this process, not of one that it was forked from."""
        key = os.getpid(), parent
        if key not in cls._known or not cls._known[key].folder.is_dir():
            cls._known[key] = cls(parent)
        return cls._known[key]


def _made(parent: str) -> tuple[Path, int]:
    """Return a new folder and the handle of its locked file."""
    while True:
        folder = Path(tempfile.mkdtemp(_SUFFIX, _PREFIX, parent))
        # between two of these steps another process may remove it as abandoned
        with contextlib.suppress(FileNotFoundError):
            mark = folder / SCRATCH_MARK
            handle = os.open(mark, os.O_RDWR | os.O_CREAT | os.O_EXCL)
            os.write(handle, socket.gethostname().encode())
            with contextlib.suppress(OSError):  # no locks there: none removes it either
                fcntl.flock(handle, fcntl.LOCK_EX)
            if os.fstat(handle).st_nlink:
                return folder, handle
            os.close(handle)


def _remove_abandoned(parent: Path) -> None:
    """Remove the folders that dead processes of this user and machine have left.

    What cannot be removed, or whose lock cannot be asked for, stays.
    """
    with contextlib.suppress(OSError):
        for entry in list(os.scandir(parent)):
            if _NAME.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                with contextlib.suppress(OSError):
                    _remove_if_abandoned(Path(entry))


def _remove_if_abandoned(folder: Path) -> None:
    if folder.stat().st_uid != os.geteuid():
        return
    try:
        handle = os.open(folder / SCRATCH_MARK, os.O_RDWR | os.O_NOFOLLOW)
    except FileNotFoundError:
        folder.rmdir()  # its owner was killed before it made the file: it is empty
        return
    try:
        # locks of some network file systems are not seen by other machines
        host = os.read(handle, 1000)
        if host in (b"", socket.gethostname().encode()):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _remove(folder)
    finally:
        os.close(handle)


def _remove_own(folder: Path, handle: int, owner: int) -> None:
    if os.getpid() == owner:  # not a process that was forked from it
        with contextlib.suppress(OSError):
            _remove(folder)
        os.close(handle)


def _remove(folder: Path) -> None:
    """Remove a folder, its mark last: a kill in between leaves it marked."""
    remove_content(folder)
    (folder / SCRATCH_MARK).unlink()
    folder.rmdir()
