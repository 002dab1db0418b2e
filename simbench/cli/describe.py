"""Commands that only tell: ``list``, ``doctor`` and ``schema``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.display import print_table

__all__ = ["doctor", "list_all", "schema"]

_MARKS = {"ok": "ok     ", "missing": "MISSING", "absent": "absent "}


def list_all() -> None:
    """List the scenarios with what they test, and the trackers."""
    from simbench.scenarios.files.loading import library, load_scenario, variants_of
    from simbench.trackers.find_tracker import available_trackers

    console = Console()
    scenarios = [load_scenario(name) for name in library()]
    rows = []
    for s in scenarios:
        names = [s.name, *(f"  @{variant}" for variant in variants_of(s.name))]
        rows.append(("\n".join(names), str(s.frames), s.tests))
    print_table(console, ("scenario", "frames", "what it tests"), rows)
    print_table(console, ("tracker", "what it is"), available_trackers().items())


def doctor() -> None:
    """Say what is installed, what is wrong, and which command mends it."""
    from simbench.runtime.doctor import examine

    console = Console()
    findings = examine()
    for finding in findings:
        mark = _MARKS[finding.state]
        console.print(
            f"{mark} {finding.name}: {finding.found}", highlight=False, soft_wrap=True
        )
        if finding.remedy:
            console.print(
                f"        mend it with: {finding.remedy}",
                highlight=False,
                soft_wrap=True,
            )
    raise typer.Exit(2 if any(f.state == "missing" for f in findings) else 0)


def schema(
    out: Annotated[
        Path | None, typer.Option(dir_okay=False, help="File to write to.")
    ] = None,
) -> None:
    """Print the JSON Schema of scenario files, for editors that complete YAML."""
    from simbench.core.atomic_write import atomic_write
    from simbench.core.errors import DatasetError
    from simbench.scenarios.files.loading import scenario_schema

    text = json.dumps(scenario_schema(), indent=2) + "\n"
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        with atomic_write(out) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DatasetError(f"{out}: cannot be written: {error.strerror}") from None
    typer.echo(str(out))
