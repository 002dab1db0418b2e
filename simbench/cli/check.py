"""The command ``check``: compare the scores of a suite with a baseline."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs, tracker_specs, trackers_from
from simbench.cli.display import print_line, print_table, progress_bar, score_table
from simbench.cli.json_output import Json, check_facts, write_json
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.evaluation.baseline import Baseline
    from simbench.evaluation.scores import Scores
    from simbench.experiments.regression_suite import Suite

__all__ = ["check"]


def check(
    baseline: Annotated[
        Path, typer.Option(dir_okay=False, help="The suite and its expected scores.")
    ],
    update: Annotated[
        bool, typer.Option("--update", help="Write the scores of this version.")
    ] = False,
    reason: Annotated[str, typer.Option(help="Why scores change, for --update.")] = "",
    junit: Annotated[
        Path | None, typer.Option(dir_okay=False, help="JUnit XML to write.")
    ] = None,
    trackers: Annotated[
        str, typer.Option(help="Only these, as for run: LABEL=NAME@PARAM=VALUE,...")
    ] = "",
    allow_modules: Annotated[
        bool,
        typer.Option(
            "--allow-modules",
            help="Import whatever module a tracker in the baseline names.",
        ),
    ] = False,
    jobs: Jobs = None,
    as_json: Json = False,
) -> None:
    """Run the suite in a baseline file and exit 1 if precision, success or usage fell.

    With --update, write the scores of this version instead; a new file gets the default
    suite. With --trackers too, the scores of other trackers are kept.
    """
    from simbench.evaluation.baseline import Baseline
    from simbench.experiments.regression_suite import DEFAULT_SUITE, Suite

    console = Console()
    if update and as_json:
        raise SimbenchError("--json prints a comparison, and --update makes none")
    if update and not reason.strip():
        raise SimbenchError('--update needs --reason "why the scores change"')
    known = Baseline.read(baseline) if baseline.exists() or not update else None
    suite = DEFAULT_SUITE
    if known:
        suite = Suite.from_settings(known.settings, allow_modules=allow_modules)
    requested = replace(suite, trackers=tracker_specs(trackers)) if trackers else suite
    if known is not None and not update:
        if trackers:
            labels = {spec.label for spec in trackers_from(trackers)}
            rows = [row for row in known.rows if row.tracker in labels]
            known = replace(known, rows=rows)
        if not known.rows:
            of = f" of {trackers}" if trackers else ""
            raise SimbenchError(f"{baseline}: expected at least one row{of}, got none")
    scores = _run(requested, jobs, console)
    if update:
        new_suite = suite.with_trackers(requested.trackers) if known else requested
        earlier = known if trackers else None
        _update(baseline, earlier, new_suite, scores, reason, console)
    elif known is not None:
        _compare(known, scores, junit, None if as_json else console)


def _run(suite: Suite, jobs: int | None, console: Console) -> Scores:
    from simbench.experiments.grid import run_request
    from simbench.experiments.run_folder import RunFolder
    from simbench.runtime.scratch import scratch_folder
    from simbench.runtime.versions import core_count

    with (
        scratch_folder("check-") as folder,
        progress_bar(console, "nothing was written", "check") as progress,
    ):
        scores, sequences = run_request(
            suite.request(),
            RunFolder(Path(folder)),
            jobs=core_count() if jobs is None else jobs,
            progress=progress,
        )
    if not sequences:  # no tracker ran, so no tracker got worse
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
    """Write a baseline of the suite: rows of the scores, and other earlier rows."""
    from simbench.evaluation.baseline import Baseline
    from simbench.runtime.versions import versions

    made = Baseline.from_scores(
        scores, reason=reason, versions=versions(), settings=suite.to_settings()
    )
    if earlier is not None:
        made = made.with_rows_of(earlier)
    made.write(path)
    console.print(score_table(scores))
    print_line(console, f"baseline: {path}")


def _compare(
    baseline: Baseline, scores: Scores, junit: Path | None, console: Console | None
) -> None:
    """Print the comparison, as JSON without a console, and exit with status 0 or 1."""
    from simbench.evaluation import regression

    checks = regression.compare(baseline, scores)
    if junit is not None:
        regression.write_junit(junit, checks)
    failed = [one for one in checks if not one.passed]
    if console is None:
        write_json("check", check_facts(checks))
        raise typer.Exit(1 if failed else 0)
    print_table(console, regression.TABLE_HEADINGS, regression.table_rows(checks))
    for one in failed:
        print_line(console, one.message, "red")
    print_line(console, f"{len(failed)} of {len(checks)} checks failed")
    raise typer.Exit(1 if failed else 0)
