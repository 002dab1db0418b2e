"""Lock files, and folders for temporary files at a fixed place.

A lock is one of the system (``flock``): it ends with the process that holds it, however
that ends. On network file systems: NFS passes it to the server, so that it keeps two
machines apart; SMB and many FUSE file systems keep it on each machine, so that only
processes of the same machine are kept apart; where there are no locks at all, work is
refused.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import socket
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simbench.core.errors import DatasetError
from simbench.runtime.scratch import SCRATCH_MARK, remove_content

__all__ = ["empty_folder", "is_lock_file", "locked"]

_LOCK_MARK = b"simbench lock\n"
_NOT_FOLLOWED = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC  # no link, no waiting pipe


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a lock file while the block runs; it is released if the process dies.

    The file stays; it says that it is a lock file of simbench and, while it is held, by
    which process.

    Parameters
    ----------
    path : Path
        New, a lock file of simbench, or an empty file, as those of version 0.2 are; an
        empty one stays empty.

    Raises
    ------
    DatasetError
        If another process holds it, it is no lock file of simbench (which is left as it
        is), the file cannot be written, or its file system has no locks.
    """
    handle, is_new = _opened(path)
    try:
        _lock(handle, path)
        mark = _mark(handle)
        if mark not in (b"", _LOCK_MARK):
            raise DatasetError(
                f"{path}: expected a lock file of simbench, found another file"
            )
        if not mark and not is_new:  # of version 0.2, or of the user
            yield
            return
        try:
            os.ftruncate(handle, 0)
            holder = f"process {os.getpid()} on {socket.gethostname()}\n"
            os.pwrite(handle, _LOCK_MARK + holder.encode(), 0)
        except OSError as error:
            raise DatasetError(f"{path}: cannot be written: {error.strerror}") from None
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                os.ftruncate(handle, len(_LOCK_MARK))
    finally:
        os.close(handle)


def is_lock_file(path: Path) -> bool:
    """Whether a file is a lock file of simbench, held or not; empty ones are not."""
    try:
        handle = os.open(path, os.O_RDONLY | _NOT_FOLLOWED)
    except (OSError, ValueError):
        return False
    try:
        return _mark(handle) == _LOCK_MARK
    finally:
        os.close(handle)


@contextmanager
def empty_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder for temporary files, removed when the block ends.

    Files that killed processes left in it are removed too: now or, if this process is
    killed as well, the next time. To call for a place that a lock protects.

    Parameters
    ----------
    path : Path
        New, empty, or made by this function: a file in it says so.

    Raises
    ------
    DatasetError
        If it is another folder, which is left as it is, or cannot be made.
    """
    mark = path / SCRATCH_MARK
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            path.mkdir()
        if path.is_symlink() or not path.is_dir():
            raise DatasetError(f"{path}: expected a folder, found another file")
        if not mark.is_file() and any(path.iterdir()):
            raise DatasetError(
                f"{path}: expected no folder, or one of temporary files of simbench, "
                "found other files"
            )
        mark.touch()
        remove_content(path)
    except OSError as error:
        raise DatasetError(
            f"{path}: cannot hold temporary files: {error.strerror}"
        ) from None
    try:
        yield path.absolute()
    finally:
        with contextlib.suppress(OSError):
            remove_content(path)
            mark.unlink()  # last: what is left by a kill in between is still marked
            path.rmdir()


def _opened(path: Path) -> tuple[int, bool]:
    """Return the handle of a lock file, and whether it was made now."""
    how = os.O_RDWR | os.O_CREAT | _NOT_FOLLOWED
    try:
        with contextlib.suppress(FileExistsError):
            return os.open(path, how | os.O_EXCL, 0o666), True
        return os.open(path, how, 0o666), False
    except (OSError, ValueError) as error:
        raise DatasetError(_no_lock_file(path, error)) from None


def _lock(handle: int, path: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise DatasetError(f"{path.parent}: another run is writing here") from None
    except OSError as error:
        raise DatasetError(
            f"{path}: cannot be locked: {error.strerror}: expected a file system that "
            "has locks (flock), as those of local disks"
        ) from None


def _mark(handle: int) -> bytes:
    """Return the beginning of a file; of a pipe or a device, other bytes than ours."""
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        return b"no file"
    return os.pread(handle, len(_LOCK_MARK), 0)


def _no_lock_file(path: Path, error: OSError | ValueError) -> str:
    """Return one line that says why a lock file could not be opened."""
    if not isinstance(error, OSError):
        return f"{path.parent!s:.100}: expected a path, got {error}"
    if error.errno == errno.ELOOP and path.is_symlink():
        return f"{path}: expected a lock file of simbench, found a symbolic link"
    return f"{path}: cannot be written: {error.strerror}"
