"""Processes that the server of `simbench.runtime.fork_server` forks for this one."""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from multiprocessing.connection import Connection, wait
from typing import Final

from simbench.runtime.limits import environment
from simbench.runtime.messages import FORK_NOW, FORK_PREPARED

__all__ = ["ForkedProcess", "fork_worker", "start_fork_server"]

_READ_AT_IMPORT: Final = (
    *("MKL_", "NUMBA_", "OMP_", "OPENBLAS_", "OPENCV_", "PYOPENGL_", "PYTHON"),
)
"""Prefixes of the environment variables that libraries read while imported."""

_PID: Final = struct.Struct("!i")
_ANSWER_S: Final = 60.0  # for the server to start and fork


class ForkedProcess:
    """A process that a fork server has forked for this one.

    Parameters
    ----------
    news : int
        Read end of the pipe on which the server tells its number and, in the end, its
        exit status. Closed with this object.

    Attributes
    ----------
    exit_code : int or None
        Its exit status, or the negative number of the signal that ended it; None while
        it runs. If the server was lost: as if killed by ``SIGKILL``, which it is.
    """

    def __init__(self, news: int) -> None:
        self._news = news
        self._told = b""
        self.exit_code: int | None = None

    def fileno(self) -> int:
        """Return what becomes readable when there are news."""
        return self._news

    def has_ended(self, within_s: float = 0.0) -> bool:
        """Wait for the end, at most so many seconds; whether it has come."""
        while self.exit_code is None and self._read(within_s):
            if len(self._told) == 2 * _PID.size:
                (self.exit_code,) = _PID.unpack(self._told[_PID.size :])
        return self.exit_code is not None

    def kill(self, within_s: float = _ANSWER_S) -> None:
        """End the process, and wait until it has ended, at most so many seconds.

        If it has not ended by then, the system still frees its memory.
        """
        while not self._has_told_pid and self._read(_ANSWER_S):
            pass
        if not self.has_ended() and self._has_told_pid:
            (pid,) = _PID.unpack(self._told[: _PID.size])
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
            self.has_ended(within_s)

    def close(self) -> None:
        """Hear no more of it."""
        if self._news >= 0:
            os.close(self._news)
        self._news = -1

    @property
    def _has_told_pid(self) -> bool:
        return len(self._told) >= _PID.size

    def _read(self, within_s: float) -> bool:
        """Read the news that come within a time; whether there may be more."""
        if self.exit_code is not None or self._news < 0:
            return False
        if not wait([self._news], within_s):
            return False
        more = os.read(self._news, 2 * _PID.size - len(self._told))
        if not more:
            self.exit_code = -signal.SIGKILL
        self._told += more
        return True


class _ForkServer:
    """The fork server of this process, seen from this process."""

    def __init__(self, *, renders: bool) -> None:
        self.settings = _import_settings()
        self._requests, theirs = socket.socketpair()
        lifeline, self._lifeline = os.pipe()
        program = (
            f"import sys; sys.path[:] = {sys.path!r}; "
            f"from simbench.runtime.fork_server import main; "
            f"main({theirs.fileno()}, {lifeline}, {renders})"
        )
        with theirs, _interrupts_ignored():  # from the beginning
            self._process = subprocess.Popen(
                [sys.executable, "-c", program],
                stdin=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(), lifeline),
                env=os.environ | environment(1),
            )
        os.close(lifeline)

    @property
    def is_usable(self) -> bool:
        """Whether it runs, and libraries would be imported in the same way today."""
        return self._process.poll() is None and self.settings == _import_settings()

    def fork(self, pipe: Connection, kind: bytes) -> ForkedProcess:
        """Request a process that serves the pipe."""
        news, status = os.pipe()
        with contextlib.suppress(OSError):  # it has died: so has the process, then
            socket.send_fds(self._requests, [kind], [pipe.fileno(), status])
        os.close(status)
        return ForkedProcess(news)

    def forget(self) -> None:
        """Close what keeps it running."""
        self._requests.close()
        os.close(self._lifeline)

    def stop(self) -> None:
        """End it, and with it the processes that it has forked."""
        self.forget()
        self._process.kill()  # it may be in the middle of an import
        self._process.wait()


_lock = threading.Lock()
_servers: list[_ForkServer] = []  # the last one forks; earlier ones may have workers
_ending: list[bool] = []  # not empty once this process ends


def start_fork_server(*, renders: bool = True) -> None:
    """Start a fork server if there is none: it imports while this process goes on.

    Parameters
    ----------
    renders : bool
        Whether its workers will make films, which needs most of the imports.
    """
    with _lock:
        _current(renders=renders)


def fork_worker(pipe: Connection, *, at_once: bool = False) -> ForkedProcess:
    """Fork a process that runs `simbench.runtime.worker.serve` on a pipe.

    Parameters
    ----------
    pipe : Connection
        The end of the child; to be closed by the caller.
    at_once : bool
        Whether it is needed before what most workers need has been imported.
    """
    with _lock:
        return _current().fork(pipe, FORK_NOW if at_once else FORK_PREPARED)


def _current(*, renders: bool = True) -> _ForkServer:
    if _ending:
        raise RuntimeError("this process ends: no worker can be started")
    if not _servers or not _servers[-1].is_usable:
        _servers.append(_ForkServer(renders=renders))
    return _servers[-1]


def _stop_all() -> None:
    with _lock:  # a thread may still want a worker
        _ending.append(True)
        while _servers:
            _servers.pop().stop()


def _forget_all() -> None:
    """Leave the servers to the process that started them, in a forked child of it."""
    global _lock
    _lock = threading.Lock()
    while _servers:
        _servers.pop().forget()


atexit.register(_stop_all)
os.register_at_fork(after_in_child=_forget_all)


def _import_settings() -> dict[str, str]:
    return {k: v for k, v in os.environ.items() if k.startswith(_READ_AT_IMPORT)}


@contextlib.contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Make processes that start in this block ignore Ctrl-C from the beginning."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
