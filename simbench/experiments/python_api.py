"""``run``, ``evaluate`` and ``sweep`` as Python functions, for scripts, notebooks."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from simbench.datasets.formats.readers.annotation import ReadOptions
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.sweep_scores import SweepScores
from simbench.experiments.clips import find_clips
from simbench.experiments.refine_sweep import ROUNDS, refined_run
from simbench.experiments.request import Request, sweep_request
from simbench.experiments.run import RunResult, run_experiment
from simbench.runtime.run_jobs import Progress
from simbench.runtime.scratch import scratch_folder
from simbench.runtime.versions import core_count
from simbench.scenarios.files.loading import load_variants
from simbench.scenarios.schema import Scenario
from simbench.trackers.find_tracker import find_tracker

__all__ = ["evaluate", "run", "sweep"]

ScenarioLike = Scenario | str | Path


def run(
    scenarios: ScenarioLike | Iterable[ScenarioLike],
    trackers: str | Iterable[str],
    seeds: Iterable[int] = (0, 1, 2),
    *,
    repetitions: int = 1,
    frames: int | None = None,
    out: Path | str | None = None,
    jobs: int | None = None,
    cluster: str = "",
    timeout_s: float = 300.0,
    memory_mb: int = 4096,
    keep_sequences: bool = False,
    rules: str = "simbench",
    protocol: str = "ope",
    progress: Progress | None = None,
) -> Scores:
    """Generate sequences, run trackers on them and score the tracks.

    The same as ``simbench run``, which also prints the table.

    Parameters
    ----------
    scenarios : Scenario, str or Path, or several
        Names from `simbench.list_scenarios`, ``NAME@VARIANT``, ``NAME@all``, YAML
        files, or scenarios from `simbench.load_scenario`.
    trackers : str, or several
        Specifications ``[LABEL=]NAME[@PARAMETER=VALUE]...``, see
        `simbench.list_trackers`.
    seeds : iterable of int
        One scenario instance a seed.
    repetitions : int
        Runs of each tracker on the same sequence.
    frames : int, optional
        Cut scenarios to this many frames, at least 2.
    out : Path or str, optional
        Run folder with tables and report; what is finished there is not computed again.
        By default a temporary folder that is removed.
    jobs : int, optional
        Worker processes at a time; by default as many as there are cores. 0 runs all in
        this process, so that a debugger or profiler sees the trackers.
    cluster : str
        Address of a Dask scheduler whose workers do the work instead.
    timeout_s : float, s
        Wall time of one tracker on one sequence.
    memory_mb : int, MiB
        Memory that a process of a tracker may allocate.
    keep_sequences : bool
        Keep the frames in the run folder.
    rules : str
        By whose rules to score: ``simbench``, ``otb``, ``got10k``, ``vot``, ``lasot``.
    protocol : str
        From which frames and boxes to start: ``ope`` (once), ``tre``, ``sre``,
        ``restart``, ``multistart``, see `simbench.evaluation.protocols.starts`.
    progress : callable of (done, total, what), optional

    Returns
    -------
    Scores
        A run that failed has a row with its reason.

    Raises
    ------
    SimbenchError
        If a scenario, tracker or option is wrong, or the folder cannot be used.

    Examples
    --------
    >>> import simbench
    >>> scores = simbench.run("smoke", "still", seeds=[0], frames=4, jobs=1)
    >>> scores.runs[["scenario", "seed", "tracker", "status"]].values.tolist()
    [['smoke', 0, 'still', 'ok']]
    """
    request = Request(
        tuple(_scenarios(scenarios, frames)),
        tuple(find_tracker(spec) for spec in _several(trackers)),
        tuple(seeds),
        repetitions,
        timeout_s,
        memory_mb,
        protocol=protocol,
    )
    result = _run(
        request,
        out,
        jobs=core_count() if jobs is None else jobs,
        cluster=cluster,
        keep_sequences=keep_sequences,
        rules=rules,
        progress=progress,
    )
    return result.scores


def evaluate(
    datasets: str | Path | Iterable[str | Path],
    trackers: str | Iterable[str],
    *,
    repetitions: int = 1,
    layout: str = "",
    origin: int | None = None,
    box: tuple[float, float, float, float] | None = None,
    target: str = "",
    skip_broken: bool = False,
    out: Path | str | None = None,
    jobs: int | None = None,
    cluster: str = "",
    timeout_s: float = 300.0,
    memory_mb: int = 4096,
    rules: str = "simbench",
    protocol: str = "ope",
    progress: Progress | None = None,
) -> Scores:
    """Run trackers on sequences that exist, recorded or generated, and score them.

    The same as ``simbench evaluate``, which also prints the table.

    Parameters
    ----------
    datasets : str or Path, or several
        Sequences, or folders of sequences, in any layout that `simbench.read_sequence`
        reads.
    trackers, repetitions, out, jobs, cluster, timeout_s, memory_mb, progress
        See `run`, also for ``rules`` and ``protocol``.
    layout, origin, box, target
        See `simbench.read_sequence`.
    skip_broken : bool
        Give damaged sequences rows of the status ``skipped``, in place of an error.

    Returns
    -------
    Scores
        The scenario of a recorded clip is its name; its seed is <NA>.

    Raises
    ------
    SimbenchError
        If a data set, tracker or option is wrong, or the folder cannot be used.

    Examples
    --------
    >>> import simbench, tempfile
    >>> scenario = simbench.load_scenario("smoke").shortened(4)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = simbench.generate(scenario, 0, folder)
    ...     scores = simbench.evaluate(folder, "still", jobs=0)
    >>> scores.runs[["scenario", "seed", "tracker", "status"]].values.tolist()
    [['smoke', 0, 'still', 'ok']]
    """
    options = ReadOptions(layout, origin, box, target)
    listed = [datasets] if isinstance(datasets, str | Path) else list(datasets)
    specs = tuple(find_tracker(spec) for spec in _several(trackers))
    clips = find_clips(
        map(Path, listed), options, skip_broken=skip_broken, progress=progress
    )
    limits = timeout_s, memory_mb
    result = _run(
        Request((), specs, (), repetitions, *limits, clips=clips, protocol=protocol),
        out,
        jobs=core_count() if jobs is None else jobs,
        cluster=cluster,
        rules=rules,
        progress=progress,
    )
    return result.scores


def sweep(
    scenario: ScenarioLike,
    vary: str | Iterable[str],
    trackers: str | Iterable[str],
    seeds: Iterable[int] = (0, 1, 2),
    *,
    repetitions: int = 1,
    frames: int | None = None,
    out: Path | str | None = None,
    jobs: int | None = None,
    cluster: str = "",
    timeout_s: float = 300.0,
    memory_mb: int = 4096,
    progress: Progress | None = None,
    refine: int = ROUNDS,
) -> SweepScores:
    """Vary one or two dials of a scenario and find where each tracker breaks.

    The same as ``simbench sweep``, which also prints the tables.

    Parameters
    ----------
    scenario : Scenario, str or Path
        One scenario, as in `run`.
    vary : str, or two
        ``DIAL=FIRST:LAST:STEP`` with both ends, or ``DIAL=VALUE,VALUE,...``.
    trackers, seeds, repetitions, frames, out, jobs, cluster, timeout_s, memory_mb
        See `run`.
    refine : int
        How often the step in which success falls to one half is halved, with one dial.

    Returns
    -------
    SweepScores
        Scores by value of the dial, and breaking points with intervals.

    Raises
    ------
    SimbenchError
        As `run`, and if a dial or its values are wrong.

    Examples
    --------
    >>> import simbench
    >>> found = simbench.sweep("smoke", "noise=0,0.05", "still", [0], frames=4)
    >>> found.sweep.dials
    ('noise',)
    """
    found = _scenarios(scenario, frames)
    request = sweep_request(
        found,
        _several(vary),
        tuple(find_tracker(spec) for spec in _several(trackers)),
        tuple(seeds),
        repetitions,
        timeout_s,
        memory_mb,
    )
    with scratch_folder("run-") as temporary:
        folder = out or temporary

        def run_part(part: Request) -> RunResult:
            return _run(
                part,
                folder,
                jobs=core_count() if jobs is None else jobs,
                cluster=cluster,
                progress=progress,
            )

        result = refined_run(found[0], request, run_part, refine)
    if result.swept is None:
        raise AssertionError("a request with a sweep has a summary of it")
    return result.swept


def _run(
    request: Request,
    out: Path | str | None,
    *,
    jobs: int,
    cluster: str,
    progress: Progress | None,
    keep_sequences: bool = False,
    rules: str = "simbench",
) -> RunResult:
    with scratch_folder("run-") as temporary:
        return run_experiment(
            request,
            Path(out or temporary),
            command="",
            jobs=jobs,
            cluster=cluster,
            keep_sequences=keep_sequences,
            rules=rules,
            progress=progress,
        )


def _several(values: str | Iterable[str]) -> list[str]:
    return [values] if isinstance(values, str) else list(values)


def _scenarios(
    given: ScenarioLike | Iterable[ScenarioLike], frames: int | None
) -> list[Scenario]:
    listed = [given] if isinstance(given, (Scenario, str, Path)) else list(given)
    found = [
        scenario
        for one in listed
        for scenario in ([one] if isinstance(one, Scenario) else load_variants(one))
    ]
    return [s if frames is None else s.shortened(frames) for s in found]
