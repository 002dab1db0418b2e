"""The command ``check``: compare the scores of a suite with a baseline."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from rich.console import Console

from simbench.cli.arguments import (
    Jobs,
    prepare_workers,
    tracker_specs,
    trackers_from,
)
from simbench.cli.display import print_line, print_table, progress_bar, score_table
from simbench.cli.json_output import Json, check_facts, write_json
from simbench.core.atomic_write import atomic_write
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.evaluation.gate.baseline import Baseline
    from simbench.evaluation.gate.regression import Check
    from simbench.experiments.regression_suite import Suite
    from simbench.experiments.run_suite import SuiteResult

__all__ = ["check"]

_STEP_SUMMARY: Final = "GITHUB_STEP_SUMMARY"


def check(
    suite: Annotated[
        Path | None,
        typer.Argument(
            metavar="[SUITE.yaml]",
            help="Scenarios, seeds, trackers, repetitions; default: the baseline's.",
        ),
    ] = None,
    baseline: Annotated[
        Path | None,
        typer.Option(
            dir_okay=False,
            help="The expected scores; default: SUITE.baseline.json.",
        ),
    ] = None,
    update: Annotated[
        bool, typer.Option("--update", help="Write the scores of this version.")
    ] = False,
    reason: Annotated[str, typer.Option(help="Why scores change, for --update.")] = "",
    junit: Annotated[
        Path | None, typer.Option(dir_okay=False, help="JUnit XML to write.")
    ] = None,
    summary: Annotated[
        Path | None,
        typer.Option(
            dir_okay=False,
            help="Markdown to write; in GitHub's actions the step summary too.",
        ),
    ] = None,
    videos: Annotated[
        Path | None,
        typer.Option(
            file_okay=False,
            help="Folder for a video of the worst frames of each tracker that failed.",
        ),
    ] = None,
    trackers: Annotated[
        str,
        typer.Option(
            help="Only these, as for run; LABEL=OTHER tries another in LABEL's place."
        ),
    ] = "",
    films: Annotated[
        Path | None,
        typer.Option(
            file_okay=False,
            help="Store of films between calls; default: in the user's cache.",
        ),
    ] = None,
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
    """Run a suite and exit 1 if precision, success or usage is worse than its baseline.

    In the environment of the baseline equal tracks pass at once; else paired tests
    decide. With --update, write the scores of this version instead; a new file gets the
    suite given, or the default one. With --trackers too, the scores of other trackers
    are kept.
    """
    if update and as_json:
        raise SimbenchError("--json prints a comparison, and --update makes none")
    if update and not reason.strip():
        raise SimbenchError('--update needs --reason "why the scores change"')
    prepare_workers(jobs, "")
    from simbench.evaluation.gate.baseline import Baseline

    path = _baseline_path(suite, baseline)
    known = Baseline.read(path) if path.exists() or not update else None
    whole = _suite(suite, path, known, update=update, allow_modules=allow_modules)
    requested = whole.only(tracker_specs(trackers)) if trackers else whole
    if known is not None and not update:
        known = _of_trackers(known, path, trackers)
    console = Console()
    from simbench.experiments.film_store import film_store
    from simbench.experiments.run_suite import run_suite
    from simbench.runtime.versions import core_count

    with film_store(films) as store:
        with progress_bar(console, "nothing was written", "check") as progress:
            result = run_suite(
                requested,
                store,
                jobs=core_count() if jobs is None else jobs,
                progress=progress,
            )
        if not update and known is not None:
            shown = None if as_json else console
            _compare(known, result, junit, summary, videos, shown)
    _update(
        path,
        known if trackers else None,
        whole.with_trackers(requested.trackers) if known else requested,
        result,
        reason,
        console,
    )


def _baseline_path(suite: Path | None, baseline: Path | None) -> Path:
    if baseline is not None:
        return baseline
    if suite is None:
        raise SimbenchError(
            "check: expected SUITE.yaml or --baseline FILE, got neither"
        )
    return suite.with_suffix(".baseline.json")


def _suite(
    path: Path | None,
    baseline: Path,
    known: Baseline | None,
    *,
    update: bool,
    allow_modules: bool,
) -> Suite:
    """Return the suite of the file, else of the baseline, else the default one.

    Raises
    ------
    SimbenchError
        If the baseline is of another suite than the file describes.
    """
    from simbench.experiments.regression_suite import DEFAULT_SUITE, Suite

    if path is None:
        if known is None:
            return DEFAULT_SUITE
        return Suite.from_settings(known.settings, allow_modules=allow_modules)
    found = Suite.from_yaml(path)
    if known is not None and not update:
        before = Suite.from_settings(known.settings, allow_modules=True).to_settings()
        now = found.to_settings()
        if other := [name for name in now if now[name] != before[name]]:
            raise SimbenchError(
                f"{path}: expected the {other[0]} of {baseline}, got others: "
                '--update --reason "..." makes a new baseline'
            )
    return found


def _of_trackers(known: Baseline, path: Path, trackers: str) -> Baseline:
    """Return the rows of the trackers requested, all if none is.

    Raises
    ------
    SimbenchError
        If there is none.
    """
    rows = known.rows
    if trackers:
        labels = [spec.label for spec in trackers_from(trackers)]
        there = {row.tracker for row in rows}
        unknown = [label for label in labels if label not in there]
        if unknown and there:
            listed = ", ".join(sorted(there))
            raise SimbenchError(
                f"--trackers: {unknown[0]}: expected a label of {path} ({listed}): "
                f"write LABEL={unknown[0]} to try it in the place of one"
            )
        rows = [row for row in rows if row.tracker in labels]
    if not rows:
        of = f" of {trackers}" if trackers else ""
        raise SimbenchError(f"{path}: expected at least one row{of}, got none")
    return replace(known, rows=rows)


def _update(
    path: Path,
    earlier: Baseline | None,
    suite: Suite,
    result: SuiteResult,
    reason: str,
    console: Console,
) -> None:
    """Write a baseline of the suite: rows of the scores, and other earlier rows."""
    from simbench.evaluation.gate.baseline import Baseline

    made = Baseline.from_scores(
        result.scores,
        reason=reason,
        versions=result.environment,
        settings=suite.to_settings(),
        codes=result.codes,
    )
    if earlier is not None:
        made = made.with_rows_of(earlier)
    made.write(path)
    console.print(score_table(result.scores))
    print_line(console, f"baseline: {path}")


def _compare(
    baseline: Baseline,
    result: SuiteResult,
    junit: Path | None,
    summary: Path | None,
    videos: Path | None,
    console: Console | None,
) -> None:
    """Print the comparison, as JSON without a console, and exit with status 0 or 1."""
    from simbench.evaluation.gate import gate_report, regression
    from simbench.experiments.run_suite import write_worst_frames

    checks = regression.compare(
        baseline, result.scores, versions=result.environment, codes=result.codes
    )
    changed = regression.environment_changes(baseline.versions, result.environment)
    failed = [one for one in checks if not one.passed]
    shown: dict[str, Path] = {}
    if videos is not None and failed:
        shown = write_worst_frames(baseline, result, checks, videos)
    if junit is not None:
        gate_report.write_junit(junit, checks)
    _write_summary(gate_report.markdown_summary(checks, changed, shown), summary)
    if console is None:
        write_json("check", check_facts(checks, changed, shown))
    else:
        _print(console, checks, changed, shown)
    raise typer.Exit(1 if failed else 0)


def _write_summary(text: str, path: Path | None) -> None:
    if path is not None:
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    if step := os.environ.get(_STEP_SUMMARY):
        try:
            with Path(step).open("a", encoding="utf-8") as file:
                file.write(text)
        except OSError:  # a convenience never fails the gate
            return


def _print(
    console: Console,
    checks: list[Check],
    changed: Mapping[str, tuple[str, str]],
    videos: Mapping[str, Path],
) -> None:
    from simbench.evaluation.gate.gate_report import TABLE_HEADINGS, table_rows

    if changed:
        names = ", ".join(changed)
        print_line(console, f"another environment than the baseline's: {names}")
    print_table(console, TABLE_HEADINGS, table_rows(checks))
    for one in checks:
        if one.measure == "tracks" and one.verdict == "ok":
            print_line(console, one.message, "yellow")
    failed = [one for one in checks if not one.passed]
    for one in failed:
        print_line(console, one.message, "red")
    for path in videos.values():
        print_line(console, f"worst frames: {path}")
    print_line(console, f"{len(failed)} of {len(checks)} checks failed")
