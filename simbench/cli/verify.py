"""The command ``verify``: generate sequences again and compare them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs
from simbench.cli.display import print_line, progress_bar

if TYPE_CHECKING:
    from simbench.verification.difference import VerificationResult

__all__ = ["verify"]

_MOST_LINES = 20


def verify(
    place: Annotated[
        str,
        typer.Argument(metavar="DIR|RUN", help="Sequences, data set (or URL), or run."),
    ],
    jobs: Jobs = None,
    sample: Annotated[
        int | None,
        typer.Option(min=1, help="Only so many sequences, evenly spaced."),
    ] = None,
) -> None:
    """Generate recorded sequences again and compare; exit 1 if anything differs.

    Trajectories, truth, ids (instance masks) and frames are compared separately, in
    new processes; a difference is reported with its first frame and its size. Images,
    depth and tables are compared decoded, value by value, other files byte by byte.
    The machine and versions that made a sequence are printed, but not compared. The
    index and the list of files of a data set are always compared whole.
    """
    from simbench.runtime.versions import core_count
    from simbench.verification.compare_dataset import compare_dataset
    from simbench.verification.verify import find_recorded_sequences
    from simbench.verification.verify import verify as verify_all

    console = Console()
    sequences, total = find_recorded_sequences(place, sample)
    with progress_bar(console, "nothing was changed", "verify") as progress:
        progress(0.0, len(sequences), "comparing the index")
        index = compare_dataset(place)
        results = verify_all(sequences, jobs=jobs or core_count(), progress=progress)
    of_index = [] if index is None else [index]
    shown = [r for r in results if not r.is_same or len(results) <= _MOST_LINES]
    for result in [*shown, *of_index]:
        print_line(console, str(result), None if result.is_same else "red")
    _print_summary(console, results, total)
    for result in of_index:
        if not result.is_same:
            print_line(console, f"{result.name}: not as made", "red")
    raise typer.Exit(0 if all(one.is_same for one in [*results, *of_index]) else 1)


def _print_summary(
    console: Console, results: list[VerificationResult], total: int
) -> None:
    changes = {
        (name, *versions)
        for result in results
        for name, versions in result.environment_changes.items()
    }
    for name, then, now in sorted(changes):
        print_line(console, f"made with {name} {then or '?'}, here is {now or '?'}")
    same = sum(result.is_same for result in results)
    count = f"{len(results)} of {total}" if len(results) < total else f"{total}"
    print_line(console, f"{count} verified: {same} identical")
