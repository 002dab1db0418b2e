"""Regression gate: comparison of the scores of this version with a baseline.

Precision and success fail if they fall by more than the tolerance of
`simbench.evaluation.baseline`; particle usage fails if it changes by more in either
direction, since it is the cost of those scores.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal
from xml.etree import ElementTree

import pandas as pd

from simbench.core.atomic_write import atomic_write
from simbench.core.text import printable
from simbench.evaluation.baseline import (
    MEASURES,
    USAGE,
    Baseline,
    BaselineRow,
    baseline_rows,
)
from simbench.evaluation.scores import Scores

__all__ = [
    "TABLE_HEADINGS",
    "Baseline",
    "Check",
    "Verdict",
    "compare",
    "table_rows",
    "write_junit",
]

TABLE_HEADINGS: Final = (
    "scenario",
    "tracker",
    "measure",
    "baseline",
    "tolerance",
    "now",
    "verdict",
)

_ROUND_OFF: Final = 1e-9  # 0.90 - 0.88 is a little more than 0.02

Verdict = Literal["ok", "better", "worse", "changed", "missing", "new"]


@dataclass(frozen=True, slots=True)
class Check:
    """One number compared with the baseline.

    Attributes
    ----------
    scenario, variant, tracker, measure : str
        What is compared. The measure is ``run`` if the check is about the whole row.
    baseline, current, tolerance : float
        NaN for a check about the whole row.
    verdict : str
        ``worse``, ``changed`` (particle usage or the sequences) and ``missing`` fail;
        ``ok``, ``better`` and ``new`` (not in the baseline) pass.
    message : str
        One line for the user.
    """

    scenario: str
    variant: str
    tracker: str
    measure: str
    baseline: float
    current: float
    tolerance: float
    verdict: Verdict
    message: str

    @property
    def passed(self) -> bool:
        """Whether the verdict is no failure of the gate."""
        return self.verdict in ("ok", "better", "new")


def compare(baseline: Baseline, scores: Scores) -> list[Check]:
    """Compare scores with a baseline.

    Parameters
    ----------
    baseline : Baseline
    scores : Scores
        Of the same suite. Failed runs count with their scores.

    Returns
    -------
    list of Check
        For each row of the baseline one check per measure, or a single one if the row
        is missing or its seeds or sequences differ, and one more if a run failed; then
        one for each row that the baseline lacks.
    """
    current = {row.name: row for row in baseline_rows(scores.runs)}
    failures = _failures(scores.runs)
    checks: list[Check] = []
    for row in baseline.rows:
        if row.name in failures:
            checks.append(_row_check(row, "worse", failures[row.name]))
        checks.extend(_checks(row, current.pop(row.name, None)))
    added = [_row_check(row, "new", "not in the baseline") for row in current.values()]
    return checks + added


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
            classname=printable(f"{suite}.{_scenario(check)}"),
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


def table_rows(checks: Iterable[Check]) -> list[tuple[str, ...]]:
    """Return checks as text, one row each, with the columns of `TABLE_HEADINGS`."""
    return [
        (
            _scenario(check),
            check.tracker,
            check.measure,
            *(
                _number(check.measure, value)
                for value in (check.baseline, check.tolerance, check.current)
            ),
            check.verdict,
        )
        for check in checks
    ]


def _checks(row: BaselineRow, current: BaselineRow | None) -> Iterator[Check]:
    if current is None:
        yield _row_check(row, "missing", "in the baseline, but was not run")
    elif current.seeds != row.seeds:
        reason = f"expected runs on seeds {row.seeds}, got {current.seeds}"
        yield _row_check(row, "missing", reason)
    elif any(
        new and old != new  # without a digest where the run failed
        for old, new in zip(row.digests, current.digests, strict=True)
    ):
        reason = "sequences are not those of the baseline: digests differ"
        yield _row_check(row, "changed", reason)
    else:
        for measure in MEASURES:
            yield _measure_check(row, current, measure)


def _failures(runs: pd.DataFrame) -> dict[tuple[str, str, str], str]:
    """Return the first failure of each scenario, variant and tracker, as a message."""
    messages: dict[tuple[str, str, str], str] = {}
    for run in runs[runs["status"] != "ok"].itertuples():
        name = (str(run.scenario), str(run.variant), str(run.tracker))
        messages.setdefault(name, f"failed on seed {run.seed}: {run.reason}")
    return messages


def _measure_check(row: BaselineRow, current: BaselineRow, measure: str) -> Check:
    tolerance = row.tolerance(measure)
    old, new = row.mean[measure], current.mean[measure]
    verdict = _verdict(measure, new - old, tolerance)
    message = (
        f"{_label(row)}: {measure} was {_number(measure, old)} "
        f"+- {_number(measure, tolerance)}, is {_number(measure, new)}"
    )
    return Check(*row.name, measure, old, new, tolerance, verdict, message)


def _verdict(measure: str, difference: float, tolerance: float) -> Verdict:
    if abs(difference) <= tolerance + _ROUND_OFF:
        return "ok"
    if measure == USAGE:
        return "changed"
    return "better" if difference > tolerance else "worse"  # NaN counts as worse


def _row_check(row: BaselineRow, verdict: Verdict, message: str) -> Check:
    nan = float("nan")
    text = f"{_label(row)}: {message}"
    return Check(*row.name, "run", nan, nan, nan, verdict, text)


def _label(row: BaselineRow) -> str:
    return " / ".join(filter(None, row.name))


def _scenario(check: Check) -> str:
    return "/".join(filter(None, (check.scenario, check.variant)))


def _number(measure: str, value: float) -> str:
    if math.isnan(value):
        return "-"
    return f"{value:.1f}" if measure == USAGE else f"{value:.3f}"
