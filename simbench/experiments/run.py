"""Run a request: generate, track, score and report into a run folder."""

from __future__ import annotations

import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from simbench.evaluation.scores import Scores
from simbench.evaluation.sweep_scores import SweepScores, sweep_scores
from simbench.experiments.grid import finished_scores, run_grid
from simbench.experiments.request import Request, spec_text
from simbench.experiments.run_folder import RunFolder
from simbench.report import write_report
from simbench.runtime.doctor import opengl_renderer
from simbench.runtime.run_jobs import Progress
from simbench.runtime.versions import host, versions

__all__ = ["RunResult", "run_experiment", "run_facts"]


@dataclass(frozen=True, slots=True)
class RunResult:
    """Scores and report of a run.

    Attributes
    ----------
    scores : Scores
    report : Path
        The HTML file.
    swept : SweepScores or None
        Summary of the sweep, if the run is one.
    """

    scores: Scores
    report: Path
    swept: SweepScores | None

    @property
    def failures(self) -> list[str]:
        """One line for each run that failed.

        In a sweep, a value that cannot be reached is a result and no failure, as long
        as another value can be reached.
        """
        status = self.scores.runs["status"]
        is_failed = status != "ok"
        if self.swept is not None and not (status == "unreachable").all():
            is_failed = status == "failed"
        return [
            f"{run.tracker} on "
            f"{'@'.join(filter(None, (str(run.scenario), str(run.variant))))}, "
            f"seed {run.seed}: {run.reason}"
            for run in self.scores.runs[is_failed].itertuples()
        ]


def run_experiment(
    request: Request,
    path: Path,
    *,
    command: str,
    jobs: int = 1,
    cluster: str = "",
    keep_sequences: bool = False,
    fresh: bool = False,
    progress: Progress | None = None,
) -> RunResult:
    """Generate, track, score and report; continue where an earlier call stopped.

    Parameters
    ----------
    request : Request
    path : Path
        Run folder: new, empty, or that of an earlier run.
    command : str
        Command line of the user, for ``run.json``.
    jobs : int
        Worker processes at a time.
    cluster : str
        Address of a Dask scheduler whose workers do the work instead.
    keep_sequences : bool
        Keep the sequences in ``path/sequences``. Later calls keep them too, until one
        with ``fresh``.
    fresh : bool
        Compute everything again.
    progress : callable, optional

    Raises
    ------
    DatasetError
        If ``path`` cannot be used.
    """
    folder = RunFolder(path)
    began = time.monotonic()
    with folder.locked():
        if fresh:
            folder.forget()
        if folder.is_finished(request.digest):
            known = finished_scores(request, folder, with_sequences=keep_sequences)
            if known is not None:
                swept = _swept(request, known, path)
                return RunResult(known, folder.report, swept)
        keep_sequences = keep_sequences or folder.keeps_sequences
        facts = run_facts(request, command, keep_sequences=keep_sequences)
        folder.write_facts(facts)
        with ThreadPoolExecutor(1) as aside:  # takes a second
            opengl = aside.submit(opengl_renderer)
            scores, sequences = run_grid(
                request,
                folder,
                jobs=jobs,
                cluster=cluster,
                keep_sequences=keep_sequences,
                progress=progress,
            )
        facts["versions"]["opengl"] = opengl.result()
        if progress is not None:
            progress(1.0, 1.0, "writing the report")
        scores.write(path)
        swept = _swept(request, scores, path)
        facts["duration_s"] = round(time.monotonic() - began, 1)
        facts["finished"] = True
        write_report(scores, sequences, facts, folder.report, swept=swept)
        folder.write_facts(facts)
        if not keep_sequences:
            shutil.rmtree(folder.sequences, ignore_errors=True)
    return RunResult(scores, folder.report, swept)


def run_facts(
    request: Request, command: str, *, keep_sequences: bool
) -> dict[str, Any]:
    """Return the content of ``run.json`` before the run starts."""
    return {
        "command": command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "finished": False,
        "keep_sequences": keep_sequences,
        "digest": request.digest,
        "versions": versions(),
        "host": host(),
        "seeds": list(request.seeds),
        "repetitions": request.repetitions,
        "timeout_s": request.timeout_s,
        "scenarios": [
            {
                "name": scenario.name,
                "variant": scenario.variant,
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
        "sweep": None if request.sweep is None else request.sweep.facts(),
        "duration_s": None,
    }


def _swept(request: Request, scores: Scores, path: Path) -> SweepScores | None:
    """Summarise a sweep and write the summary."""
    if request.sweep is None:
        return None
    swept = sweep_scores(scores.runs, request.sweep, request.rng())
    swept.write(path)
    return swept
