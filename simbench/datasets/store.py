"""Stores that hold a data set: a local folder, or whatever an fsspec URL names.

Files are made on the local disk and then moved to the store, the one that lists the
others last: object stores cannot rename, and this way need not.
"""

from __future__ import annotations

import contextlib
import errno
import glob
import os
import shutil
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath

import fsspec
from fsspec.implementations.memory import MemoryFileSystem

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError, one_line
from simbench.datasets.lease import LEASE, Lease
from simbench.datasets.lease_file import LeaseFile, has_buckets, without_wrappers
from simbench.runtime.locks import locked

__all__ = ["FolderStore", "Store", "open_store"]

_LOCK = ".lock"


def open_store(place: str) -> Store:
    """Return the store that a path or URL names.

    Parameters
    ----------
    place : str
        Options of a URL go where fsspec looks for them: its configuration files, the
        environment, or what the driver reads by itself.

    Raises
    ------
    DatasetError
        If there is no driver for the URL, or the driver cannot open it; or if a name
        is not UTF-8, or has a NUL, which not all files of a data set can have.
    """
    try:
        is_text = "\0" not in place and bool(place.encode())
    except UnicodeEncodeError:
        is_text = False
    if not is_text:
        raise DatasetError(f"{place!a}: expected a folder or URL named in UTF-8")
    if "://" not in place and "::" not in place:
        return FolderStore(Path(place))
    if not all(link.partition("://")[0] for link in place.split("::")):
        raise DatasetError(
            f"{place}: expected a folder, or a URL like s3://bucket/dataset"
        )
    if place.startswith(("file://", "local://")):
        return FolderStore(Path(place.partition("://")[2]))
    try:
        system, root = fsspec.core.url_to_fs(place)
    except ImportError as error:
        raise DatasetError(f"{place}: needs a driver: {one_line(error)}") from None
    except Exception as error:  # each driver has its own
        raise DatasetError(f"{place}: cannot be opened: {one_line(error)}") from None
    return Store(place, system, str(root))


class Store:
    """Files of a bucket, a server or this process's memory, by path below a root.

    The parts of a path are separated by ``/``. Changes are permanent once a method
    returns, even if the machine fails. Every method raises `DatasetError`, with one
    line that names the place.

    Parameters
    ----------
    address : str
        Opens the same store from any working directory.
    system : fsspec.AbstractFileSystem
    root : str
        Path of the root in that file system.
    """

    def __init__(
        self, address: str, system: fsspec.AbstractFileSystem, root: str
    ) -> None:
        self.address = address
        self._system = system
        # an archive's root is empty, a server's may be "/": neither is part of a name
        self._root = root.rstrip("/") or root[:1]
        self._one_at_a_time = threading.RLock()  # few drivers are thread-safe
        file = LeaseFile(system, self._full(LEASE), address, self._one_at_a_time)
        self.lease = Lease(file)

    def __str__(self) -> str:
        """Return the path or URL."""
        return self.address

    @property
    def is_private(self) -> bool:
        """Whether no other process sees what this one puts there."""
        return isinstance(without_wrappers(self._system, "")[0], MemoryFileSystem)

    def locked(
        self, tell: Callable[[str], None] | None = None
    ) -> contextlib.AbstractContextManager[None]:
        """Refuse other productions while the block runs.

        Parameters
        ----------
        tell : callable, optional
            Receives one line if that takes a while, see `simbench.datasets.lease`.
        """
        return self.lease.held(tell)

    def check_lock(self) -> None:
        """Raise an error if another production is known to have taken the lock."""
        self.lease.check()

    def require_lock(self) -> None:
        """Look whether another production has taken the lock, and raise an error then.

        Does nothing where it is not held, as in a worker.
        """
        self.lease.require()

    def names(self, folder: str) -> list[str]:
        """Return the names of the files and folders in a folder, none if missing.

        Names that begin with a dot are left out, as is the lock.
        """
        path = self._full(folder)
        with self._errors_in_one_line():
            self._system.invalidate_cache()
            try:
                found = self._system.ls(path, detail=False)
            except FileNotFoundError:
                return []
            except NotADirectoryError:
                found = [path]
            is_file = len(found) == 1 and self._system.isfile(path)
        if is_file:
            what = f"{folder} is" if folder else "is"
            raise DatasetError(f"{self}: {what} a file, expected a folder")
        names = {PurePosixPath(one).name for one in found}
        names -= {PurePosixPath(path).name, LEASE}
        return sorted(name for name in names if not name.startswith("."))

    def has(self, path: str) -> bool:
        """Whether a file exists."""
        with self._errors_in_one_line():
            self._system.invalidate_cache()
            return bool(self._system.exists(self._full(path)))

    def size(self, path: str) -> int:
        """Return the size of a file in bytes, 0 where the store does not know it."""
        with self._errors_in_one_line():
            return int(self._system.info(self._full(path)).get("size") or 0)

    def read(self, paths: Iterable[str]) -> list[bytes]:
        """Return the content of files."""
        full = [self._full(path) for path in paths]
        if not full:
            return []
        with self._errors_in_one_line():
            found: list[bytes] = self._system.cat_ranges(
                full, None, None, on_error="raise"
            )
        return found

    def put(self, files: Mapping[str, Path]) -> None:
        """Move local files to their paths in the store; existing ones are replaced."""
        local = [str(file) for file in files.values()]
        full = [self._full(path) for path in files]
        with self._errors_in_one_line():
            try:
                self._system.put(local, full)
            except FileNotFoundError:
                if has_buckets(self._system):
                    raise
                for parent in {path.rpartition("/")[0] for path in full}:
                    self._system.makedirs(parent, exist_ok=True)
                self._system.put(local, full)
        for file in files.values():
            file.unlink()

    def remove(self, paths: Iterable[str]) -> None:
        """Remove files, and folders with all their content, as far as they exist."""
        full = [self._full(path) for path in paths if self.has(path)]
        if full:
            with self._errors_in_one_line():  # rm takes names for patterns
                self._system.rm([glob.escape(path) for path in full], recursive=True)

    def _full(self, path: str) -> str:
        gap = "/" if self._root.strip("/") else ""
        return f"{self._root}{gap}{path}" if path else self._root

    @contextlib.contextmanager
    def _errors_in_one_line(self) -> Iterator[None]:
        with self._one_at_a_time:
            try:
                yield
            except Exception as error:  # each driver has its own
                raise DatasetError(f"{self}: {one_line(error)}") from None


class FolderStore(Store):
    """A folder of this machine, or one that it shares with others.

    Files are flushed to the disk and then renamed, so each is complete or missing.

    Parameters
    ----------
    path : Path
        Made when it is locked.
    """

    def __init__(self, path: Path) -> None:
        address = str(path.absolute())
        super().__init__(address, fsspec.filesystem("file"), address)
        self.path = path

    def __str__(self) -> str:
        """Return the path."""
        return str(self.path)

    @contextlib.contextmanager
    def locked(self, tell: Callable[[str], None] | None = None) -> Iterator[None]:
        """Refuse other productions while the block runs, at once."""
        with self._errors_in_one_line():
            try:
                self.path.mkdir(parents=True, exist_ok=True)
            except FileExistsError:  # also of a link that leads nowhere
                raise DatasetError(
                    f"{self.path}: expected a folder, found another file"
                ) from None
        with locked(self.path / _LOCK):
            yield

    def check_lock(self) -> None:
        """Do nothing: the system keeps the lock while the process lives."""

    def require_lock(self) -> None:
        """Do nothing, too."""

    def has(self, path: str) -> bool:
        """Whether a file exists."""
        return (self.path / path).is_file()

    def put(self, files: Mapping[str, Path]) -> None:
        """Move local files to their paths in the store; existing ones are replaced."""
        with self._errors_in_one_line():
            for path, local in files.items():
                full = self.path / path
                full.parent.mkdir(parents=True, exist_ok=True)
                _flush(local)
                try:
                    local.replace(full)
                except OSError as error:
                    if error.errno != errno.EXDEV:
                        raise
                    with atomic_write(full) as copy:
                        shutil.copyfile(local, copy)
                        _flush(copy)
                    local.unlink()
            self._flush_folders(files)

    def remove(self, paths: Iterable[str]) -> None:
        """Remove files and folders, and the folders that become empty."""
        removed = list(paths)
        with self._errors_in_one_line():
            for path in removed:
                full = self.path / path
                if full.is_dir():
                    shutil.rmtree(full)
                else:
                    full.unlink(missing_ok=True)
                for parent in PurePosixPath(path).parents[:-1]:
                    with contextlib.suppress(OSError):  # not empty, or removed
                        (self.path / parent).rmdir()
            self._flush_folders(removed)

    def _flush_folders(self, paths: Iterable[str]) -> None:
        """Flush the entries of all folders above some files to the disk."""
        for folder in {up for path in paths for up in PurePosixPath(path).parents}:
            with contextlib.suppress(FileNotFoundError):  # it was empty, and removed
                _flush(self.path / folder)

    @contextlib.contextmanager
    def _errors_in_one_line(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            where = error.filename or self.path
            raise DatasetError(f"{where}: {error.strerror or error}") from None


def _flush(path: Path) -> None:
    """Flush a file, or the entries of a folder, to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a folder of a file system that cannot
            raise
    finally:
        os.close(handle)
