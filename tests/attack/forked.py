"""Run a command line in a forked child, with limits of time and memory.

What commands import is imported once, in the process that forks: a third of the time
of a short command.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from simbench.cli import main

__all__ = ["Ended", "in_child", "run_command", "snapshot"]


class Ended(NamedTuple):
    """How a child ended.

    Attributes
    ----------
    pid : int
        Its number, and that of its session.
    status : int
        Its exit status, or the negative number of the signal that ended it.
    seconds : float
        Of wall time.
    cpu_seconds : float
        Of processor time, with that of its own children: the same on a busy machine.
    peak_bytes : int
        Largest resident memory of the child or one of its own children.
    stdout, stderr : bytes
        What was printed.
    """

    pid: int
    status: int
    seconds: float
    cpu_seconds: float
    peak_bytes: int
    stdout: bytes
    stderr: bytes

    @property
    def output(self) -> str:
        """What was printed, errors last."""
        return (self.stdout + self.stderr).decode(errors="replace")

    @property
    def has_traceback(self) -> bool:
        """Whether a traceback was printed."""
        return "Traceback (most recent call last)" in self.output


def in_child(
    work: Callable[[], int], folder: Path, *, limit_s: float = 30.0, memory: int = 0
) -> Ended:
    """Do some work in a forked child.

    Parameters
    ----------
    work : callable
        Returns the exit status.
    folder : Path
        Printed text goes to ``stdout`` and ``stderr`` there.
    limit_s : float, s
        The child and its own children are killed after it.
    memory : int, bytes
        Limit of the child's address space beyond what it has at the start; 0 for none.
    """
    start = time.monotonic()
    child = os.fork()
    if child == 0:
        _work_and_exit(work, folder, memory)
    status, usage = _wait(child, start + limit_s)
    return Ended(
        pid=child,
        status=os.waitstatus_to_exitcode(status),
        seconds=time.monotonic() - start,
        cpu_seconds=usage.ru_utime + usage.ru_stime,
        peak_bytes=usage.ru_maxrss * 1024,
        stdout=(folder / "stdout").read_bytes(),
        stderr=(folder / "stderr").read_bytes(),
    )


def run_command(
    arguments: Sequence[str | bytes],
    folder: Path,
    *,
    limit_s: float = 30.0,
    environment: Mapping[str, str] | None = None,
) -> Ended:
    """Run one command of simbench in a forked child.

    Parameters
    ----------
    arguments : sequence of str or bytes
    folder : Path
        Where it works; temporary files go to ``temporary`` there.
    limit_s : float, s
    environment : mapping, optional
        Variables that differ from those of this process.
    """
    (folder / "temporary").mkdir(exist_ok=True)
    variables = {"TMPDIR": str(folder / "temporary"), "COLUMNS": "200"}

    def command() -> int:
        os.chdir(folder)
        os.environ.update(variables | dict(environment or {}))
        tempfile.tempdir = None  # read TMPDIR again
        sys.argv[1:] = [os.fsdecode(argument) for argument in arguments]
        main()
        return 0

    _import_what_commands_import()
    return in_child(command, folder, limit_s=limit_s)


def snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    """Return size and time of change of every file below a folder."""
    return {
        str(path.relative_to(folder)): (path.lstat().st_size, path.lstat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
    }


@cache
def _import_what_commands_import() -> None:
    for name in (
        "simbench.experiments.run",
        "simbench.experiments.run_suite",
        "simbench.experiments.refine_sweep",
        "simbench.generation.dataset.produce",
        "simbench.generation.preview",
    ):
        importlib.import_module(name)


def _work_and_exit(work: Callable[[], int], folder: Path, memory: int) -> None:
    status = 70
    try:
        os.setsid()
        with open(os.devnull, "rb") as nothing:  # noqa: PTH123
            os.dup2(nothing.fileno(), 0)
        for number, name in ((1, "stdout"), (2, "stderr")):
            with (folder / name).open("wb") as printed:
                os.dup2(printed.fileno(), number)
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
        sys.stderr = os.fdopen(2, "w", 1, encoding="utf-8", closefd=False)
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
