"""The file of a lease, in whatever store an fsspec driver reaches."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable, Iterator
from typing import Any

from fsspec import AbstractFileSystem
from fsspec.asyn import AsyncFileSystem
from fsspec.implementations.cached import CachingFileSystem
from fsspec.implementations.dirfs import DirFileSystem
from fsspec.implementations.local import LocalFileSystem

from simbench.core.errors import DatasetError, one_line

__all__ = ["LeaseFile", "has_buckets", "without_wrappers"]

_BUCKETS = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "adl", "oci", "oss", "r2"}

_Create = Callable[[str, bytes], None]


def has_buckets(system: AbstractFileSystem) -> bool:
    """Whether folders are parts of names only, and to make one is to make a bucket."""
    protocol = system.protocol
    names = {protocol} if isinstance(protocol, str) else set(protocol)
    return bool(names & _BUCKETS)


class LeaseFile:
    """One small file; each method raises `DatasetError` if the store refuses.

    Parameters
    ----------
    system : fsspec.AbstractFileSystem
    path : str
        In that file system.
    place : str
        Of the store, for messages.
    one_at_a_time : lock
        Held while the file system is used.
    """

    def __init__(
        self,
        system: AbstractFileSystem,
        path: str,
        place: str,
        one_at_a_time: contextlib.AbstractContextManager[Any],
    ) -> None:
        self.place = place
        self._system, self._path = without_wrappers(system, path)
        self._one_at_a_time = one_at_a_time
        self._create_only = _create_only(self._system)

    def read(self) -> bytes | None:
        """Return the content; None if there is no file.

        A file that is there but cannot be read has the error for content.
        """
        with self._errors_in_one_line():
            self._system.invalidate_cache()
            try:
                return bytes(self._system.cat_file(self._path))
            except FileNotFoundError:
                return None
            except Exception as error:  # each driver has its own
                unreadable = one_line(error).encode()
            return unreadable if self._system.exists(self._path) else None

    def create(self, content: bytes) -> bool:
        """Create the file, and return whether the store let no one else create it.

        Returns
        -------
        bool
            False if the driver has no create-only writes, or the store ignores what
            makes them create-only: then another file may have been replaced, or this
            one be replaced by that of another process that found none.

        Raises
        ------
        FileExistsError
            If there is one already. Which error a driver raises then is not to be
            relied on, so this one is raised when there is a file after any error.
        """
        if self._create_only is None:
            self.write(content)
            return False
        try:
            self._writing(self._create_only, content)
        except DatasetError:
            if self.read() is not None:
                raise FileExistsError from None
            self.write(content)  # the server may know no create-only writes
            return False
        try:
            self._writing(self._create_only, content)
        except DatasetError:
            return True
        return False  # a second one was made: the store ignores the condition

    def write(self, content: bytes) -> None:
        """Write the file; an existing one is replaced."""
        self._writing(self._system.pipe_file, content)

    def remove(self) -> None:
        """Remove the file if it exists."""
        with self._errors_in_one_line(), contextlib.suppress(FileNotFoundError):
            self._system.rm_file(self._path)

    def _writing(self, write: _Create, content: bytes) -> None:
        with self._errors_in_one_line():
            try:
                write(self._path, content)
            except FileNotFoundError:
                if has_buckets(self._system):
                    raise
                parent = self._path.rpartition("/")[0]
                self._system.makedirs(parent, exist_ok=True)
                write(self._path, content)

    @contextlib.contextmanager
    def _errors_in_one_line(self) -> Iterator[None]:
        with self._one_at_a_time:
            try:
                yield
            except Exception as error:  # each driver has its own
                raise DatasetError(f"{self.place}: {one_line(error)}") from None


def without_wrappers(
    system: AbstractFileSystem, path: str
) -> tuple[AbstractFileSystem, str]:
    """Return the innermost driver: a cache in front of it would show old content."""
    while isinstance(system, (CachingFileSystem, DirFileSystem)):
        if isinstance(system, DirFileSystem):
            path = system._join(path)
        system = system.fs
    return system, path


def _create_only(system: AbstractFileSystem) -> _Create | None:
    """Return the create-only write of a driver; None if it has none.

    fsspec's own ``pipe_file`` accepts ``mode="create"`` too, but looks first and then
    writes; only a driver's own method may leave the decision to the store.
    """
    if isinstance(system, LocalFileSystem):
        return lambda path, content: _create_local(system, path, content)
    name = "_pipe_file" if isinstance(system, AsyncFileSystem) else "pipe_file"
    method = getattr(type(system), name)
    if method in (AbstractFileSystem.pipe_file, AsyncFileSystem._pipe_file):
        return None
    parameters = inspect.signature(method).parameters
    if "overwrite" in parameters:  # adlfs
        return lambda path, content: system.pipe_file(path, content, overwrite=False)
    if "mode" in parameters:  # s3fs and gcsfs since December 2024, memory
        return lambda path, content: system.pipe_file(path, content, mode="create")
    return None


def _create_local(system: LocalFileSystem, path: str, content: bytes) -> None:
    with system.open(path, "xb") as file:
        file.write(content)
