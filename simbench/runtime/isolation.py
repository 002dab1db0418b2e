"""Run a function in a forked process: what it does to its process ends with it.

The caller must be a worker process with few threads that never runs such functions
itself. The child gets no pipe of its parent, a process group and a memory limit of its
own, and only shares the memory that the caller made for that purpose.
"""

from __future__ import annotations

import contextlib
import os
import resource
import select
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from simbench.core.atomic_write import atomic_write
from simbench.runtime.exit_status import exit_reason, is_killed_from_outside
from simbench.runtime.process_control import adopt_orphans, die_with

__all__ = ["OUTPUT_LIMIT", "ChildEnd", "run_isolated"]

OUTPUT_LIMIT: Final = 1_000_000
"""Bytes of output that are kept: its first and its last half."""

_TICK_S = 0.1


@dataclass(frozen=True, slots=True)
class ChildEnd:
    """How an isolated function ended.

    Attributes
    ----------
    kind : {"done", "crashed", "lost", "timeout"}
        ``done``: it returned or raised. ``crashed``: its process ended by itself.
        ``lost``: another process killed it, for example because the machine had no
        memory left. ``timeout``: it was killed at its deadline.
    reason : str
        One line.
    exit_code : int or None
        The exit status of its process, or the negative number of the signal that ended
        it; None if it was killed at its deadline.
    """

    kind: Literal["done", "crashed", "lost", "timeout"]
    reason: str
    exit_code: int | None


def run_isolated(
    function: Callable[[], None],
    *,
    deadline_s: Callable[[], float],
    output: Path | None = None,
    memory_mb: int | None = None,
    on_wait: Callable[[], None] | None = None,
) -> ChildEnd:
    """Call a function in a forked child process and wait for its end.

    All processes that the child started are killed when it ends.

    Parameters
    ----------
    function : callable
        Its result is dropped; an exception is printed with its traceback.
    deadline_s : callable
        Returns the time of `time.monotonic` at which the child is killed; called ten
        times a second, so that it may depend on what the child does.
    output : Path, optional
        File for what the child prints, at most `OUTPUT_LIMIT` bytes. Not written if
        nothing is printed.
    memory_mb : int, optional
        Limit of the memory that the child may allocate, in MiB.
    on_wait : callable, optional
        Called ten times a second.
    """
    before = _children()
    adopt_orphans()
    read_end, write_end = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        # Python 3.12 warns of forks in processes with threads; ours waits for the end
        # of the parent and holds no lock
        warnings.simplefilter("ignore", DeprecationWarning)
        parent = os.getpid()
        child = os.fork()
    if child == 0:
        _run_child(function, write_end, parent, memory_mb)
    os.close(write_end)
    printed = _Output()
    try:
        end = _wait(child, read_end, printed, deadline_s, on_wait)
    finally:
        _kill_group(child)
        while left := _children() - before:  # those that they started follow
            _kill_and_reap(left)
        os.close(read_end)
        printed.write(output)
    return end


def _run_child(
    function: Callable[[], None], output: int, parent: int, memory_mb: int | None
) -> None:
    """Run the function in the child; never returns."""
    status = 1
    try:
        os.setsid()
        die_with(parent)
        null = os.open(os.devnull, os.O_RDONLY)
        os.dup2(null, 0)
        os.dup2(output, 1)
        os.dup2(output, 2)
        os.closerange(3, resource.getrlimit(resource.RLIMIT_NOFILE)[0])
        _limit_memory(memory_mb)
        function()
        status = 0
    except BaseException:  # the function's fault
        traceback.print_exc()
    finally:
        with contextlib.suppress(BaseException):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def _wait(
    child: int,
    read_end: int,
    printed: _Output,
    deadline_s: Callable[[], float],
    on_wait: Callable[[], None] | None,
) -> ChildEnd:
    watched = select.poll()
    handle = os.pidfd_open(child)
    try:
        watched.register(handle, select.POLLIN)
        watched.register(read_end, select.POLLIN)
        has_ended = False
        while not has_ended:
            ready = dict(watched.poll(1000 * _TICK_S))
            has_ended = handle in ready
            if read_end in ready and not printed.read(read_end):
                watched.unregister(read_end)
            if on_wait is not None:
                on_wait()
            if not has_ended and time.monotonic() > deadline_s():
                _kill_group(child)
                os.waitpid(child, 0)
                return ChildEnd("timeout", "killed at its time limit", None)
    finally:
        os.close(handle)
    os.set_blocking(read_end, False)  # a process it left may still hold the other end
    with contextlib.suppress(BlockingIOError):
        while printed.read(read_end):
            pass
    _, status = os.waitpid(child, 0)
    return _end_of(os.waitstatus_to_exitcode(status))


def _end_of(exit_code: int) -> ChildEnd:
    reason = exit_reason(exit_code)
    if exit_code >= 0:
        return ChildEnd("done", reason, exit_code)
    is_lost = is_killed_from_outside(exit_code)
    return ChildEnd("lost" if is_lost else "crashed", reason, exit_code)


class _Output:
    """The first and the last bytes of what a process prints."""

    def __init__(self) -> None:
        self._first = bytearray()
        self._last = bytearray()
        self._left_out = 0

    def read(self, file: int) -> bool:
        """Read what is there; return False at the end of the file."""
        data = os.read(file, 65536)
        room = OUTPUT_LIMIT // 2 - len(self._first)
        self._first += data[:room]
        self._last += data[room:]
        surplus = max(len(self._last) - OUTPUT_LIMIT // 2, 0)
        if surplus:
            del self._last[:surplus]
            self._left_out += surplus
        return bool(data)

    def write(self, path: Path | None) -> None:
        if path is None or not self._first:
            return
        gap = f"\n[{self._left_out} bytes left out]\n" if self._left_out else ""
        with atomic_write(path) as temporary:
            temporary.write_bytes(bytes(self._first) + gap.encode() + bytes(self._last))


def _kill_group(leader: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)
    with contextlib.suppress(ProcessLookupError):
        os.kill(leader, signal.SIGKILL)  # it may not have its group yet


def _kill_and_reap(processes: set[int]) -> None:
    for process in processes:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(process, 0)


def _children() -> set[int]:
    """Return the child processes of this process."""
    found = Path(f"/proc/self/task/{os.getpid()}/children")
    try:
        return {int(process) for process in found.read_text().split()}
    except OSError:
        return set()


def _limit_memory(memory_mb: int | None) -> None:
    """Limit what this process may allocate beyond what it has now."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if memory_mb is None:
        return
    limit = _allocated_bytes() + memory_mb * 2**20
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    if most == resource.RLIM_INFINITY or limit < most:
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


def _allocated_bytes() -> int:
    """Return the private writable memory of this process, as Linux limits it."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmData:"):
            return int(line.split()[1]) * 1024
    return 0
