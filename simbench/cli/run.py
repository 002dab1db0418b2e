"""The main command, ``run``, and ``report``, which draws up its results anew."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.console import Console

from simbench.cli.arguments import (
    Cluster,
    Frames,
    Fresh,
    Jobs,
    Names,
    Out,
    Repetitions,
    Seeds,
    Timeout,
    Trackers,
    scenarios_from,
    trackers_from,
)
from simbench.cli.display import interruptible, progress_bar, score_table

if TYPE_CHECKING:
    from simbench.experiments.request import Request
    from simbench.experiments.run import RunResult

__all__ = ["conclude", "execute_request", "report", "run"]

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
            "--keep-sequences",
            help="Leave the pictures in the folder; later calls do so too.",
        ),
    ] = False,
    fresh: Fresh = False,
    cluster: Cluster = "",
) -> None:
    """Generate, track, score and report; the same call again goes on where it stopped.

    A tracker that fails costs its own row; the exit status is then 1.
    """
    from simbench.experiments.request import Request, parse_seeds

    request = Request(
        scenarios_from(scenarios, frames),
        trackers_from(trackers),
        parse_seeds(seeds),
        repetitions,
        timeout,
    )
    console = Console()
    outcome = execute_request(
        console,
        request,
        out,
        jobs=jobs,
        cluster=cluster,
        keep_sequences=keep_sequences,
        fresh=fresh,
    )
    console.print(score_table(outcome.scores))
    conclude(console, outcome)


def execute_request(
    console: Console,
    request: Request,
    out: Path | None,
    *,
    jobs: int | None,
    cluster: str,
    fresh: bool,
    keep_sequences: bool = False,
) -> RunResult:
    """Do a request and show how far it is; see `run_experiment`."""
    from simbench.experiments.run import run_experiment
    from simbench.runtime.versions import core_count

    with (
        interruptible("the same command goes on from here"),
        progress_bar(console) as progress,
    ):
        return run_experiment(
            request,
            out or _RUNS / request.folder_name,
            command=shlex.join(["simbench", *sys.argv[1:]]),
            jobs=jobs or core_count(),
            cluster=cluster,
            keep_sequences=keep_sequences,
            fresh=fresh,
            progress=progress,
        )


def conclude(console: Console, outcome: RunResult) -> NoReturn:
    """Say what failed and where the report is, and leave with exit status 0 or 1."""
    for failure in outcome.failures:
        console.print(
            f"failed: {failure}",
            style="red",
            highlight=False,
            markup=False,
            soft_wrap=True,
        )
    console.print(f"report: {outcome.report}", highlight=False, soft_wrap=True)
    raise typer.Exit(1 if outcome.failures else 0)


def report(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
) -> None:
    """Write a run's report anew; pictures that are gone are filmed again."""
    from simbench.experiments.rebuild_report import rebuild_report

    console = Console()
    with (
        interruptible("nothing was changed"),
        progress_bar(console) as progress,
    ):
        path = rebuild_report(run_folder, progress)
    console.print(f"report: {path}", highlight=False, soft_wrap=True)
