"""The output of commands with ``--json``: one document on stdout, and nothing else.

The keys of each document are described in ``docs/json.md``. Numbers that are not finite
are null. What a program prints while the command works, as a tracker of the user may,
goes to stderr.
"""

from __future__ import annotations

import contextlib
import json
import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TextIO

import typer

from simbench import __version__
from simbench.core.text import printable

if TYPE_CHECKING:
    from simbench.evaluation.gate.regression import Check
    from simbench.experiments.run import RunResult
    from simbench.runtime.doctor import Diagnosis

__all__ = ["VERSIONS", "Json", "check_facts", "doctor_facts", "run_facts", "write_json"]

VERSIONS: Final[Mapping[str, int]] = {
    "list": 1,
    "run": 1,
    "evaluate": 1,
    "doctor": 1,
    "check": 2,
    "compare": 1,
}
"""Version of each command's document: it grows when a key changes or goes."""

_stdout: ContextVar[TextIO | None] = ContextVar("stdout", default=None)


def _reserve(context: typer.Context, is_json: bool) -> bool:
    """Keep stdout for the document until the command ends."""
    if is_json and not context.resilient_parsing:
        context.with_resource(_reserved_stdout())
    return is_json


Json = Annotated[
    bool,
    typer.Option(
        "--json",
        callback=_reserve,
        help="Print one JSON document, and nothing else, on stdout.",
    ),
]


def write_json(command: str, facts: Mapping[str, Any]) -> None:
    """Print the document of a command, whose ``--json`` was given.

    Parameters
    ----------
    command : str
        One of `VERSIONS`.
    facts : mapping
        Plain data; what comes first names the document and its version.
    """
    head = {"document": f"simbench {command}", "version": VERSIONS[command]}
    content = _plain({**head, "simbench": __version__, **facts})
    text = json.dumps(content, indent=2, allow_nan=False)
    print(text, file=_stdout.get() or sys.stdout)


def run_facts(result: RunResult) -> dict[str, Any]:
    """Return what ``run`` and ``evaluate`` print: means, failures, and the report."""
    from simbench.cli.display import SCORE_COLUMNS
    from simbench.evaluation.statistics.instance_statistics import summary

    means = summary(result.scores.runs, list(SCORE_COLUMNS))
    keys = ("scenario", "variant", "tracker")
    return {
        "scores": [
            {key: row[key] for key in keys}
            | {measure: row[f"{measure}.mean"] for measure in SCORE_COLUMNS}
            | {"instances": row["seeds"], "intervals": _intervals(row)}
            for _, row in means.iterrows()
        ],
        "failures": result.failures,
        "report": str(result.report),
    }


def _intervals(row: Any) -> dict[str, Any]:
    """Return the interval and range of each measure; no interval for few instances."""
    from simbench.cli.display import SCORE_COLUMNS

    return {
        measure: {
            part: row[f"{measure}.{part}"] for part in ("low", "high", "min", "max")
        }
        for measure in SCORE_COLUMNS
    }


def check_facts(
    checks: Iterable[Check],
    changed: Mapping[str, tuple[str, str]],
    videos: Mapping[str, Path],
) -> dict[str, Any]:
    """Return what ``check`` prints: every comparison, and how many failed."""
    listed = list(checks)
    names = ("scenario", "variant", "tracker", "measure", "baseline", "current", "p")
    return {
        "checks": [
            {name: getattr(check, name) for name in (*names, "pairs", "verdict")}
            | {"passed": check.passed, "message": check.message}
            for check in listed
        ],
        "failed": sum(not check.passed for check in listed),
        "environment": {
            name: {"baseline": before, "current": now}
            for name, (before, now) in changed.items()
        },
        "videos": {tracker: str(path) for tracker, path in videos.items()},
    }


def doctor_facts(findings: Iterable[Diagnosis]) -> dict[str, Any]:
    """Return what ``doctor`` prints: the state of each part, and its repair."""
    return {
        "findings": [
            {"name": f.name, "state": f.state, "found": f.found, "remedy": f.remedy}
            for f in findings
        ]
    }


@contextlib.contextmanager
def _reserved_stdout() -> Iterator[None]:
    token = _stdout.set(sys.stdout)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        _stdout.reset(token)


def _plain(value: Any) -> Any:
    """Return a value for JSON: printable text, plain numbers, null for NaN."""
    if isinstance(value, Mapping):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, str):
        return printable(value, lines=True)
    value = value.item() if hasattr(value, "item") else value  # numpy's numbers
    return None if isinstance(value, float) and not math.isfinite(value) else value
