"""Places that a data set can go to: a local folder, or whatever an fsspec URL names.

Files are made on the local disk and then taken to the store, the one that says that the
others are there last: object stores know no renaming, and need none this way.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Protocol

from simbench.core.errors import DatasetError
from simbench.datasets.remote_store import UrlStore
from simbench.runtime.locks import locked

__all__ = ["FolderStore", "Store", "open_store"]

_LOCK = ".lock"
_ARRIVING = ".arriving"


class Store(Protocol):
    """Where files go, by path relative to it, ``/`` between the parts.

    What was taken or removed is so for good, whenever the machine dies. Every method
    raises `DatasetError`, with one line that names the place.
    """

    @property
    def is_private(self) -> bool:
        """Whether no other process sees what this one puts there."""

    @property
    def address(self) -> str:
        """What opens the same store from any working directory."""

    def locked(self) -> contextlib.AbstractContextManager[None]:
        """Keep other productions out while the block runs."""

    def still_ours(self) -> None:
        """Stop a production that has lost its claim."""

    def names(self, folder: str) -> list[str]:
        """Return the names of the files and folders in a folder, none if missing."""

    def has(self, path: str) -> bool:
        """Whether a file is there."""

    def read(self, paths: Iterable[str]) -> list[bytes]:
        """Return the content of files."""

    def take(self, files: Mapping[str, Path]) -> None:
        """Move local files to where they belong, in place of what stands there."""

    def remove(self, paths: Iterable[str]) -> None:
        """Remove files, and folders with all in them, as far as they are there."""


def open_store(place: str) -> Store:
    """Return the store that a path or URL names.

    Raises
    ------
    DatasetError
        If there is no driver for the URL, or it cannot be reached with what it says.
    """
    if "://" not in place and "::" not in place:
        return FolderStore(Path(place))
    if not all(link.partition("://")[0] for link in place.split("::")):
        raise DatasetError(f"{place}: wanted a folder, or a URL like s3://bucket/set")
    if place.startswith(("file://", "local://")):
        return FolderStore(Path(place.partition("://")[2]))
    return UrlStore(place)


class FolderStore:
    """A folder of this machine, or one that it shares with others.

    Parameters
    ----------
    path : Path
        Made when it is locked.
    """

    is_private = False

    def __init__(self, path: Path) -> None:
        self.path = path

    def __str__(self) -> str:
        """Return the path."""
        return str(self.path)

    @property
    def address(self) -> str:
        """What opens the same store from any working directory."""
        return str(self.path.absolute())

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other productions out while the block runs."""
        with self._told():
            self.path.mkdir(parents=True, exist_ok=True)
        with locked(self.path / _LOCK):
            shutil.rmtree(self.path / _ARRIVING, ignore_errors=True)
            yield

    def still_ours(self) -> None:
        """Do nothing: the system knows that the lock is held."""

    def names(self, folder: str) -> list[str]:
        """Return the names of the files and folders in a folder, none if missing."""
        with self._told():
            try:
                found = [path.name for path in (self.path / folder).iterdir()]
            except FileNotFoundError:
                return []
        return [name for name in found if not name.startswith(".")]

    def has(self, path: str) -> bool:
        """Whether a file is there."""
        return (self.path / path).is_file()

    def read(self, paths: Iterable[str]) -> list[bytes]:
        """Return the content of files."""
        with self._told():
            return [(self.path / path).read_bytes() for path in paths]

    def take(self, files: Mapping[str, Path]) -> None:
        """Move local files to where they belong, in place of what stands there."""
        with self._told():
            for path, local in files.items():
                there = self.path / path
                there.parent.mkdir(parents=True, exist_ok=True)
                _flush(local)
                try:
                    local.replace(there)
                except OSError as error:
                    if error.errno != errno.EXDEV:
                        raise
                    self._copy(local, there)
            self._flush_folders(files)

    def remove(self, paths: Iterable[str]) -> None:
        """Remove files and folders, and those that this empties."""
        removed = list(paths)
        with self._told():
            for path in removed:
                there = self.path / path
                if there.is_dir():
                    shutil.rmtree(there)
                else:
                    there.unlink(missing_ok=True)
                for parent in PurePosixPath(path).parents[:-1]:
                    with contextlib.suppress(OSError):  # not empty, or gone
                        (self.path / parent).rmdir()
            self._flush_folders(removed)

    def _copy(self, local: Path, there: Path) -> None:
        """Copy a file from another disk beside its place, and then put it there."""
        beside = self.path / _ARRIVING / secrets.token_hex(8)
        beside.parent.mkdir(exist_ok=True)
        shutil.copyfile(local, beside)
        _flush(beside)
        beside.replace(there)
        local.unlink()

    def _flush_folders(self, paths: Iterable[str]) -> None:
        """Bring to the disk what the folders above files say is in them."""
        for folder in {up for path in paths for up in PurePosixPath(path).parents}:
            with contextlib.suppress(FileNotFoundError):  # empty_folder, and gone
                _flush(self.path / folder)

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            where = error.filename or self.path
            raise DatasetError(f"{where}: {error.strerror or error}") from None


def _flush(path: Path) -> None:
    """Bring a file, or what a folder says is in it, to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a folder of a file system that cannot
            raise
    finally:
        os.close(handle)
