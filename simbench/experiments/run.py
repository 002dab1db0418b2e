"""Run a request: generate, track, score and report into a run folder."""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from simbench.core.errors import DatasetError
from simbench.evaluation.measures.rules import find_rules
from simbench.evaluation.protocols.protocol_scores import SEGMENTS
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.sweep_scores import SweepScores, sweep_scores
from simbench.experiments.experiment import Experiment
from simbench.experiments.grid import finished_scores, run_grid
from simbench.experiments.plan import SequenceTask, generation_code, plan
from simbench.experiments.request import Request
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tracker_codes import tracker_codes
from simbench.report import write_report
from simbench.runtime.opengl_renderer import look_for_opengl, opengl_renderer
from simbench.runtime.run_jobs import Progress
from simbench.runtime.versions import host, versions

__all__ = ["RunResult", "run_experiment", "run_facts"]

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RunResult:
    """Scores and report of a run.

    Attributes
    ----------
    scores : Scores
    folder : RunFolder
        With the report.
    swept : SweepScores or None
        Summary of the sweep, if the run is one.
    """

    scores: Scores
    folder: RunFolder
    swept: SweepScores | None

    @property
    def report(self) -> Path:
        """The HTML file."""
        return self.folder.report

    @property
    def failures(self) -> list[str]:
        """One line for each run that failed, and for each clip that was skipped.

        In a sweep, a value that cannot be reached is a result and no failure, as long
        as another value can be reached.
        """
        return list(dict.fromkeys(map(self._failure, self._failed_runs())))

    @property
    def outputs_of_failures(self) -> list[Path]:
        """What failed trackers printed, with their tracebacks."""
        files = map(self._output, self._failed_runs())
        return [file for file in files if file.exists()]

    def _failed_runs(self) -> list[Any]:
        status = self.scores.runs["status"]
        is_failed = status != "ok"
        if self.swept is not None and not (status == "unreachable").all():
            is_failed = status == "failed"
        return list(self.scores.runs[is_failed].itertuples())

    def _failure(self, run: Any) -> str:
        if run.status == "skipped":
            return f"{run.scenario} was skipped: {run.reason}"
        output = self._output(run)
        where = f" (see {output})" if output.exists() else ""
        name = _scenario_of(run)
        seed = "" if pd.isna(run.seed) else f", seed {run.seed}"
        return f"{run.tracker} on {name}{seed}: {run.reason}{where}"

    def _output(self, run: Any) -> Path:
        seed = None if pd.isna(run.seed) else int(run.seed)
        passes = 1 if run.protocol == "ope" else SEGMENTS
        return self.folder.output(
            _scenario_of(run), seed, run.tracker, run.repetition // passes
        )


def _scenario_of(run: Any) -> str:
    return "@".join(filter(None, (str(run.scenario), str(run.variant))))


def run_experiment(
    request: Request,
    path: Path,
    *,
    command: str,
    jobs: int = 1,
    cluster: str = "",
    keep_sequences: bool = False,
    replace: bool = False,
    rules: str = "simbench",
    progress: Progress | None = None,
    notice: Callable[[str], None] = logger.warning,
) -> RunResult:
    """Generate, track, score and report; continue where an earlier call stopped.

    In the folder of an earlier run of other trackers, scenarios or seeds, the results
    are added to those that are there.

    Parameters
    ----------
    request : Request
    path : Path
        Run folder: new, empty, or that of an earlier run.
    command : str
        Command line of the user, for ``run.json``.
    jobs : int
        Worker processes at a time; 0 to do all in this process, without isolation of
        trackers, for a debugger.
    cluster : str
        Address of a Dask scheduler whose workers do the work instead.
    keep_sequences : bool
        Keep the sequences in ``path/sequences``; later calls keep them too.
    replace : bool
        Compute what is requested again, and drop those earlier results that use its
        names for something else.
    rules : str
        By whose rules all runs of the folder are scored, see
        `simbench.evaluation.measures.rules.RULES`. No tracker runs again for other
        rules.
    progress : callable, optional
    notice : callable
        Receives a line for the user if earlier results are made again.

    Raises
    ------
    SimbenchError
        If there are no such rules.
    TrackerError
        If a tracker cannot be constructed.
    DatasetError
        If ``path`` cannot be used, or has results of another scenario or tracker under
        a name of the request.
    """
    folder = RunFolder(path)
    chosen = find_rules(rules)
    began = time.monotonic()
    is_isolated = jobs > 0 or bool(cluster)
    folder.refuse_foreign()  # mistakes are reported before trackers are tried
    renders = bool(folder.joined(request, replace=replace).scenarios)
    if renders:
        look_for_opengl()
    codes = tracker_codes(
        request.trackers, timeout_s=request.timeout_s, isolated=is_isolated
    )
    if renders:
        generation_code()  # kept for the plan, while the renderer is found out
    renderer = opengl_renderer() if renders else ""
    with folder.locked():
        experiment = folder.joined(request, replace=replace)
        others = [t for t in experiment.trackers if t.label not in codes]
        codes |= tracker_codes(
            others, timeout_s=request.timeout_s, isolated=is_isolated
        )
        tasks = plan(experiment, folder.absolute(), codes, renderer)
        if replace:
            _remove_parts(tasks, request)
        elif folder.is_finished(experiment.digest, rules):
            known = finished_scores(tasks, with_sequences=keep_sequences)
            if known is not None:
                known = known.by_rules(chosen)
                return RunResult(known, folder, _swept(experiment, known, path))
        keep_sequences = keep_sequences or folder.keeps_sequences
        environment = versions() | ({"opengl": renderer} if renders else {})
        _say_what_changed(folder, environment, notice)
        commands = folder.commands if len(experiment.requests) > 1 else []
        facts = run_facts(
            experiment,
            "\n".join(dict.fromkeys([*commands, command])),
            environment,
            keep_sequences=keep_sequences,
            rules=rules,
        )
        folder.write_facts(facts)
        scores, sequences = run_grid(
            tasks,
            folder.absolute(),
            jobs=jobs,
            cluster=cluster,
            keep_sequences=keep_sequences,
            progress=progress,
        )
        if progress is not None:
            progress(1.0, 1.0, "writing the report")
        scores = scores.by_rules(chosen)
        scores.write(path)
        swept = _swept(experiment, scores, path)
        facts["duration_s"] = round(time.monotonic() - began, 1)
        facts["finished"] = True
        write_report(scores, sequences, facts, folder.report, swept=swept)
        folder.write_facts(facts)
        if not keep_sequences:
            folder.remove_sequences()
    return RunResult(scores, folder, swept)


def run_facts(
    experiment: Experiment,
    command: str,
    environment: Mapping[str, str],
    *,
    keep_sequences: bool,
    rules: str = "simbench",
) -> dict[str, Any]:
    """Return the content of ``run.json`` before the run starts.

    ``command`` holds the commands of all requests, one a line.
    """
    return {
        "command": command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "finished": False,
        "keep_sequences": keep_sequences,
        "rules": rules,
        "versions": dict(environment),
        "host": host(),
        "duration_s": None,
        **experiment.facts(),
    }


def _remove_parts(tasks: list[SequenceTask], request: Request) -> None:
    """Remove the stored results of a request, and the sequences that it needs."""
    names: set[tuple[str, int | None]] = {
        (one.full_name, seed) for one in request.scenarios for seed in request.seeds
    }
    names |= {(clip.full_name, clip.seed) for clip in request.clips}
    labels = {one.label for one in request.trackers}
    for task in tasks:
        if (task.source.full_name, task.seed) not in names:
            continue
        shutil.rmtree(task.sequence, ignore_errors=True)
        for track in task.track_tasks:
            if track.tracker.label in labels:
                shutil.rmtree(track.part, ignore_errors=True)


def _say_what_changed(
    folder: RunFolder, environment: Mapping[str, str], notice: Callable[[str], None]
) -> None:
    """Say in one line why results that are there cannot be used any more, if so."""
    try:
        before = folder.read_facts().get("versions", {})
    except DatasetError:
        return
    if before.get("opengl") is None:  # nothing was rendered
        before = before | {"opengl": environment.get("opengl")}
    changed = [
        f"{name} {before.get(name) or 'missing'} -> {found or 'missing'}"
        for name, found in environment.items()
        if before.get(name) != found
    ]
    if changed:
        notice(
            f"{folder.path}: results are made again, since the environment is another: "
            f"{', '.join(changed)}"
        )


def _swept(experiment: Experiment, scores: Scores, path: Path) -> SweepScores | None:
    """Summarise a sweep and write the summary."""
    if experiment.sweep is None:
        return None
    swept = sweep_scores(scores.runs, experiment.sweep, experiment.rng())
    swept.write(path)
    return swept
