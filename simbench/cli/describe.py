"""The commands ``list``, ``doctor`` and ``schema``, which only print."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.display import print_line, print_table

__all__ = ["doctor", "list_all", "schema"]

_MARKS = {"ok": "ok     ", "missing": "MISSING", "absent": "absent "}


def list_all() -> None:
    """List the scenarios with what they test, and the trackers."""
    from simbench.scenarios.files.library import scenario_summaries
    from simbench.trackers.find_tracker import list_trackers

    console = Console()
    rows = [
        ("\n".join([s.name, *(f"  @{v}" for v in s.variants)]), str(s.frames), s.tests)
        for s in scenario_summaries()
    ]
    print_table(console, ("scenario", "frames", "what it tests"), rows)
    print_table(console, ("tracker", "description"), list_trackers().items())


def doctor() -> None:
    """Print what is installed, what is missing, and which command repairs it."""
    from simbench.runtime.doctor import examine

    console = Console()
    findings = examine()
    for finding in findings:
        mark = _MARKS[finding.state]
        print_line(console, f"{mark} {finding.name}: {finding.found}")
        if finding.remedy:
            print_line(console, f"        repair with: {finding.remedy}")
    raise typer.Exit(2 if any(f.state == "missing" for f in findings) else 0)


def schema(
    out: Annotated[
        Path | None, typer.Option(dir_okay=False, help="File to write to.")
    ] = None,
) -> None:
    """Print the JSON Schema of scenario files, for editors that complete YAML."""
    from simbench.core.atomic_write import atomic_write
    from simbench.scenarios.files.loading import scenario_schema

    text = json.dumps(scenario_schema(), indent=2) + "\n"
    if out is None:
        typer.echo(text, nl=False)
        return
    with atomic_write(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    typer.echo(str(out))
