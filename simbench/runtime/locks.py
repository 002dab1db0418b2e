"""Lock files and scratch folders."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simbench.core.errors import DatasetError

__all__ = ["empty_folder", "is_lock_file", "locked"]

_LOCK_MARK = b"simbench lock\n"


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a lock file while the block runs; it is released if the process dies.

    Raises
    ------
    DatasetError
        If another process holds it.
    """
    with path.open("a+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise DatasetError(f"{path.parent}: another run is writing here") from None
        file.truncate(0)
        file.write(_LOCK_MARK)
        file.flush()
        yield


def is_lock_file(path: Path) -> bool:
    """Whether a file is a lock file of simbench, held or not."""
    try:
        return path.read_bytes()[: len(_LOCK_MARK)] == _LOCK_MARK
    except OSError:
        return False


@contextmanager
def empty_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder for temporary files, removed when the block ends.

    Files that killed processes left in it are removed too: now or, if this process is
    killed as well, the next time.
    """
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True, exist_ok=True)
    try:
        yield path.absolute()
    finally:
        shutil.rmtree(path, ignore_errors=True)
