"""The command ``reproduce``: the tables and claims of a paper beside measured ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs, Out, prepare_workers
from simbench.cli.display import print_line, print_table, progress_bar
from simbench.cli.names import require_name
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.experiments.papers.reproduce import Reproduction

__all__ = ["reproduce"]

PAPERS = ("dpf", "dsp", "nbrf")
_RUNS = Path("results") / "runs"


def reproduce(
    paper: Annotated[
        str,
        typer.Argument(
            metavar="|".join(PAPERS),
            help="Directional particle filter, dynamic swarm particle, or "
            "neural-Bayesian resampling filter.",
            autocompletion=lambda: list(PAPERS),
        ),
    ],
    seeds: Annotated[
        str | None,
        typer.Option(
            help="Half-open range 0:20, or numbers; 20 decide a claim. "
            "Default: 0:20, with --quick 0:2."
        ),
    ] = None,
    out: Out = None,
    jobs: Jobs = None,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Short films and few trackers: does it run?"),
    ] = False,
    only: Annotated[
        str,
        typer.Option(
            metavar="PARTS",
            help="Parts of the experiments, with commas: of dsp levels, slow, pure.",
        ),
    ] = "",
    keep_sequences: Annotated[
        bool, typer.Option("--keep-sequences", help="Keep the films.")
    ] = False,
    notes: Annotated[
        Path | None, typer.Option(help="Markdown file for the end of the page.")
    ] = None,
) -> None:
    """Run the experiments of a paper; judge its claims by tests; write its page.

    The published tables stand beside the measured ones, in the paper's setting and in
    ours. The same command resumes a stopped run.
    """
    require_name("paper", paper, PAPERS)
    text = _read(notes)
    prepare_workers(jobs, "")

    from simbench.experiments.papers.reproduce import reproduce as run
    from simbench.experiments.request import parse_seeds
    from simbench.runtime.versions import core_count

    seeds = seeds or ("0:2" if quick else "0:20")
    command = f"simbench reproduce {paper} --seeds {seeds}"
    command += f" --only {only}" if only else ""
    console = Console()
    with progress_bar(console, "the same command resumes it") as progress:
        found = run(
            paper,
            parse_seeds(seeds),
            out or _RUNS / (f"{paper}-quick" if quick else paper),
            command=command + (" --quick" if quick else ""),
            jobs=core_count() if jobs is None else jobs,
            quick=quick,
            only=list(filter(None, map(str.strip, only.split(",")))),
            keep_sequences=keep_sequences,
            notes=text,
            progress=progress,
        )
    _show(console, found)


def _show(console: Console, found: Reproduction) -> None:
    """Print claims and verdicts, what failed, and where the page is."""
    from simbench.experiments.papers.page import claim_rows
    from simbench.experiments.papers.settings import SETTINGS

    headings = ("", "claim", "in the paper", *SETTINGS)
    print_table(console, headings, claim_rows(found.stated, found.claims))
    for failure in found.result.failures:
        print_line(console, f"failed: {failure}", "red")
    print_line(console, f"page: {found.page}")
    raise typer.Exit(1 if found.result.failures else 0)


def _read(notes: Path | None) -> str:
    if notes is None:
        return ""
    try:
        return notes.read_text(encoding="utf-8")
    except (OSError, UnicodeError) as error:
        raise SimbenchError(
            f"--notes: {notes}: expected a Markdown file in UTF-8, got none: {error}"
        ) from None
