"""Jobs for the workers of a cluster, which import them by name."""

from __future__ import annotations

import os
import time
from pathlib import Path
from types import SimpleNamespace

from distributed import KilledWorker

from simbench.runtime.pool import ReportProgress


def begin_then_write(
    seconds: float, begun: Path, late: Path, report: ReportProgress
) -> None:
    """Write in a file that it began and in which process, and later another file."""
    unfinished = begun.with_suffix(".unfinished")
    unfinished.write_text(f"{os.getpid()} {os.getppid()}")
    unfinished.replace(begun)
    time.sleep(seconds)
    late.write_text("still here")


def be_given_up() -> None:
    """Fail as Dask fails a job that one worker after the other was lost with."""
    raise KilledWorker("job", SimpleNamespace(address="tcp://gone:1"), 3)
