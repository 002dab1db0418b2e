"""The command ``sweep``: vary one or two dials and keep all else the same."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import (
    Cluster,
    Frames,
    Jobs,
    Memory,
    Out,
    Repetitions,
    Replace,
    Seeds,
    Timeout,
    Trackers,
    prepare_workers,
    scenarios_from,
    trackers_from,
)
from simbench.cli.display import print_line, print_table
from simbench.cli.names import (
    complete_dial,
    complete_scenario,
    dial_names,
    require_name,
)
from simbench.cli.run import DEFAULT_TRACKERS, execute_request, finish, run_folder

if TYPE_CHECKING:
    from simbench.evaluation.statistics.sweep_scores import SweepScores
    from simbench.experiments.request import Request
    from simbench.experiments.run import RunResult

__all__ = ["sweep"]


def sweep(
    scenario: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            help="Name from 'simbench list', or YAML file.",
            autocompletion=complete_scenario,
        ),
    ],
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="DIAL=VALUES",
            help="FIRST:LAST:STEP with both ends, or VALUE,VALUE,...; twice for a map. "
            "Dials are in 'simbench list dials'.",
            autocompletion=complete_dial,
        ),
    ],
    trackers: Trackers = DEFAULT_TRACKERS,
    seeds: Seeds = "0:3",
    repetitions: Repetitions = 1,
    frames: Frames = None,
    out: Out = None,
    jobs: Jobs = None,
    timeout: Timeout = 300.0,
    memory_mb: Memory = 4096,
    replace: Replace = False,
    cluster: Cluster = "",
    refine: Annotated[
        int,
        typer.Option(
            min=0,
            max=6,
            help="How often the step in which success falls to one half is halved.",
        ),
    ] = 2,
) -> None:
    """Vary one or two dials of a scenario and find where each tracker breaks.

    Values that cannot be reached are left out and named; they fail no sweep.
    """
    for one in vary:
        if "=" in one:
            require_name("--vary", one.partition("=")[0].strip(), dial_names())
    prepare_workers(jobs, cluster)
    # before the heavy imports: a mistake in the file is reported at once
    found = scenarios_from([scenario], frames)

    from simbench.experiments.refine_sweep import refined_run
    from simbench.experiments.request import parse_seeds, sweep_request

    request = sweep_request(
        found,
        vary,
        trackers_from(trackers),
        parse_seeds(seeds),
        repetitions,
        timeout,
        memory_mb,
    )
    console = Console()
    folder = out or run_folder(request)
    rerun = replace

    def run(part: Request) -> RunResult:
        nonlocal rerun
        found = execute_request(
            console, part, folder, jobs=jobs, cluster=cluster, replace=rerun
        )
        rerun = False  # the refined values go beside the first
        return found

    result = refined_run(found[0], request, run, refine)
    if result.swept is not None:
        _print(console, result.swept)
    finish(console, result)


def _print(console: Console, swept: SweepScores) -> None:
    """Print scores by dial value, values that were not reached, and breaking points."""
    from simbench.report.sweep_text import breaking_table, notes, point_table

    print_table(console, *point_table(swept))
    for note in notes(swept):
        print_line(console, note, "yellow")
    print_table(console, *breaking_table(swept))
