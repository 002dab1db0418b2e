"""What a worker process does: run the jobs that come through its pipe."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import pickle
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

from simbench.core.errors import one_line
from simbench.runtime.messages import receive, send

__all__ = ["JobLostError", "ReportProgress", "WorkerSettings", "is_worker", "serve"]

ReportProgress = Callable[[int, int], None]
"""What a job calls with the steps done and their total."""

_REPORT_EVERY_S = 0.1
_serving: list[int] = []  # the process that serves, which its forked children are not


class JobLostError(Exception):
    """Raised by a job that something outside has disturbed: it may be run again."""


@dataclass(frozen=True, slots=True)
class WorkerSettings:
    """What a worker takes over from the process that it works for.

    Attributes
    ----------
    log : str
        File that receives what it prints.
    environment : dict
        All its variables.
    path : list of str
        Where it finds modules.
    folder : str
        Where it works; empty if that is gone.
    """

    log: str
    environment: dict[str, str]
    path: list[str] = field(default_factory=lambda: list(sys.path))
    folder: str = field(default_factory=lambda: _working_folder())

    def apply(self) -> None:
        """Make this process so.

        Raises
        ------
        OSError
            If the log cannot be written, or the folder is gone.
        """
        os.environ.clear()
        os.environ.update(self.environment)
        sys.path[:] = self.path
        tempfile.tempdir = None  # so that a TMPDIR in the environment is used
        if self.folder:
            os.chdir(self.folder)
        _redirect_output(self.log)


def is_worker() -> bool:
    """Whether this process serves jobs: it has one thread of Python."""
    return _serving == [os.getpid()]


def serve(pipe: Connection) -> None:
    """Run jobs until the pipe closes.

    Parameters
    ----------
    pipe : Connection
        The first message is a `WorkerSettings`, each later one a function and its
        arguments. Answers are pairs: ``started`` and None; ``progress`` and the share
        done; then ``done`` and a result, or ``failed`` or ``lost`` and one line.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _serving[:] = [os.getpid()]
    with contextlib.suppress(EOFError, OSError):
        settings = pickle.loads(receive(pipe))
        try:
            settings.apply()
        except OSError as error:  # a full disk
            send(pipe, ("lost", f"{error.filename}: cannot be used: {error.strerror}"))
            return
        while True:
            message = receive(pipe)
            try:
                function, arguments = pickle.loads(message)  # imports what it needs
                send(pipe, ("started", None))
                answer = "done", function(*arguments, _ProgressSender(pipe))
            except JobLostError as error:
                answer = "lost", str(error)
            except BaseException as error:  # Ctrl-C is ignored: all come from the job
                traceback.print_exc()
                answer = "failed", one_line(error)
            # once it has answered, it may be killed
            with contextlib.suppress(Exception):
                sys.stdout.flush()
            send(pipe, answer)


def _working_folder() -> str:
    try:
        return str(Path.cwd())
    except FileNotFoundError:
        return ""


def _redirect_output(log: str) -> None:
    """Send what this process prints, from C or from Python, to a file."""
    try:
        file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    except OSError as error:
        error.filename = log
        raise
    os.dup2(file, 1)
    os.dup2(file, 2)
    faulthandler.enable()


class _ProgressSender:
    """Sends the share of a job that is done, at most ten times a second."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe
        self._next = 0.0

    def __call__(self, done: int, total: int) -> None:
        if time.monotonic() >= self._next:
            send(self._pipe, ("progress", min(done / total, 1.0)))
            self._next = time.monotonic() + _REPORT_EVERY_S
