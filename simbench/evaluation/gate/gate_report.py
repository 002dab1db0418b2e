"""What the regression gate writes: table, JUnit XML, and a summary in markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from simbench.core.atomic_write import atomic_write
from simbench.core.text import printable
from simbench.evaluation.gate.baseline_rows import USAGE
from simbench.evaluation.gate.regression import Check

__all__ = ["TABLE_HEADINGS", "markdown_summary", "table_rows", "write_junit"]

TABLE_HEADINGS: Final = (
    "scenario",
    "tracker",
    "measure",
    "baseline",
    "now",
    "p",
    "pairs",
    "verdict",
)


def table_rows(checks: Iterable[Check]) -> list[tuple[str, ...]]:
    """Return checks as text, one row each, with the columns of `TABLE_HEADINGS`."""
    return [
        (
            check.place,
            check.tracker,
            check.measure,
            _number(check.measure, check.baseline),
            _number(check.measure, check.current),
            "-" if math.isnan(check.p) else f"{check.p:.2g}",
            str(check.pairs or "-"),
            check.verdict,
        )
        for check in checks
    ]


def write_junit(
    path: Path, checks: Iterable[Check], *, suite: str = "simbench"
) -> None:
    """Write checks as JUnit XML, atomically, with one test case per check.

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    listed = list(checks)
    root = ElementTree.Element(
        "testsuite",
        name=printable(suite),
        tests=str(len(listed)),
        failures=str(sum(not check.passed for check in listed)),
        errors="0",
    )
    for check in listed:
        case = ElementTree.SubElement(
            root,
            "testcase",
            classname=printable(f"{suite}.{check.place}"),
            name=printable(f"{check.tracker}: {check.measure}"),
        )
        if not check.passed:
            ElementTree.SubElement(
                case, "failure", type=check.verdict, message=printable(check.message)
            )
        elif check.verdict != "ok":
            ElementTree.SubElement(case, "system-out").text = printable(check.message)
    ElementTree.indent(root)
    document = ElementTree.ElementTree(root)
    with atomic_write(path) as temporary:
        document.write(temporary, encoding="utf-8", xml_declaration=True)


def markdown_summary(
    checks: Iterable[Check],
    changed: Mapping[str, tuple[str, str]],
    videos: Mapping[str, Path] | None = None,
) -> str:
    """Return the result of the gate as markdown, as for a step summary of GitHub.

    Parameters
    ----------
    checks : iterable of Check
    changed : mapping from str to (str, str)
        What differs from the environment of the baseline, before and now.
    videos : mapping from tracker to Path, optional
        Videos of the worst frames.
    """
    listed = list(checks)
    failed = [check for check in listed if not check.passed]
    title = "failed" if failed else "passed"
    lines = [f"## simbench check: {title}", ""]
    lines.append(f"{len(failed)} of {len(listed)} checks failed.")
    if changed:
        what = ", ".join(
            f"{name} {a or '-'} → {b or '-'}" for name, (a, b) in changed.items()
        )
        lines += ["", f"Compared by tests: the environment is another ({_cell(what)})."]
    else:
        lines += ["", "The environment is that of the baseline."]
    if failed:
        lines += ["", *(f"- **{_cell(check.message)}**" for check in failed)]
    told = [one for one in listed if one.measure == "tracks" and one.verdict == "ok"]
    lines += ["", *(f"- {_cell(check.message)}" for check in told)] if told else []
    for tracker, path in (videos or {}).items():
        lines.append(f"- worst frames of {_cell(tracker)}: `{_cell(str(path))}`")
    heads = " | ".join(TABLE_HEADINGS)
    rule = " | ".join("---" for _ in TABLE_HEADINGS)
    lines += ["", f"| {heads} |", f"| {rule} |"]
    lines += [f"| {' | '.join(map(_cell, row))} |" for row in table_rows(listed)]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    """Return text that stays in its cell: no line break, bar or markup."""
    plain = printable(text).replace("\\", "\\\\").replace("|", "\\|")
    return plain.replace("<", "&lt;").replace("*", "\\*").replace("`", "'")


def _number(measure: str, value: float) -> str:
    if math.isnan(value):
        return "-"
    return f"{value:.1f}" if measure == USAGE else f"{value:.3f}"
