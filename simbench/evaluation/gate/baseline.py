"""Baseline of the regression gate: every score of every run, and what made them.

A row holds the scores of one tracker on one scenario by seed and repetition, with the
digests of the films and of the tracks. On the machine that made it the same code gives
the same to the bit. Elsewhere float rounding sends a particle filter on another course,
so there the scores are compared by tests, see `simbench.evaluation.gate.regression`.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pydantic
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.bounded_read import parse_json, read_regular
from simbench.core.errors import DatasetError
from simbench.evaluation.gate.track_digests import track_digests
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.instance_statistics import GROUP

__all__ = [
    "MEASURES",
    "MOST_REPETITIONS",
    "MOST_SEEDS",
    "USAGE",
    "Baseline",
    "BaselineRow",
    "Seed",
    "baseline_rows",
    "validation_line",
]

USAGE: Final = "particles_mean"
MEASURES: Final = ("precision_20", "success_50", "success_auc", USAGE)

MOST_SEEDS: Final = 1000
"""Most seeds of a row."""
MOST_REPETITIONS: Final = 1000
"""Most runs of a row on one seed."""
_LARGEST_SEED: Final = 999_999_999  # as on the command line
_LARGEST_FILE: Final = 8 * 2**20
_MOST_ROWS: Final = 5000
_MOST_PARTICLES: Final = 1e9
_ROUND_OFF: Final = 1e-9


Name = Annotated[str, pydantic.Field(max_length=1000)]
Seed = Annotated[int, pydantic.Field(strict=True, ge=0, le=_LARGEST_SEED)]
Digest = Annotated[str, pydantic.Field(min_length=1, max_length=200)]
Value = Annotated[float, pydantic.Field(strict=True, ge=0, le=_MOST_PARTICLES)]
Runs = Annotated[list[Value], pydantic.Field(max_length=MOST_REPETITIONS)]
Tracks = Annotated[list[Digest], pydantic.Field(max_length=MOST_REPETITIONS)]


@dataclass(frozen=True, slots=True)
class BaselineRow:
    """Scores of one tracker on one scenario when the baseline was made.

    Attributes
    ----------
    scenario, variant, tracker : str
    seeds : list of int
        In ascending order.
    digests : list of str
        Digest of the film of each seed.
    values : mapping from measure to list of list of float
        By seed and repetition, for each of `MEASURES`; as many repetitions on each
        seed.
    tracks : list of list of str
        Digest of each track, see `simbench.evaluation.gate.track_digests`.
    mean, sd : mapping from measure to float
        Over all runs, for readers of the file; checked against the values. The
        deviation (n - 1) of a single run is 0.
    code : str
        Digest of the tracker's code; empty where unknown.
    """

    scenario: Name
    variant: Name
    tracker: Name
    seeds: Annotated[list[Seed], pydantic.Field(max_length=MOST_SEEDS)]
    digests: Annotated[list[Digest], pydantic.Field(max_length=MOST_SEEDS)]
    values: dict[str, Annotated[list[Runs], pydantic.Field(max_length=MOST_SEEDS)]]
    tracks: Annotated[list[Tracks], pydantic.Field(max_length=MOST_SEEDS)]
    mean: dict[str, Value]
    sd: dict[str, Value]
    code: Name = ""

    @property
    def name(self) -> tuple[str, str, str]:
        """Scenario, variant and tracker."""
        return self.scenario, self.variant, self.tracker

    @property
    def repetitions(self) -> int:
        """Runs on each seed."""
        return len(self.tracks[0])

    def table(self, measure: str) -> NDArray[np.float64]:
        """Return the scores, (seeds, repetitions) float."""
        return np.array(self.values[measure], dtype=np.float64)


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
            if fault := _fault(row):
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
            if fault := _fault(row):
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


def baseline_rows(
    scores: Scores, codes: Mapping[str, str] | None = None
) -> list[BaselineRow]:
    """Return runs as rows of a baseline, by scenario, variant and tracker.

    Parameters
    ----------
    scores : Scores
    codes : mapping from label to str, optional
        Digests of the trackers' code.

    Returns
    -------
    list of BaselineRow
        In order of appearance. A measure without a value is NaN, the digest of a run
        without frames is empty.
    """
    runs = scores.runs.assign(track=track_digests(scores))
    rows = []
    for name, of_row in runs.groupby(list(GROUP), sort=False):
        by_seed = of_row.sort_values("repetition").groupby("seed")
        values = {
            measure: [group[measure].tolist() for _, group in by_seed]
            for measure in MEASURES
        }
        scenario, variant, tracker = map(str, name)
        digests = by_seed["digest"].max()
        row = BaselineRow(
            scenario,
            variant,
            tracker,
            seeds=digests.index.astype(int).tolist(),
            digests=digests.tolist(),
            values=values,
            tracks=[group["track"].tolist() for _, group in by_seed],
            mean={measure: _mean_and_sd(of)[0] for measure, of in values.items()},
            sd={measure: _mean_and_sd(of)[1] for measure, of in values.items()},
            code=(codes or {}).get(tracker, ""),
        )
        rows.append(row)
    return rows


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


def _mean_and_sd(values: list[list[float]]) -> tuple[float, float]:
    known = np.array([one for runs in values for one in runs], dtype=np.float64)
    sd = known.std(ddof=1) if len(known) > 1 else 0.0
    return float(known.mean()), float(sd)


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


def _fault(row: BaselineRow) -> str:
    """Return what a row lacks, empty if it is consistent."""
    count = len(row.seeds)
    if not row.seeds:
        return "at least one seed, got none"
    if any(one >= other for one, other in pairwise(row.seeds)):
        return "seeds in ascending order, each once, got others"
    if len(row.digests) != count:
        return f"a digest for each of {count} seeds, got {len(row.digests)}"
    if not all(row.digests):
        return "a digest of each film, got none"
    if len(row.tracks) != count or not row.tracks[0]:
        return f"digests of tracks for each of {count} seeds, got {len(row.tracks)}"
    for name in MEASURES:
        if name not in row.values.keys() & row.mean.keys() & row.sd.keys():
            return f"{name}, got none"
        if fault := _fault_of_values(row, name):
            return fault
    if {len(runs) for runs in row.tracks} != {row.repetitions}:
        return "as many tracks as scores on each seed, got others"
    return ""


def _fault_of_values(row: BaselineRow, name: str) -> str:
    values = row.values[name]
    if len(values) != len(row.seeds):
        return f"{name} for each of {len(row.seeds)} seeds, got {len(values)}"
    lengths = {len(runs) for runs in values}
    if lengths != {row.repetitions}:
        return f"{name} of {row.repetitions} runs on each seed, got {sorted(lengths)}"
    known = row.table(name)
    if not np.isfinite(known).all():
        return f"{name} of every run, got none"
    if name != USAGE and known.max() > 1.0:
        return f"{name} of at most 1, got {known.max():g}"
    for part, found, right in zip(
        ("mean", "sd"), (row.mean, row.sd), _mean_and_sd(values), strict=True
    ):
        if not math.isclose(found[name], right, rel_tol=1e-6, abs_tol=_ROUND_OFF):
            return f"the {part} {right:.6g} of its {name}, got {found[name]:g}"
    return ""
