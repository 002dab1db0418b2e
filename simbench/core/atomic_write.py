"""Write files and folders whole or not at all: into a neighbour, then rename."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simbench.core.errors import DatasetError

__all__ = ["atomic_write", "atomic_write_folder"]


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path that becomes the file ``path`` when the block ends well.

    Parameters
    ----------
    path : Path
        File to write, or to replace; parent folders are made.

    Yields
    ------
    Path
        A free name in the same folder. Write a file there.

    Raises
    ------
    DatasetError
        If ``path`` is a folder: what lies in it is not the caller's to remove.

    Notes
    -----
    A block that raises, or is killed, leaves ``path`` as it was. What was written
    until then is removed, or stays under a name that starts with a dot where the
    process was killed.
    """
    if path.is_dir():
        raise DatasetError(f"{path}: is a folder, wanted the path of a file")
    with _neighbour(path) as temporary:
        yield temporary
        temporary.replace(path)


@contextmanager
def atomic_write_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder that becomes ``path`` when the block ends well.

    As `atomic_write`. A folder that is there already is removed, with all that lies
    in it: only for folders that nobody else writes to.
    """
    with _neighbour(path) as temporary:
        temporary.mkdir()
        yield temporary
        if path.is_dir():
            shutil.rmtree(path)
        temporary.replace(path)


@contextmanager
def _neighbour(path: Path) -> Iterator[Path]:
    """Yield a free name beside ``path``; what is left there goes in the end."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    _remove(temporary)
    try:
        yield temporary
    finally:
        _remove(temporary)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
