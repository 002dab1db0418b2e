"""Atomic writing of files and folders: into a temporary neighbour, then renamed."""

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
    """Yield a temporary path that replaces the file ``path`` when the block succeeds.

    The temporary path is in the same folder; parent folders are created. A block that
    raises, or is killed, leaves ``path`` as it was. The partial file is removed; if the
    process was killed it remains, under a name that starts with a dot. Of a symbolic
    link, the file that it leads to is replaced.

    Raises
    ------
    DatasetError
        If ``path`` is a folder, a device or a pipe, or the block or the file system
        raises an `OSError`.
    """
    try:
        file = _file_meant(path)
        with _temporary_path(file) as temporary:
            yield temporary
            temporary.replace(file)
    except OSError as error:
        reason = error.strerror or error
        raise DatasetError(f"{path}: cannot be written: {reason}") from error


@contextmanager
def atomic_write_folder(path: Path) -> Iterator[Path]:
    """Yield an empty folder that replaces ``path`` when the block succeeds.

    As `atomic_write`, but errors are left as they are. An existing folder is removed
    with its contents: only for folders that no other process writes to.
    """
    with _temporary_path(path) as temporary:
        temporary.mkdir()
        yield temporary
        if path.is_dir():
            shutil.rmtree(path)
        temporary.replace(path)


def _file_meant(path: Path) -> Path:
    """Return the file that a path leads to; there need not be one yet."""
    file = Path(os.path.realpath(path))  # unlike resolve, also where links are a loop
    found = ""
    if file.is_symlink():
        found = "a symbolic link that leads to itself"
    elif file.is_dir():
        found = "a folder"
    elif file.exists() and not file.is_file():
        found = "a device or a pipe"
    if found:
        raise DatasetError(f"{path}: expected the path of a file, got {found}")
    return file


@contextmanager
def _temporary_path(path: Path) -> Iterator[Path]:
    """Yield an unused name beside ``path``; remove what remains there at the end."""
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
