"""A process that has imported what workers need, and forks them.

Importing numpy, numba, pyrender and what else a worker needs takes two seconds of
processor time, a fork some milliseconds. Workers are not forked from the process that
asks for them: it may have threads and an OpenGL context, and a forked child of such a
process hangs in its first frame.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import select
import signal
import socket
import struct
import sys
import traceback
import warnings
from multiprocessing.connection import Connection
from typing import Final, NamedTuple, NoReturn

from simbench.runtime.messages import FORK_NOW
from simbench.runtime.process_control import die_with
from simbench.runtime.worker import serve

__all__ = ["main"]

_FIRST: Final = "simbench.render.gl.offscreen"
"""What the first worker of most commands needs, which is asked which OpenGL renders."""

_OF_FILMS: Final = (
    "simbench.generation.generate",
    "simbench.scenarios.highway.sumo_process",
    "simbench.generation.dataset.make_sequence",
)
"""What workers that make films need."""

_OF_ALL: Final = (
    "numba.core.registry",
    "simbench.experiments.tasks",
    "pandas",  # PyArrow imports it for the first table that is written
    "simbench.evaluation.score_track",
    "simbench.trackers.condensation",
)
"""What most workers need. One forked earlier would import the rest once more."""

_NEWS: Final = struct.Struct("!i")


class _Request(NamedTuple):
    pipe: int
    status_pipe: int
    at_once: bool


def main(requests: int, lifeline: int, renders: bool) -> NoReturn:
    """Fork a process for each request, until the process that asks has ended.

    Parameters
    ----------
    requests : int
        Socket. A request is a byte, `FORK_NOW` or `FORK_PREPARED`, with two file
        descriptors: the pipe that the new process is to serve, and one to which its
        number and, in the end, its exit status are written (four bytes each).
    lifeline : int
        Read end of a pipe that nobody else keeps open.
    renders : bool
        Whether workers will make films; if not, each that does imports what it needs.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, _wake)
    wake, woken = os.pipe2(os.O_NONBLOCK)
    signal.set_wakeup_fd(woken)
    with socket.socket(fileno=requests) as channel:
        running: dict[int, int] = {}
        own = [requests, lifeline, wake, woken]
        waiting: list[_Request] = []
        names = [*((_FIRST, *_OF_FILMS) if renders else ()), *_OF_ALL]
        while True:
            waits_s = 0.0 if names else None
            ready, _, _ = select.select([requests, lifeline, wake], [], [], waits_s)
            if lifeline in ready:
                os._exit(0)  # the kernel ends those that were forked
            if wake in ready:
                os.read(wake, 4096)
                _tell_ends(running)
            if requests in ready:
                request = _receive(channel)
                if request is not None:
                    waiting.append(request)
            elif names:
                _import(names.pop(0))
            for request in [one for one in waiting if one.at_once or not names]:
                waiting.remove(request)
                kept_out = [fd for one in waiting for fd in (one.pipe, one.status_pipe)]
                _fork(request, running, [*own, *kept_out])


def _import(name: str) -> None:
    """Do what every worker would do first; what fails is left to its jobs."""
    # libsumo prints which versions of other libraries it expects
    with contextlib.suppress(Exception), contextlib.redirect_stdout(io.StringIO()):
        importlib.import_module(name)
    if name == "numba.core.registry":  # what numba does before its first function
        with contextlib.suppress(Exception):
            target = sys.modules[name].cpu_target
            target.typing_context.refresh()
            target.target_context.refresh()


def _wake(number: int, frame: object) -> None:
    """Do nothing: the number of the signal is written to the pipe that wakes."""


def _tell_ends(running: dict[int, int]) -> None:
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if not pid:
            return
        status_pipe = running.pop(pid)
        with contextlib.suppress(BrokenPipeError):
            os.write(status_pipe, _NEWS.pack(os.waitstatus_to_exitcode(status)))
        os.close(status_pipe)


def _receive(channel: socket.socket) -> _Request | None:
    """Return a request; None where the socket is closed, and the lifeline follows."""
    kind, received, _, _ = socket.recv_fds(channel, 1, 2)
    if len(received) < 2:
        return None
    return _Request(received[0], received[1], kind == FORK_NOW)


def _fork(request: _Request, running: dict[int, int], own: list[int]) -> None:
    """Fork the process of a request."""
    pipe, status_pipe = request.pipe, request.status_pipe
    server = os.getpid()
    with warnings.catch_warnings():
        # Python 3.12 warns of forks in processes with threads; that of the allocator
        # of PyArrow is prepared for them
        warnings.simplefilter("ignore", DeprecationWarning)
        pid = os.fork()
    if not pid:
        _serve_and_exit(pipe, server, [*own, status_pipe, *running.values()])
    os.close(pipe)
    with contextlib.suppress(BrokenPipeError):
        os.write(status_pipe, _NEWS.pack(pid))
    running[pid] = status_pipe


def _serve_and_exit(pipe: int, server: int, foreign: list[int]) -> NoReturn:
    status = 1
    try:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        die_with(server)
        for number in foreign:
            os.close(number)
        with Connection(pipe) as connection:
            serve(connection)
        status = 0
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)
