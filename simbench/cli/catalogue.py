"""The command ``catalogue``: what scenarios look like and what they test."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs
from simbench.cli.display import interruptible, progress_bar

__all__ = ["catalogue"]


def catalogue(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENARIO...]",
            help="Names, NAME@VARIANT, NAME@all or YAML files; default: the library.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(dir_okay=False, help="HTML file to write.")
    ] = Path("catalogue.html"),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the pictures.")] = 0,
    jobs: Jobs = None,
) -> None:
    """Write a page with pictures of scenarios, what they test and what they reach.

    A scenario that cannot be drawn or filmed says so on the page; the exit status is
    then 1.
    """
    from simbench.report.catalogue.entry import EntryRequest
    from simbench.report.catalogue.make import make_entries
    from simbench.report.catalogue.page import write_catalogue
    from simbench.runtime.versions import core_count
    from simbench.scenarios.files.loading import library, names_of, variants_of

    names = [one for name in scenarios or library() for one in names_of(name)]
    wishes = [EntryRequest.drawn(name, seed) for name in names]
    others = [[] if w.content.get("variant") else variants_of(w.source) for w in wishes]
    console = Console()
    with (
        interruptible("nothing was written"),
        progress_bar(console) as progress,
    ):
        entries = make_entries(wishes, jobs=jobs or core_count(), progress=progress)
        write_catalogue(entries, others, out)
    for entry in entries:
        if entry.problem:
            console.print(f"failed: {entry.problem}", style="red", highlight=False)
    console.print(str(out), highlight=False, soft_wrap=True)
    raise typer.Exit(1 if any(entry.problem for entry in entries) else 0)
