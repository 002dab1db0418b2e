"""The commands ``list``, ``doctor`` and ``schema``, which only print."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from rich.console import Console

from simbench.cli.display import print_line, print_table
from simbench.cli.json_output import Json, doctor_facts, write_json
from simbench.cli.names import require_name

if TYPE_CHECKING:
    from simbench.runtime.doctor import Diagnosis

__all__ = ["doctor", "list_all", "schema"]

_MARKS = {"ok": "ok     ", "missing": "MISSING", "absent": "absent "}


def list_all(
    topic: Annotated[
        str,
        typer.Argument(
            metavar="[scenarios|trackers|dials|formats]",
            help="Which of them; default: scenarios and trackers.",
            autocompletion=lambda: list(_TOPICS),
        ),
    ] = "",
    as_json: Json = False,
) -> None:
    """List scenarios with what they test, trackers, dials, or data set formats."""
    if topic:
        require_name("list", topic, tuple(_TOPICS))
    topics = [topic] if topic else ["scenarios", "trackers"]
    if as_json:
        write_json("list", {name: _TOPICS[name]() for name in topics})
        return
    console = Console()
    for name in topics:
        print_table(console, _HEADINGS[name], map(_cells, _TOPICS[name]()))


def _cells(row: dict[str, Any]) -> list[str]:
    """Return the values of a row as text, variants below their name.

    The sequences of papers that a scenario mirrors follow what it tests.
    """
    name, *rest = [row[key] for key in row if key not in ("variants", "mirrors")]
    variants = [f"  @{one}" for one in row.get("variants", ())]
    cells = ["\n".join([name, *variants]), *map(str, rest)]
    if mirrors := row.get("mirrors"):
        cells[-1] += f" (mirrors {', '.join(mirrors)})"
    return cells


def _scenarios() -> list[dict[str, Any]]:
    from simbench.scenarios.files.library import scenario_summaries

    return [summary._asdict() for summary in scenario_summaries()]


def _trackers() -> list[dict[str, Any]]:
    from simbench.trackers.find_tracker import list_trackers

    return [{"name": n, "description": text} for n, text in list_trackers().items()]


def _dials() -> list[dict[str, Any]]:
    from simbench.scenarios.schema.dial_facts import dial_facts

    return [fact._asdict() for fact in dial_facts()]


def _formats() -> list[dict[str, Any]]:
    from simbench.datasets.formats import FORMATS, SPLITS, find_format
    from simbench.datasets.formats.files import SplitLayout

    rows = []
    for name in FORMATS:
        layout = find_format(name)
        splits = ", ".join(SPLITS) if isinstance(layout, SplitLayout) else ""
        text = (type(layout).__doc__ or "").splitlines()[0]
        description = text.replace("; see the module.", ".").replace("`", "")
        rows.append({"name": name, "splits": splits, "description": description})
    return rows


_TOPICS: Final[dict[str, Callable[[], list[dict[str, Any]]]]] = {
    "scenarios": _scenarios,
    "trackers": _trackers,
    "dials": _dials,
    "formats": _formats,
}
_HEADINGS: Final = {
    "scenarios": ("scenario", "frames", "what it tests"),
    "trackers": ("tracker", "description"),
    "dials": ("dial", "unit", "values", "what it does"),
    "formats": ("format", "splits", "what it is"),
}


def doctor(as_json: Json = False) -> None:
    """Print what is installed, what is missing, and which command repairs it."""
    from simbench.runtime.doctor import examine

    findings = examine()
    if as_json:
        write_json("doctor", doctor_facts(findings))
    else:
        _print_findings(findings)
    raise typer.Exit(2 if any(f.state == "missing" for f in findings) else 0)


def _print_findings(findings: list[Diagnosis]) -> None:
    console = Console()
    for finding in findings:
        mark = _MARKS[finding.state]
        print_line(console, f"{mark} {finding.name}: {finding.found}")
        if finding.remedy:
            print_line(console, f"        repair with: {finding.remedy}")


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
    print_line(Console(), str(out))
