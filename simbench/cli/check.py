"""The regression gate: ``check``."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs, tracker_specs, trackers_from
from simbench.cli.display import (
    interruptible,
    print_table,
    progress_bar,
    score_table,
)
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.evaluation.baseline import Baseline
    from simbench.evaluation.scores import Scores
    from simbench.experiments.regression_suite import Suite

__all__ = ["check"]


def check(
    baseline: Annotated[
        Path, typer.Option(dir_okay=False, help="File with the suite and its numbers.")
    ],
    update: Annotated[
        bool, typer.Option("--update", help="Write what this version reaches.")
    ] = False,
    reason: Annotated[str, typer.Option(help="Why, for --update.")] = "",
    junit: Annotated[
        Path | None, typer.Option(dir_okay=False, help="JUnit XML to write.")
    ] = None,
    trackers: Annotated[
        str, typer.Option(help="Only these, as for run: LABEL=NAME@PARAM=VALUE,...")
    ] = "",
    jobs: Jobs = None,
) -> None:
    """Run the suite in a baseline file and exit 1 if precision, success or usage fell.

    With --update, write the numbers of this version instead; a file that is not there
    yet gets the default suite. With --trackers too, those of others stay as they are.
    """
    from simbench.evaluation.baseline import Baseline
    from simbench.experiments.regression_suite import DEFAULT_SUITE, Suite

    console = Console()
    if update and not reason.strip():
        raise SimbenchError('--update wants --reason "why the numbers change"')
    known = Baseline.read(baseline) if baseline.exists() or not update else None
    suite = Suite.from_settings(known.settings) if known else DEFAULT_SUITE
    asked = replace(suite, trackers=tracker_specs(trackers)) if trackers else suite
    if known is not None and not update:
        if trackers:
            known = _of_trackers(known, trackers)
        if not known.rows:
            of = f" of {trackers}" if trackers else ""
            raise SimbenchError(f"{baseline}: must have at least one row{of}, has none")
    scores = _run(asked, jobs, console)
    if update:
        settled = suite.with_trackers(asked.trackers) if known else asked
        earlier = known if trackers else None
        _update(baseline, earlier, settled, scores, reason, console)
    elif known is not None:
        _compare(known, scores, junit, console)


def _of_trackers(baseline: Baseline, trackers: str) -> Baseline:
    """Return the baseline with the rows of these trackers only."""
    labels = {spec.label for spec in trackers_from(trackers)}
    rows = [row for row in baseline.rows if row.tracker in labels]
    return replace(baseline, rows=rows)


def _run(suite: Suite, jobs: int | None, console: Console) -> Scores:
    from simbench.experiments.grid import run_grid
    from simbench.experiments.run_folder import RunFolder
    from simbench.runtime.versions import core_count

    request = suite.request()
    with (
        tempfile.TemporaryDirectory(prefix="simbench-check-") as folder,
        interruptible("nothing was written"),
        progress_bar(console) as progress,
    ):
        scores, sequences = run_grid(
            request,
            RunFolder(Path(folder)),
            jobs=jobs or core_count(),
            progress=progress,
        )
    if not sequences:  # not one: no version of a tracker is to blame for that
        raise SimbenchError(str(scores.runs["reason"].iloc[0]))
    return scores


def _update(
    path: Path,
    earlier: Baseline | None,
    suite: Suite,
    scores: Scores,
    reason: str,
    console: Console,
) -> None:
    """Write a baseline of the suite: new rows of scores, others as they were."""
    from simbench.evaluation.baseline import Baseline
    from simbench.runtime.versions import versions

    made = Baseline.from_scores(
        scores, reason=reason, versions=versions(), settings=suite.to_settings()
    )
    if earlier is not None:
        made = made.with_rows_of(earlier)
    made.write(path)
    console.print(score_table(scores))
    console.print(f"baseline: {path}", highlight=False, soft_wrap=True)


def _compare(
    baseline: Baseline, scores: Scores, junit: Path | None, console: Console
) -> None:
    from simbench.evaluation.regression import (
        TABLE_HEADINGS,
        compare,
        table_rows,
        write_junit,
    )

    checks = compare(baseline, scores)
    print_table(console, TABLE_HEADINGS, table_rows(checks))
    if junit is not None:
        write_junit(junit, checks)
    failed = [found for found in checks if not found.passed]
    for found in failed:
        console.print(found.message, style="red", highlight=False, soft_wrap=True)
    console.print(f"{len(failed)} of {len(checks)} checks failed", highlight=False)
    raise typer.Exit(1 if failed else 0)
