"""Baseline of the regression gate: every score of every run, and what made them.

A row holds the scores of one tracker on one scenario by seed and repetition, with the
digests of the films and of the tracks. On the machine that made it the same code gives
the same to the bit. Elsewhere float rounding sends a particle filter on another course,
so there the scores are compared by tests, see `simbench.evaluation.gate.regression`.
"""

from __future__ import annotations

import dataclasses
import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import pydantic

from simbench.core.atomic_write import atomic_write
from simbench.core.bounded_read import parse_json, read_regular
from simbench.core.errors import DatasetError
from simbench.evaluation.gate.baseline_rows import (
    BaselineRow,
    Name,
    baseline_rows,
    row_fault,
)
from simbench.evaluation.scores import Scores

__all__ = ["Baseline", "validation_line"]

_LARGEST_FILE: Final = 8 * 2**20
_MOST_ROWS: Final = 5000


@dataclass(frozen=True, slots=True)
class Baseline:
    """The scores that those of later versions are compared with.

    Attributes
    ----------
    reason : str
        Why these numbers replaced the previous ones.
    versions : mapping from str to str
        The environment: Python, simbench, its dependencies, the processor's
        instructions, and ``opengl``.
    settings : mapping
        Settings of the run, as plain data: enough to repeat it.
    rows : list of BaselineRow
        In order of scenario and tracker.
    """

    reason: Name
    versions: dict[str, str]
    settings: dict[str, Any]
    rows: Annotated[list[BaselineRow], pydantic.Field(max_length=_MOST_ROWS)]

    @classmethod
    def from_scores(
        cls,
        scores: Scores,
        *,
        reason: str,
        versions: Mapping[str, str],
        settings: Mapping[str, Any],
        codes: Mapping[str, str] | None = None,
    ) -> Baseline:
        """Make a baseline from runs, all of which must have status ``ok``.

        Raises
        ------
        DatasetError
            If no reason is given, a run failed, a row has other repetitions on one
            seed than on another, or a measure has no value.
        """
        if not reason.strip():
            raise DatasetError("baseline: expected a reason, got none")
        failed = scores.runs[scores.runs["status"] != "ok"]
        if len(failed):
            run = failed.iloc[0]
            raise DatasetError(
                f"baseline: expected runs without failure, got {run['tracker']} on "
                f"{run['scenario']}, seed {run['seed']}: {run['reason']}"
            )
        rows = baseline_rows(scores, codes)
        for row in rows:
            if fault := row_fault(row):
                where = f"{row.tracker} on {row.scenario}"
                raise DatasetError(f"baseline: {where}: expected {fault}")
        return cls(reason.strip(), dict(versions), dict(settings), rows)

    @classmethod
    def read(cls, path: Path) -> Baseline:
        """Read a baseline that `write` wrote.

        Raises
        ------
        DatasetError
            If it is no regular file, not JSON, or not a baseline, a row is inconsistent
            or twice there, or a number is out of range.
        """
        try:
            content = read_regular(path, _LARGEST_FILE)
        except DatasetError as error:
            reason = str(error).removeprefix(f"{path}: ")
            raise DatasetError(f"{path}: baseline {reason}") from error
        try:
            plain = parse_json(content, path)
            _refuse_earlier_version(plain, path)
            baseline = pydantic.TypeAdapter(cls).validate_python(plain)
        except pydantic.ValidationError as error:
            raise DatasetError(f"{path}: {validation_line(error)}") from error
        for row in baseline.rows:
            if fault := row_fault(row):
                where = f"{row.tracker} on {row.scenario}"
                raise DatasetError(f"{path}: {where}: expected {fault}")
        names = Counter(row.name for row in baseline.rows)
        for (scenario, variant, tracker), count in names.items():
            if count > 1:
                where = " / ".join(filter(None, (scenario, variant, tracker)))
                raise DatasetError(
                    f"{path}: {where}: expected one row, got {count} of that name"
                )
        return baseline

    def with_rows_of(self, earlier: Baseline) -> Baseline:
        """Return this baseline plus the rows that only an earlier one has.

        Reason and versions are those of this baseline.
        """
        rows = {row.name: row for row in (*earlier.rows, *self.rows)}
        scenarios = list(dict.fromkeys(name[:2] for name in rows))
        ordered = sorted(rows, key=lambda name: scenarios.index(name[:2]))
        return dataclasses.replace(self, rows=[rows[name] for name in ordered])

    def write(self, path: Path) -> None:
        """Write the baseline as JSON, atomically, a line for each fact of a row.

        Raises
        ------
        DatasetError
            If the file cannot be written.
        """
        content = dataclasses.asdict(self)
        rows = ",\n".join(_in_lines(row, 4) for row in content.pop("rows"))
        head = json.dumps(content, indent=2, allow_nan=False)
        text = f'{head.removesuffix("}").rstrip()},\n  "rows": [\n{rows}\n  ]\n}}\n'
        with atomic_write(path) as temporary:
            temporary.write_text(text)


def validation_line(error: pydantic.ValidationError, *key: str) -> str:
    """Return the first validation error of JSON in one line: key, expected, got."""
    first = error.errors(include_url=False)[0]
    place = ".".join([*key, *map(str, first["loc"])])[:200] or "the file"
    value = first["input"]
    is_shown = not isinstance(value, dict | list) and first["type"] != "missing"
    text = first["msg"].replace("Input should be", "expected")
    return f"{place}: {text}" + (f", got {value!r:.60}" if is_shown else "")


def _refuse_earlier_version(plain: Any, path: Path) -> None:
    """Refuse a baseline of version 0.2, which has means only, and say what to do."""
    rows = plain.get("rows") if isinstance(plain, dict) else None
    if not (isinstance(rows, list) and rows and isinstance(rows[0], dict)):
        return
    if "digests" in rows[0] and "values" not in rows[0]:
        raise DatasetError(
            f"{path}: expected scores by seed and repetition, got the means of "
            "simbench 0.2: remove the file and make it anew with --update"
        )


def _in_lines(row: Mapping[str, Any], indent: int) -> str:
    """Return a row as JSON, a line for each key, for each measure and for each seed."""
    margin = " " * indent
    parts = []
    for key, value in row.items():
        if key in ("values", "mean", "sd"):
            lines = [
                f"{margin}    {json.dumps(name)}: {json.dumps(one, allow_nan=False)}"
                for name, one in value.items()
            ]
            text = "{\n" + ",\n".join(lines) + f"\n{margin}  }}"
        else:
            text = json.dumps(value, allow_nan=False)
        parts.append(f"{margin}  {json.dumps(key)}: {text}")
    return f"{margin}{{\n" + ",\n".join(parts) + f"\n{margin}}}"
