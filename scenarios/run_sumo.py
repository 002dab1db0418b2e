"""Run a module that calls SUMO in a process of its own.

SUMO runs one simulation a process, writes to the outputs of its process and crashes on
some networks; a process of its own isolates all three.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.runtime.isolation import run_isolated
from simbench.runtime.scratch import scratch_folder
from simbench.runtime.worker import is_worker

__all__ = ["raise_if_failed", "run_sumo"]

_TIMEOUT_S: Final = 600.0


def run_sumo(module: str, request: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Run a module that calls SUMO in a child process, and return its recording.

    A worker process has the module imported and forks. Any other process may have
    threads, whose locks a forked child would wait for: it starts Python anew, which
    takes half a second longer.

    Parameters
    ----------
    module : str
        Dotted name. It has ``simulate``, see
        `simbench.scenarios.highway.sumo_process.Simulate`, and runs as a program.
    request : dict
        What ``simulate`` receives; JSON can write it.

    Returns
    -------
    dict from str to ndarray
        What ``simulate`` returns.

    Raises
    ------
    TrafficError
        With SUMO's own message, if it refuses, crashes or does not come to an end.
    """
    with scratch_folder("traffic-") as folder:
        answer = Path(folder) / "recording.npz"
        run = _run_forked if is_worker() else _run_started
        exit_code, printed = run(module, request, answer)
        raise_if_failed(exit_code, printed)
        with np.load(answer) as recording:
            return dict(recording)


def raise_if_failed(exit_code: int | None, printed: str) -> None:
    """Raise an error with SUMO's own message if its process failed.

    ``exit_code`` is negative for a signal, and None if the process ran out of time.
    """
    if exit_code is None:
        raise TrafficError(f"SUMO took longer than {_TIMEOUT_S:g} s")
    if exit_code < 0:
        raise TrafficError(f"SUMO crashed (signal {-exit_code})")
    if exit_code != 0:
        lines = printed.splitlines()
        errors = [line for line in lines if "Error" in line] or lines[-1:]
        raise TrafficError(f"SUMO refused: {' '.join(errors)[:500]}")


def _run_started(
    module: str, request: dict[str, Any], answer: Path
) -> tuple[int | None, str]:
    """Start Python with the module; return its exit status and what it printed."""
    # -P: a random.py in the user's directory must not replace the standard one
    program = [sys.executable, "-P", "-m", module, str(answer)]
    try:
        done = subprocess.run(
            program,
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None, ""
    return done.returncode, done.stderr.decode(errors="replace")


def _run_forked(
    module: str, request: dict[str, Any], answer: Path
) -> tuple[int | None, str]:
    """Fork; return the exit status of the child and what it printed."""
    program = importlib.import_module(module)
    given = json.loads(json.dumps(request))  # as a process that reads it gets it
    end_s = time.monotonic() + _TIMEOUT_S
    output = answer.with_name("output.txt")

    def answer_and_exit() -> None:
        status = program.answer_request(program.simulate, given, answer)
        sys.stderr.flush()
        os._exit(status)

    end = run_isolated(answer_and_exit, deadline_s=lambda: end_s, output=output)
    printed = output.read_text(errors="replace") if output.exists() else ""
    return end.exit_code, printed
