"""What workers do: generate a sequence, and run a tracker over a sequence."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Literal

import cv2

from simbench.core.atomic_write import atomic_write_folder
from simbench.core.errors import ScenarioError, SimbenchError, one_line
from simbench.datasets.native import read_sequence
from simbench.evaluation.run_tracker import track
from simbench.evaluation.scores import score
from simbench.experiments.plan import TrackTask
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.schema import Scenario

__all__ = ["generate_sequence", "run_track"]


def generate_sequence(
    scenario: Scenario, seed: int, folder: Path, report: ReportProgress
) -> tuple[Literal["failed", "unreachable"], str] | None:
    """Generate one sequence into ``folder``.

    Returns
    -------
    (status, reason) or None
        Why there is no sequence, in one line: ``unreachable`` where the scenario
        requests what cannot be reached.
    """
    # here, so that a process that only tracks loads neither simulator nor renderer
    from simbench.generation.generate import generate

    cv2.setNumThreads(1)
    shutil.rmtree(folder, ignore_errors=True)  # what an interrupted run left
    try:
        generate(scenario, seed, folder, progress=report)
    except ScenarioError as error:
        return "unreachable", str(error)
    except SimbenchError as error:
        return "failed", str(error)
    return None


def run_track(task: TrackTask, timeout_s: float, report: ReportProgress) -> None:
    """Run a tracker over a sequence on disk and write its scores atomically.

    Parameters
    ----------
    task : TrackTask
    timeout_s : float, s
        Wall time after which the tracker is stopped.
    report : callable
    """
    cv2.setNumThreads(1)
    sequence = read_sequence(task.sequence)
    try:
        tracker = task.tracker.make()
    except BaseException as error:  # a tracker's fault is a result
        is_ours = isinstance(error, SimbenchError)
        scores = task.failure(str(error) if is_ours else one_line(error))
    else:
        found = track(
            tracker,
            sequence,
            task.seed,
            label=task.tracker.label,
            repetition=task.repetition,
            timeout_s=timeout_s,
            on_frame=report,
        )
        scores = score(found, sequence)
    with atomic_write_folder(task.part) as temporary:
        scores.write(temporary)
