"""A store behind an fsspec URL; see `simbench.datasets.store`."""

from __future__ import annotations

import contextlib
import glob
import json
import secrets
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

import fsspec

from simbench.core.errors import DatasetError
from simbench.core.one_line import one_line

__all__ = ["UrlStore"]

_BUCKETS = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "adl", "oci", "oss", "r2"}
"""Where folders are parts of names, and to make one is to make a bucket."""
_LEASE = "production.lock"
_LEASE_S = 120.0  # that the silence of another process must last, to count as its end
_RENEW_S = 20.0


class UrlStore:
    """What an fsspec URL names: a bucket, a server, this process's memory.

    Parameters
    ----------
    url : str
        Options go where fsspec looks for them: its configuration files, the
        environment, or what the driver reads by itself.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self._token = secrets.token_hex(8)
        self._one_at_a_time = threading.RLock()  # few drivers stand more
        self._fault: DatasetError | None = None
        try:
            self._system, root = fsspec.core.url_to_fs(url)
        except ImportError as error:
            raise DatasetError(f"{url}: needs a driver: {one_line(error)}") from None
        except Exception as error:  # each driver has its own
            raise DatasetError(f"{url}: cannot be opened: {one_line(error)}") from None
        self._root = str(root).rstrip("/")
        protocol = self._system.protocol
        self._protocols = {protocol} if isinstance(protocol, str) else set(protocol)

    def __str__(self) -> str:
        """Return the URL."""
        return self.url

    @property
    def is_private(self) -> bool:
        """Whether no other process sees what this one puts there."""
        return "memory" in self._protocols

    @property
    def address(self) -> str:
        """What opens the same store from any working directory."""
        return self.url

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other productions out while the block runs.

        Object stores have no locks: a small file that is written again and again,
        whatever the production is at, says that it lives.
        """
        self._refuse_another(_LEASE_S)
        self._renew()
        self._fault = None
        is_over = threading.Event()
        renewing = threading.Thread(target=self._live, args=(is_over,), daemon=True)
        renewing.start()
        try:
            yield
        finally:
            is_over.set()
            renewing.join()
            with contextlib.suppress(DatasetError):
                self._refuse_another(float("inf"))  # it is theirs then, to remove too
                self.remove([_LEASE])

    def still_ours(self) -> None:
        """Stop a production that has lost its claim."""
        if self._fault is not None:
            raise self._fault

    def names(self, folder: str) -> list[str]:
        """Return the names of the files and folders in a folder, none if missing."""
        with self._told():
            self._system.invalidate_cache()
            there = self._full(folder)
            try:
                found = self._system.ls(there, detail=False)
            except FileNotFoundError:
                return []
            except NotADirectoryError:
                found = [there]
            is_file = len(found) == 1 and self._system.isfile(there)
        if is_file:
            raise DatasetError(f"{self}: {there} is a file, wanted a folder")
        named = {PurePosixPath(path).name for path in found}
        return sorted(named - {PurePosixPath(there).name, _LEASE})

    def has(self, path: str) -> bool:
        """Whether a file is there."""
        with self._told():
            self._system.invalidate_cache()
            return bool(self._system.exists(self._full(path)))

    def read(self, paths: Iterable[str]) -> list[bytes]:
        """Return the content of files."""
        wanted = [self._full(path) for path in paths]
        if not wanted:
            return []
        with self._told():
            found: list[bytes] = self._system.cat_ranges(
                wanted, None, None, on_error="raise"
            )
        return found

    def take(self, files: Mapping[str, Path]) -> None:
        """Move local files to where they belong, in place of what stands there."""
        here = [str(local) for local in files.values()]
        there = [self._full(path) for path in files]
        with self._told():
            try:
                self._system.put(here, there)
            except FileNotFoundError:
                if self._protocols & _BUCKETS:
                    raise
                for parent in {path.rpartition("/")[0] for path in there}:
                    self._system.makedirs(parent, exist_ok=True)
                self._system.put(here, there)
        for local in files.values():
            local.unlink()

    def remove(self, paths: Iterable[str]) -> None:
        """Remove files and folders with all in them, as far as they are there."""
        there = [self._full(path) for path in paths if self.has(path)]
        if there:
            with self._told():  # which takes names for patterns
                self._system.rm([glob.escape(path) for path in there], recursive=True)

    def _full(self, path: str) -> str:
        return f"{self._root}/{path}" if path else self._root

    def _refuse_another(self, silence_s: float) -> None:
        if not self.has(_LEASE):
            return
        (content,) = self.read([_LEASE])
        try:
            lease = json.loads(content)
            ago = time.time() - float(lease["at"])
        except (KeyError, TypeError, ValueError):
            return
        if lease.get("by") != self._token and ago < silence_s:
            raise DatasetError(
                f"{self}: another run is writing here, it renewed {_LEASE} "
                f"{ago:.0f} s ago; if it is dead, wait until that is {_LEASE_S:.0f} s"
            )

    def _renew(self) -> None:
        with TemporaryDirectory(prefix="simbench-") as folder:
            local = Path(folder) / _LEASE
            local.write_text(json.dumps({"by": self._token, "at": time.time()}))
            self.take({_LEASE: local})

    def _live(self, is_over: threading.Event) -> None:
        """Renew the lease until it is over, or another production has taken it."""
        while not is_over.wait(_RENEW_S):
            try:
                self._refuse_another(float("inf"))
                self._renew()
            except DatasetError as error:
                self._fault = error
                return
            except OSError as error:  # of the local disk
                self._fault = DatasetError(f"{self}: {one_line(error)}")
                return

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        with self._one_at_a_time:
            try:
                yield
            except Exception as error:  # each driver has its own
                raise DatasetError(f"{self}: {one_line(error)}") from None
