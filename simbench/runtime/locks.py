"""Having a place for oneself: a lock on it, and a folder for temporary files in it."""

from __future__ import annotations

import fcntl
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simbench.core.errors import DatasetError

__all__ = ["empty_folder", "locked"]


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a lock file while the block runs; the system lets go of it with the process.

    Raises
    ------
    DatasetError
        If another process holds it.
    """
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise DatasetError(f"{path.parent}: another run is writing here") from None
        yield


@contextmanager
def empty_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder for temporary files; it goes when the block ends.

    What processes that were killed could not remove lies here, and goes with it: now,
    or where this process is killed too, the next time.
    """
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True, exist_ok=True)
    try:
        yield path.absolute()
    finally:
        shutil.rmtree(path, ignore_errors=True)
