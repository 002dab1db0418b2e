"""The proof that a result can be had again: ``verify``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs
from simbench.cli.display import interruptible, progress_bar

if TYPE_CHECKING:
    from simbench.verification.compare_sequences import VerificationResult

__all__ = ["verify"]

_ENOUGH_LINES = 20


def verify(
    place: Annotated[
        str,
        typer.Argument(metavar="DIR|RUN", help="Sequences, data set (or URL), or run."),
    ],
    jobs: Jobs = None,
    sample: Annotated[
        int | None,
        typer.Option(min=1, help="Only so many sequences, evenly spread."),
    ] = None,
) -> None:
    """Make recorded sequences anew and compare; exit 1 unless all holds the same.

    Trajectories, truth, ids (instance masks) and frames are compared apart, in fresh
    processes, and what differs is said with its first frame and how much. Pictures,
    depth, tables and arrays are compared decoded, value by value, other files byte by
    byte; what says which machine made it is printed and does not count. Of a data set
    the index and the list of files are compared whole, whatever the sample.
    """
    from simbench.runtime.versions import core_count
    from simbench.verification.compare_dataset import compare_whole
    from simbench.verification.verify import find_targets_to_verify
    from simbench.verification.verify import verify as verify_all

    console = Console()
    subjects, total = find_targets_to_verify(place, sample)
    with (
        interruptible("nothing was changed"),
        progress_bar(console) as progress,
    ):
        progress(0.0, len(subjects), "comparing the index")
        whole = compare_whole(place)
        findings = verify_all(subjects, jobs=jobs or core_count(), progress=progress)
    for finding in findings:
        if not finding.is_same or len(findings) <= _ENOUGH_LINES:
            _print(console, finding)
    if whole is not None:
        _print(console, whole)
    _conclude(console, findings, total)
    if whole is not None and not whole.is_same:
        console.print(f"{whole.name}: not as made", style="red", highlight=False)
    found = [*findings, *([] if whole is None else [whole])]
    raise typer.Exit(0 if all(finding.is_same for finding in found) else 1)


def _print(console: Console, finding: VerificationResult) -> None:
    style = None if finding.is_same else "red"
    console.print(str(finding), style=style, highlight=False, soft_wrap=True)


def _conclude(console: Console, findings: list[VerificationResult], of: int) -> None:
    elsewhere = {
        (name, *pair)
        for finding in findings
        for name, pair in finding.elsewhere.items()
    }
    for name, there, here in sorted(elsewhere):
        line = f"made with {name} {there or '?'}, here is {here or '?'}"
        console.print(line, highlight=False, soft_wrap=True)
    same = sum(finding.is_same for finding in findings)
    count = f"{len(findings)} of {of}" if len(findings) < of else f"{of}"
    console.print(f"{count} verified: {same} identical", highlight=False)
