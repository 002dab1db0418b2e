"""The two things a worker does: film a sequence, and follow a target through one."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Literal

import cv2

from simbench.core.atomic_write import atomic_write_folder
from simbench.core.errors import ScenarioError, SimbenchError
from simbench.core.one_line import one_line
from simbench.datasets.native import read_sequence
from simbench.evaluation.run_tracker import track
from simbench.evaluation.scores import score
from simbench.experiments.plan import TrackTask
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.schema import Scenario

__all__ = ["film", "follow"]


def film(
    scenario: Scenario, seed: int, folder: Path, report: ReportProgress
) -> tuple[Literal["failed", "unreachable"], str] | None:
    """Generate one sequence into ``folder``.

    Returns
    -------
    (status, reason) or None
        Why there is no sequence: ``unreachable`` where the scenario asks for what
        cannot be, with one line for the user.
    """
    # here, so that who only follows loads neither simulator nor renderer
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


def follow(chase: TrackTask, timeout_s: float, report: ReportProgress) -> None:
    """Run a tracker over a sequence on disk and write its scores, whole.

    Parameters
    ----------
    chase : TrackTask
    timeout_s : float, s
        Wall time after which the run is given up.
    report : callable
    """
    cv2.setNumThreads(1)
    sequence = read_sequence(chase.sequence)
    try:
        tracker = chase.tracker.make()
    except BaseException as error:  # a tracker's fault is a result
        expected = isinstance(error, SimbenchError)
        scores = chase.failure(str(error) if expected else one_line(error))
    else:
        found = track(
            tracker, sequence, chase.track_seed, timeout_s=timeout_s, on_frame=report
        )
        label = chase.tracker.label
        scores = score(found, sequence, tracker=label, repetition=chase.repetition)
    with atomic_write_folder(chase.part) as temporary:
        scores.write(temporary)
