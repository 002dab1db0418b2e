"""Reading of a data set's files: bounded, and never from outside of it."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import BinaryIO, Final

from simbench.core.bounded_read import (
    open_below,
    path_below,
    read_below,
    require_below,
)
from simbench.core.errors import DatasetError
from simbench.datasets.store import FolderStore, Store

__all__ = [
    "LARGEST_FILE",
    "is_inside",
    "open_file",
    "read_files",
    "require_readable",
]

LARGEST_FILE: Final = 256 * 2**20
"""Most bytes of a picture, a table or a JSON file of one sequence."""


def read_files(
    store: Store, paths: Iterable[str], most_bytes: int = LARGEST_FILE
) -> list[bytes]:
    """Return the content of files of a store.

    Parameters
    ----------
    store : Store
    paths : iterable of str
        As the data set names them.
    most_bytes : int
        Largest accepted size of each.

    Raises
    ------
    DatasetError
        If one cannot be read, is too large, or is outside of the store: by ``..``, an
        absolute path or, in a folder, a symbolic link.
    """
    found = list(paths)
    for path in found:
        require_below(path, store)
    if isinstance(store, FolderStore):
        return [read_below(store.path, path, most_bytes) for path in found]
    for path in found:
        size = store.size(path)
        if size > most_bytes:
            raise DatasetError(
                f"{store}: {path}: expected at most {most_bytes} bytes, got {size}"
            )
    return store.read(found)


def open_file(store: Store, path: str) -> BinaryIO:
    """Open a file of any size, to read it in parts; in a bucket it is read whole.

    Raises
    ------
    DatasetError
        As `read_files`.
    """
    if isinstance(store, FolderStore):
        return open_below(store.path, path, 2**63)
    return io.BytesIO(read_files(store, [path], 2**30)[0])


def require_readable(store: Store, paths: Iterable[str]) -> None:
    """Refuse files of a folder that cannot be read, without reading them.

    Raises
    ------
    DatasetError
        As `read_files`; nothing is known about files that are not in a folder.
    """
    if isinstance(store, FolderStore):
        for path in paths:
            open_below(store.path, path, LARGEST_FILE).close()


def is_inside(store: Store, folder: str) -> bool:
    """Whether a folder of a data set, empty for the root, is not a link out of it."""
    if not folder or not isinstance(store, FolderStore):
        return True
    try:
        path_below(store.path, folder)
    except DatasetError:
        return False
    return True
