"""A lock for stores without locks: a small file that its holder keeps changing.

The file names its holder by a random token and counts renewals. What keeps two
productions apart, strongest first:

Create-only writes
    Where the driver has them, the store itself lets only one of two starters create the
    file. They are looked for in the driver and then tried: a store that lets the holder
    create its own file a second time does not have them.
Settling
    Elsewhere, the last of two starters that write at once wins. Each reads the file
    again some seconds later; one that finds a foreign token gives up.
Fencing
    On every store the token is read again before each publication of an index or a
    manifest, and at each renewal. A holder whose lease another process took over
    because it was silent for too long publishes nothing more.

Clocks of two machines are never compared. Who finds a lease watches it by its own
clock: one that changes has a living holder, one that stays the same for `Pace.expiry_s`
is taken over. A damaged or unreadable lease counts as held until then, too.

Workers of a production that lost its lease may still deliver sequences, until it
notices that: the bytes of a sequence depend only on its name, so both deliver the same.

==============================  ===========  ==========================================
store                           create-only  by
==============================  ===========  ==========================================
folders, ``file://``            not needed   ``flock``, see `simbench.runtime.locks`
``dir://`` above ``file://``    yes          ``O_EXCL``, on NFS from version 3 on
``memory://``                   yes          no other process sees it
Amazon S3                       yes          ``If-None-Match``; s3fs from 2024.12 on
other servers that speak S3     tried        as S3, if the server knows that header
Google Cloud Storage            yes          ``ifGenerationMatch``; gcsfs from
                                             2024.12 on
Azure Blob and Data Lake        yes          ``overwrite=False`` of adlfs
SFTP, FTP, SMB, WebDAV, HDFS    no           settling and fencing
==============================  ===========  ==========================================
"""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from simbench.core.errors import DatasetError
from simbench.datasets.lease_file import LeaseFile

__all__ = ["LEASE", "Lease", "Pace"]

LEASE = "production.lock"
"""Path of the file in the store."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How often a lease is renewed and looked at, and the clock that says so.

    Attributes
    ----------
    renew_s : float, s
        Between two renewals.
    expiry_s : float, s
        Without a change, after which the holder counts as dead.
    look_s : float, s
        Between two looks of a process that waits for that.
    settle_s : float, s
        Until a starter reads its own lease again, where writes are not create-only.
    now : callable
        Returns the seconds of a clock of this machine that never goes back.
    sleep : callable of s
    """

    renew_s: float = 10.0
    expiry_s: float = 120.0
    look_s: float = 2.0
    settle_s: float = 5.0
    now: Callable[[], float] = time.monotonic
    sleep: Callable[[float], None] = time.sleep


class Lease:
    """The right to write to a store, renewed by a thread while it is held.

    Parameters
    ----------
    file : LeaseFile
    pace : Pace, optional
    """

    def __init__(self, file: LeaseFile, pace: Pace | None = None) -> None:
        self.file = file
        self._pace = pace or Pace()
        self._token = ""  # while it is not held
        self._renewals = 0
        self._fault: DatasetError | None = None

    @contextlib.contextmanager
    def held(self, tell: Callable[[str], None] | None = None) -> Iterator[None]:
        """Hold the lease while the block runs.

        Parameters
        ----------
        tell : callable, optional
            Receives one line if there is a lease already, which is then watched:
            for about `Pace.renew_s` if its holder lives, else for `Pace.expiry_s`.

        Raises
        ------
        DatasetError
            If another process holds it, or the store cannot be read or written.
        """
        self._acquire(tell)
        is_over = threading.Event()
        renewing = threading.Thread(
            target=self._keep_renewing, args=(is_over,), daemon=True
        )
        renewing.start()
        try:
            yield
        finally:
            is_over.set()
            renewing.join()
            self._release()

    def check(self) -> None:
        """Raise the error that ended the renewals, if they have ended; read nothing.

        Raises
        ------
        DatasetError
            If another process has taken the lease, or it could not be renewed.
        """
        if self._fault is not None:
            raise self._fault

    def require(self) -> None:
        """Read the lease again, and raise an error if it was ours and is no longer.

        Raises
        ------
        DatasetError
            As `check`, or if the lease cannot be read.
        """
        self.check()
        if self._token:
            self._require_own(self.file.read())

    def _acquire(self, tell: Callable[[str], None] | None) -> None:
        self._fault = None
        self._renewals = 0
        found = self.file.read()
        if found is not None:
            self._outwait(found, tell)
        self._token = secrets.token_hex(8)
        try:
            if not self.file.create(self._content()):
                self._pace.sleep(self._pace.settle_s)
            self._require_own(self.file.read())
        except FileExistsError:
            self._token = ""
            raise self._lost_to(self.file.read()) from None
        except BaseException:
            self._token = ""
            raise

    def _outwait(self, found: bytes, tell: Callable[[str], None] | None) -> None:
        """Watch a lease, and remove it once it counts as dead; refuse a living one."""
        pace = self._pace
        if tell is not None:
            tell(f"watching {LEASE} of {_holder(found)} for {pace.expiry_s:.0f} s")
        began = pace.now()
        seen: bytes | None = found
        while seen is not None:
            if seen != found:
                raise self._lost_to(seen)
            if pace.now() - began >= pace.expiry_s:
                self.file.remove()
                return
            pace.sleep(pace.look_s)
            seen = self.file.read()

    def _release(self) -> None:
        with contextlib.suppress(DatasetError):
            self._require_own(self.file.read())  # another's is not ours to remove
            self.file.remove()
        self._token = ""

    def _keep_renewing(self, is_over: threading.Event) -> None:
        """Renew the lease until it is over, or another process has taken it."""
        while self._fault is None and not is_over.wait(self._pace.renew_s):
            try:
                self._renew()
            except DatasetError as error:
                self._fault = error

    def _renew(self) -> None:
        self._require_own(self.file.read())
        self._renewals += 1
        self.file.write(self._content())

    def _content(self) -> bytes:
        """Return what the file says; host and process are for humans."""
        content = {
            "token": self._token,
            "renewals": self._renewals,
            "host": socket.gethostname(),
            "process": os.getpid(),
        }
        return json.dumps(content).encode()

    def _require_own(self, found: bytes | None) -> None:
        if found is None or _parsed(found).get("token") != self._token:
            raise self._lost_to(found)

    def _lost_to(self, found: bytes | None) -> DatasetError:
        what = f"{LEASE} is gone" if found is None else _holder(found)
        return DatasetError(f"{self.file.place}: another run is writing here ({what})")


def _holder(found: bytes) -> str:
    """Return who holds a lease, in words."""
    lease = _parsed(found)
    host, process = lease.get("host"), lease.get("process")
    if not isinstance(host, str) or not isinstance(process, int):
        return "an unknown process"
    return f"process {process} on {host[:64]!a}"


def _parsed(found: bytes) -> dict[str, Any]:
    """Return the content of a lease, empty if it is damaged."""
    try:
        lease = json.loads(found)
    except (ValueError, RecursionError):
        return {}
    return lease if isinstance(lease, dict) else {}
