"""The regression gate: whether this version is worse than that of the baseline.

Precision and success fail where they fall by more than the tolerance of
`simbench.evaluation.baseline`; particle usage fails where it moves by more in either
direction, since it is the cost side of what is claimed.
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
from simbench.core.errors import DatasetError
from simbench.evaluation.baseline import (
    MEASURES,
    USAGE,
    Baseline,
    BaselineRow,
    summarised,
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
    """One number held against the baseline.

    Attributes
    ----------
    scenario, variant, tracker, measure : str
        What is compared. The measure is ``run`` where the row itself is at fault.
    baseline, current, tolerance : float
        NaN where there is none.
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
        """Whether the gate lets this through."""
        return self.verdict in ("ok", "better", "new")


def compare(baseline: Baseline, scores: Scores) -> list[Check]:
    """Hold scores against a baseline.

    Parameters
    ----------
    baseline : Baseline
    scores : Scores
        Of the same suite. Failed runs count with what they scored.

    Returns
    -------
    list of Check
        For each row of the baseline one check for each measure, or a single one where
        the row is missing or its seeds or sequences are others, and one more where a
        run failed; then one for each row that the baseline lacks.
    """
    now = {row.name: row for row in summarised(scores.runs)}
    faults = _faults(scores.runs)
    checks: list[Check] = []
    for row in baseline.rows:
        if (fault := faults.get(row.name)) is not None:
            checks.append(_row_check(row, "worse", fault))
        checks.extend(_checks(row, now.get(row.name)))
    known = {row.name for row in baseline.rows}
    added = [row for name, row in now.items() if name not in known]
    return checks + [_row_check(row, "new", "not in the baseline") for row in added]


def write_junit(
    path: Path, checks: Iterable[Check], *, suite: str = "simbench"
) -> None:
    """Write checks as JUnit XML, whole: a test case each, named after what it checks.

    Raises
    ------
    DatasetError
        If the place cannot be written to.
    """
    listed = list(checks)
    root = ElementTree.Element(
        "testsuite",
        name=suite,
        tests=str(len(listed)),
        failures=str(sum(not check.passed for check in listed)),
        errors="0",
    )
    for check in listed:
        scenario = "/".join(filter(None, (check.scenario, check.variant)))
        case = ElementTree.SubElement(
            root,
            "testcase",
            classname=f"{suite}.{scenario}",
            name=f"{check.tracker}: {check.measure}",
        )
        if not check.passed:
            ElementTree.SubElement(
                case, "failure", type=check.verdict, message=_printable(check.message)
            )
        elif check.verdict != "ok":
            ElementTree.SubElement(case, "system-out").text = _printable(check.message)
    ElementTree.indent(root)
    try:
        with atomic_write(path) as partial:
            ElementTree.ElementTree(root).write(
                partial, encoding="utf-8", xml_declaration=True
            )
    except OSError as error:
        raise DatasetError(f"{path}: cannot be written: {error.strerror}") from error


def table_rows(checks: Iterable[Check]) -> list[tuple[str, ...]]:
    """Return checks as text, a row each, under the headings of `TABLE_HEADINGS`."""
    return [
        (
            "/".join(filter(None, (check.scenario, check.variant))),
            check.tracker,
            check.measure,
            _number(check.measure, check.baseline),
            _number(check.measure, check.tolerance),
            _number(check.measure, check.current),
            check.verdict,
        )
        for check in checks
    ]


def _checks(before: BaselineRow, now: BaselineRow | None) -> Iterator[Check]:
    if now is None:
        yield _row_check(before, "missing", "in the baseline, but was not run")
    elif now.seeds != before.seeds:
        yield _row_check(
            before, "missing", f"must be run on seeds {before.seeds}, got {now.seeds}"
        )
    elif _is_other(before.digests, now.digests):
        yield _row_check(
            before, "changed", "sequences are not those of the baseline: other digests"
        )
    else:
        for measure in MEASURES:
            yield _measure_check(before, now, measure)


def _is_other(before: list[str], now: list[str]) -> bool:
    """Return whether a known digest differs from a known digest."""
    return any(
        was and is_now and was != is_now
        for was, is_now in zip(before, now, strict=True)
    )


def _faults(runs: pd.DataFrame) -> dict[tuple[str, str, str], str]:
    """Return what to say of the rows of which a run failed."""
    failed = runs[runs["status"] != "ok"]
    said: dict[tuple[str, str, str], str] = {}
    for run in failed.itertuples():
        name = (str(run.scenario), str(run.variant), str(run.tracker))
        said.setdefault(name, f"failed on seed {run.seed}: {run.reason}")
    return said


def _measure_check(before: BaselineRow, now: BaselineRow, measure: str) -> Check:
    tolerance = before.tolerance(measure)
    was, is_now = before.mean[measure], now.mean[measure]
    verdict = _verdict(measure, is_now - was, tolerance)
    message = (
        f"{_place(before)}: {measure} was {_number(measure, was)} "
        f"+- {_number(measure, tolerance)}, is {_number(measure, is_now)}"
    )
    return Check(*before.name, measure, was, is_now, tolerance, verdict, message)


def _verdict(measure: str, difference: float, tolerance: float) -> Verdict:
    if abs(difference) <= tolerance + _ROUND_OFF:
        return "ok"
    if measure == USAGE:
        return "changed"
    return "better" if difference > tolerance else "worse"  # NaN is worse


def _row_check(row: BaselineRow, verdict: Verdict, message: str) -> Check:
    nan = float("nan")
    text = f"{_place(row)}: {message}"
    return Check(*row.name, "run", nan, nan, nan, verdict, text)


def _printable(text: str) -> str:
    """Drop what XML cannot hold: a tracker's own words may carry escape codes."""
    return "".join(letter for letter in text if letter.isprintable())


def _place(row: BaselineRow) -> str:
    return " / ".join(filter(None, row.name))


def _number(measure: str, value: float) -> str:
    if math.isnan(value):
        return "-"
    return f"{value:.1f}" if measure == USAGE else f"{value:.3f}"
