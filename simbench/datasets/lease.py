"""A lock for stores without locks: a small file that its holder keeps renewing."""

from __future__ import annotations

import contextlib
import json
import secrets
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from simbench.core.errors import DatasetError, one_line

if TYPE_CHECKING:
    from simbench.datasets.store import Store

__all__ = ["LEASE", "Lease"]

LEASE = "production.lock"
"""Path of the file in the store."""
_EXPIRY_S = 120.0  # after the last renewal, when the holder counts as dead
_RENEW_S = 20.0


class Lease:
    """The right to write to a store, renewed by a thread while it is held.

    Parameters
    ----------
    store : Store
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._token = secrets.token_hex(8)
        self._fault: DatasetError | None = None

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold the lease while the block runs.

        Raises
        ------
        DatasetError
            If another process holds it.
        """
        self._refuse_another(_EXPIRY_S)
        self._renew()
        self._fault = None
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
            with contextlib.suppress(DatasetError):
                self._refuse_another(float("inf"))  # then the other one removes it
                self._store.remove([LEASE])

    def check(self) -> None:
        """Raise the error that ended the renewals, if they have ended.

        Raises
        ------
        DatasetError
            If another process has taken the lease, or it could not be renewed.
        """
        if self._fault is not None:
            raise self._fault

    def _refuse_another(self, expiry_s: float) -> None:
        if not self._store.has(LEASE):
            return
        (content,) = self._store.read([LEASE])
        try:
            lease = json.loads(content)
            age_s = time.time() - float(lease["at"])
        except (KeyError, TypeError, ValueError):
            return
        if lease.get("by") != self._token and age_s < expiry_s:
            raise DatasetError(
                f"{self._store}: another run is writing here, it renewed {LEASE} "
                f"{age_s:.0f} s ago; if it is dead, wait until that is {_EXPIRY_S:.0f} "
                "s"
            )

    def _renew(self) -> None:
        with TemporaryDirectory(prefix="simbench-") as folder:
            local = Path(folder) / LEASE
            local.write_text(json.dumps({"by": self._token, "at": time.time()}))
            self._store.put({LEASE: local})

    def _keep_renewing(self, is_over: threading.Event) -> None:
        """Renew the lease until it is over, or another process has taken it."""
        while self._fault is None and not is_over.wait(_RENEW_S):
            try:
                self._refuse_another(float("inf"))
                self._renew()
            except DatasetError as error:
                self._fault = error
            except OSError as error:  # of the local disk
                self._fault = DatasetError(f"{self._store}: {one_line(error)}")
