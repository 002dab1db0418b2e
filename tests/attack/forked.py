"""Run a command line in a forked child, with limits of time and memory."""

from __future__ import annotations

import contextlib
import io
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from simbench.cli import execute

__all__ = ["Ended", "in_child", "run_command", "snapshot"]


class Ended(NamedTuple):
    """How a child ended.

    Attributes
    ----------
    status : int
        Its exit status, or the negative number of the signal that ended it.
    seconds : float
        Of wall time.
    cpu_seconds : float
        Of processor time, with that of its own children: the same on a busy machine.
    peak_bytes : int
        Largest resident memory of the child or one of its own children.
    output : str
    """

    status: int
    seconds: float
    cpu_seconds: float
    peak_bytes: int
    output: str

    @property
    def has_traceback(self) -> bool:
        """Whether a traceback was printed."""
        return "Traceback (most recent call last)" in self.output


def in_child(
    work: Callable[[], int], log: Path, *, limit_s: float = 30.0, memory: int = 0
) -> Ended:
    """Do some work in a forked child.

    Parameters
    ----------
    work : callable
        Returns the exit status; printed text goes to ``log``.
    log : Path
    limit_s : float, s
        The child and its own children are killed after it.
    memory : int, bytes
        Limit of the child's address space beyond what it has at the start; 0 for none.
    """
    start = time.monotonic()
    child = os.fork()
    if child == 0:
        _work_and_exit(work, log, memory)
    status, usage = _wait(child, start + limit_s)
    seconds = time.monotonic() - start
    output = log.read_text(encoding="utf-8", errors="replace")
    code = os.waitstatus_to_exitcode(status)
    cpu_seconds = usage.ru_utime + usage.ru_stime
    return Ended(code, seconds, cpu_seconds, usage.ru_maxrss * 1024, output)


def run_command(arguments: Sequence[str], folder: Path, limit_s: float = 30.0) -> Ended:
    """Run one command of simbench in a forked child, in a folder below ``folder``."""
    work = folder / "work"
    work.mkdir(exist_ok=True)

    def command() -> int:
        os.chdir(work)
        return execute(arguments)

    return in_child(command, folder / "log", limit_s=limit_s)


def snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    """Return size and time of change of every file below a folder."""
    return {
        str(path.relative_to(folder)): (path.lstat().st_size, path.lstat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
    }


def _work_and_exit(work: Callable[[], int], log: Path, memory: int) -> None:
    status = 70
    try:
        os.setpgid(0, 0)
        handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        for number in (1, 2):
            os.dup2(handle, number)
        sys.stdout = io.TextIOWrapper(os.fdopen(1, "wb", closefd=False), "utf-8")
        sys.stderr = io.TextIOWrapper(
            os.fdopen(2, "wb", closefd=False), "utf-8", line_buffering=True
        )
        if memory:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            most = pages * resource.getpagesize() + memory
            resource.setrlimit(resource.RLIMIT_AS, (most, most))
        status = work()
    except SystemExit as error:
        status = error.code if isinstance(error.code, int) else 71
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(Exception):
                stream.flush()
        os._exit(status)


def _wait(child: int, deadline: float) -> tuple[int, resource.struct_rusage]:
    while True:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            return status, usage
        if time.monotonic() > deadline:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(child, signal.SIGKILL)
            _, status, usage = os.wait4(child, 0)
            return status, usage
        time.sleep(0.005)
