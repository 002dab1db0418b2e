"""A run from what is asked to the finished run folder."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from simbench.doctor import opengl_renderer
from simbench.environment import host, versions
from simbench.report import write_report
from simbench.running.folder import RunFolder
from simbench.running.grid import Progress, finished_scores, run_grid
from simbench.running.request import Request, spec_text
from simbench.scores import Scores

__all__ = ["Outcome", "run_facts", "whole_run"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came out of a run.

    Attributes
    ----------
    scores : Scores
    report : Path
        The HTML file.
    """

    scores: Scores
    report: Path

    @property
    def failures(self) -> list[str]:
        """One line for each run that failed."""
        failed = self.scores.runs[self.scores.runs["status"] == "failed"]
        return [
            f"{run.tracker} on {run.scenario}, seed {run.seed}: {run.reason}"
            for run in failed.itertuples()
        ]


def whole_run(
    request: Request,
    path: Path,
    *,
    command: str,
    jobs: int = 1,
    keep_sequences: bool = False,
    fresh: bool = False,
    progress: Progress | None = None,
) -> Outcome:
    """Film, follow, score and report; go on where an earlier call stopped.

    Parameters
    ----------
    request : Request
    path : Path
        Run folder: new, empty, or that of an earlier run.
    command : str
        What the user typed, for ``run.json``.
    jobs : int
        Worker processes at a time.
    keep_sequences : bool
        Leave the pictures in ``path/sequences``.
    fresh : bool
        Do again what is done already.
    progress : callable, optional

    Raises
    ------
    DatasetError
        If ``path`` cannot be used.
    """
    folder = RunFolder(path)
    began = time.monotonic()
    with folder.claimed():
        if fresh:
            folder.forget()
        if folder.is_finished(request.digest):
            known = finished_scores(request, folder)
            if known is not None:
                return Outcome(known, folder.report)
        facts = run_facts(request, command)
        folder.write_facts(facts)
        scores, sequences = run_grid(
            request, folder, jobs=jobs, keep_sequences=keep_sequences, progress=progress
        )
        if progress is not None:
            progress(1.0, 1.0, "writing the report")
        scores.write(path)
        facts["duration_s"] = round(time.monotonic() - began, 1)
        facts["finished"] = True
        write_report(scores, list(sequences.values()), facts, folder.report)
        folder.write_facts(facts)
        if not keep_sequences:
            shutil.rmtree(folder.sequences, ignore_errors=True)
    return Outcome(scores, folder.report)


def run_facts(request: Request, command: str) -> dict[str, Any]:
    """Return what stands in ``run.json`` before anything is done."""
    return {
        "command": command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "finished": False,
        "digest": request.digest,
        "versions": versions() | {"opengl": opengl_renderer()},
        "host": host(),
        "seeds": list(request.seeds),
        "repetitions": request.repetitions,
        "timeout_s": request.timeout_s,
        "scenarios": [
            {
                "name": scenario.name,
                "title": scenario.title,
                "tests": scenario.tests,
                "digest": scenario.digest,
                "scenario": scenario.model_dump(mode="json"),
            }
            for scenario in request.scenarios
        ],
        "trackers": [
            {"label": tracker.label, "spec": spec_text(tracker)}
            for tracker in request.trackers
        ],
        "duration_s": None,
    }
