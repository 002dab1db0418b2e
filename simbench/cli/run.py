"""The commands ``run`` and ``report``, which writes the report of a run again."""

from __future__ import annotations

import logging
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.console import Console

from simbench.cli.arguments import (
    Cluster,
    Frames,
    Jobs,
    Memory,
    Names,
    Out,
    ProtocolName,
    Repetitions,
    Replace,
    RulesName,
    Seeds,
    Timeout,
    Trackers,
    prepare_workers,
    scenarios_from,
    trackers_from,
)
from simbench.cli.display import print_line, print_table, progress_bar, score_table
from simbench.cli.json_output import Json, run_facts, write_json
from simbench.cli.names import PROTOCOLS, RULES, require_name
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.evaluation.scores import Scores
    from simbench.experiments.request import Request
    from simbench.experiments.run import RunResult

logger = logging.getLogger(__name__)

__all__ = [
    "execute_request",
    "finish",
    "print_protocol",
    "report",
    "run",
    "run_folder",
    "show_result",
]

_RUNS = Path("results") / "runs"
DEFAULT_TRACKERS = "condensation,directional-45,dsp,still"


def run(
    scenarios: Names,
    trackers: Trackers = DEFAULT_TRACKERS,
    seeds: Seeds = "0:3",
    repetitions: Repetitions = 1,
    frames: Frames = None,
    out: Out = None,
    jobs: Jobs = None,
    timeout: Timeout = 300.0,
    keep_sequences: Annotated[
        bool,
        typer.Option(
            "--keep-sequences", help="Keep the sequences, in later calls too."
        ),
    ] = False,
    memory_mb: Memory = 4096,
    replace: Replace = False,
    cluster: Cluster = "",
    rules: RulesName = "simbench",
    protocol: ProtocolName = "ope",
    as_json: Json = False,
) -> None:
    """Generate, track, score and report; the same command resumes a stopped run.

    A tracker that fails loses only its own row; the exit status is then 1.
    """
    require_name("--rules", rules, RULES)
    require_name("--protocol", protocol, PROTOCOLS)
    prepare_workers(jobs, cluster)
    # before the heavy imports: a mistake in a file is reported at once
    found = scenarios_from(scenarios, frames)

    from simbench.experiments.request import Request, parse_seeds

    request = Request(
        found,
        trackers_from(trackers),
        parse_seeds(seeds),
        repetitions,
        timeout,
        memory_mb,
        protocol=protocol,
    )
    console = Console()
    result = execute_request(
        console,
        request,
        out,
        jobs=jobs,
        cluster=cluster,
        keep_sequences=keep_sequences,
        replace=replace,
        rules=rules,
    )
    show_result(console, result, "run", as_json=as_json)


def show_result(
    console: Console, result: RunResult, command: str, *, as_json: bool
) -> None:
    """Print the scores of a run that has ended as tables, or as the command's JSON."""
    if as_json:
        write_json(command, run_facts(result))
        raise typer.Exit(1 if result.failures else 0)
    console.print(score_table(result.scores))
    print_protocol(console, result.scores)
    finish(console, result)


def print_protocol(console: Console, scores: Scores) -> None:
    """Print the scores by a protocol of VOT, and by whose rules the shares are."""
    from simbench.evaluation.protocols.protocol_scores import protocol_table

    found = protocol_table(scores)
    if found is not None:
        headings = ("scenario", "tracker", "accuracy", "robustness", "failures", "EAO")
        rows = [
            (
                "@".join(filter(None, (str(row.scenario), str(row.variant)))),
                str(row.tracker),
                f"{row.accuracy:.3f}",
                f"{row.robustness:.3f}",
                f"{row.failures:.1f}",
                f"{row.eao:.3f} ({row.low} to {row.high} frames)",
            )
            for row in found.itertuples()
        ]
        print_table(console, headings, rows)
    rules = set(scores.runs["rules"]) - {"simbench"}
    if rules:
        named = ", ".join(sorted(rules))
        print_line(console, f"shares are by the rules of {named}; over all sequences:")
        columns = {
            "precision": "precision_20",
            "success .5": "success_50",
            "success .75": "success_75",
            "area": "success_auc",
            "AO": "average_overlap",
        }
        pooled = scores.overall().to_dict("records")
        numbers = (
            (one["tracker"], *(f"{one[name]:.3f}" for name in columns.values()))
            for one in pooled
        )
        print_table(console, ("tracker", *columns), numbers)


def execute_request(
    console: Console,
    request: Request,
    out: Path | None,
    *,
    jobs: int | None,
    cluster: str,
    replace: bool,
    keep_sequences: bool = False,
    rules: str = "simbench",
) -> RunResult:
    """Run a request and show its progress; see `run_experiment`."""
    from simbench.experiments.run import run_experiment
    from simbench.runtime.versions import core_count

    with progress_bar(console, "the same command resumes it") as progress:
        return run_experiment(
            request,
            out or run_folder(request),
            command=shlex.join(["simbench", *sys.argv[1:]]),
            jobs=core_count() if jobs is None else jobs,
            cluster=cluster,
            keep_sequences=keep_sequences,
            replace=replace,
            rules=rules,
            progress=progress,
        )


def run_folder(request: Request) -> Path:
    """Return the folder of a request that names none."""
    return _RUNS / request.folder_name


def finish(console: Console, result: RunResult) -> NoReturn:
    """Print what failed and where the report is, and exit with status 0 or 1."""
    for failure in result.failures:
        print_line(console, f"failed: {failure}", "red")
    for output in result.outputs_of_failures:
        logger.debug("%s:\n%s", output, output.read_text(errors="replace"))
    print_line(console, f"report: {result.report}")
    raise typer.Exit(1 if result.failures else 0)


def report(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
) -> None:
    """Write the report of a run again; missing sequences are generated again."""
    _require_innermost(run_folder)

    from simbench.experiments.rebuild_report import rebuild_report

    console = Console()
    with progress_bar(console, "nothing was changed", "report") as progress:
        path = rebuild_report(run_folder, progress)
    print_line(console, f"report: {path}")


def _require_innermost(folder: Path) -> None:
    """Name the newest run of a folder that holds runs."""
    if (folder / "run.json").exists():
        return
    runs = [run for depth in ("*", "*/*") for run in folder.glob(f"{depth}/run.json")]
    if runs:
        newest = max(runs, key=lambda run: run.stat().st_mtime).parent
        raise SimbenchError(
            f"{folder}: expected a run folder, got one that holds {len(runs)}; "
            f"did you mean {str(newest)!r}?"
        )
