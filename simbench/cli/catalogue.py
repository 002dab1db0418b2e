"""The command ``catalogue``: a page with images of scenarios and what they test."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs
from simbench.cli.display import print_line, progress_bar

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
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sequences.")] = 0,
    jobs: Jobs = None,
) -> None:
    """Write a page with images of scenarios, what they test and achieved dials.

    The page names scenarios that cannot be sampled or rendered; the exit status is then
    1.
    """
    from simbench.report.catalogue.entry import EntryRequest
    from simbench.report.catalogue.make import make_entries
    from simbench.report.catalogue.page import write_catalogue
    from simbench.runtime.versions import core_count
    from simbench.scenarios.files.library import list_scenarios
    from simbench.scenarios.files.loading import expand_variants, variants_of

    names = [
        one for name in scenarios or list_scenarios() for one in expand_variants(name)
    ]
    requests = [EntryRequest.from_source(name, seed) for name in names]
    variants = [
        [] if request.content.get("variant") else variants_of(request.source)
        for request in requests
    ]
    frames = sum(request.frames for request in requests)
    console = Console()
    with progress_bar(console, "nothing was written", "catalogue", frames) as progress:
        entries = make_entries(requests, jobs=jobs or core_count(), progress=progress)
        write_catalogue(entries, variants, out)
    for entry in entries:
        if entry.problem:
            print_line(console, f"failed: {entry.problem}", "red")
    print_line(console, str(out))
    raise typer.Exit(1 if any(entry.problem for entry in entries) else 0)
