"""The main command, ``run``, and ``report``, which draws up its results anew."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import (
    Frames,
    Jobs,
    Names,
    Seeds,
    scenarios_from,
    trackers_from,
)
from simbench.cli.display import interruptible, progress_bar, score_table

__all__ = ["report", "run"]

RUNS = Path("results") / "runs"
DEFAULT_TRACKERS = "condensation,directional-45,dsp,still"


def run(
    scenarios: Names,
    trackers: Annotated[
        str,
        typer.Option(help="Names between commas; in full LABEL=NAME@PARAM=VALUE."),
    ] = DEFAULT_TRACKERS,
    seeds: Seeds = "0:3",
    repetitions: Annotated[
        int, typer.Option(min=1, help="Runs of each tracker on the same sequence.")
    ] = 1,
    frames: Frames = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Run folder; default: one in results/runs for this request."),
    ] = None,
    jobs: Jobs = None,
    timeout: Annotated[
        float, typer.Option(help="Seconds one tracker may take over one sequence.")
    ] = 300.0,
    keep_sequences: Annotated[
        bool, typer.Option("--keep-sequences", help="Leave the pictures in the folder.")
    ] = False,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Do again what is done already.")
    ] = False,
) -> None:
    """Generate, track, score and report; the same call again goes on where it stopped.

    A tracker that fails costs its own row; the exit status is then 1.
    """
    from simbench.environment import core_count
    from simbench.running.request import Request, parse_seeds
    from simbench.running.whole_run import whole_run

    request = Request(
        scenarios_from(scenarios, frames),
        trackers_from(trackers),
        parse_seeds(seeds),
        repetitions,
        timeout,
    )
    folder = out or RUNS / request.folder_name
    console = Console()
    with (
        interruptible("the same command goes on from here"),
        progress_bar(console) as progress,
    ):
        outcome = whole_run(
            request,
            folder,
            command=shlex.join(["simbench", *sys.argv[1:]]),
            jobs=jobs or core_count(),
            keep_sequences=keep_sequences,
            fresh=fresh,
            progress=progress,
        )
    console.print(score_table(outcome.scores))
    for failure in outcome.failures:
        console.print(
            f"failed: {failure}", style="red", highlight=False, soft_wrap=True
        )
    console.print(f"report: {outcome.report}", highlight=False, soft_wrap=True)
    raise typer.Exit(1 if outcome.failures else 0)


def report(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
) -> None:
    """Write a run's report anew; pictures that are gone are filmed again."""
    from simbench.running.report_again import report_again

    console = Console()
    with (
        interruptible("nothing was changed"),
        progress_bar(console) as progress,
    ):
        path = report_again(run_folder, progress)
    console.print(f"report: {path}", highlight=False, soft_wrap=True)
