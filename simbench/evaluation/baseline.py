"""Baseline of the regression gate: mean and spread of the scores, and their reason.

The tolerance is derived from the spread over seeds. On one machine the same code gives
bit-identical numbers. On another, float rounding may change one resampling step, after
which a particle filter takes another course: for the mean over n seeds that is like new
samples of the tracker on the same sequences, whose spread is at most that over seeds,
``sd``. The difference of two such means has a standard deviation of at most
``sqrt(2) sd / sqrt(n)``; the tolerance is about twice that, ``3 sd / sqrt(n)``, plus a
minimum for seeds that happen to agree: 0.02 for shares, 2 % for particle usage.
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

import pandas as pd
import pydantic

from simbench.core.atomic_write import atomic_write
from simbench.core.bounded_read import parse_json, read_regular
from simbench.core.errors import DatasetError
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics import GROUP, seed_means, spread

__all__ = [
    "MEASURES",
    "MOST_SEEDS",
    "USAGE",
    "Baseline",
    "BaselineRow",
    "Seed",
    "baseline_rows",
    "validation_line",
]

USAGE: Final = "particles_mean"
MEASURES: Final = ("precision_20", "success_50", USAGE)

MOST_SEEDS: Final = 1000
"""Most seeds of a row."""
_LARGEST_SEED: Final = 999_999_999  # as on the command line
_LARGEST_FILE: Final = 8 * 2**20
_MOST_ROWS: Final = 5000
_MOST_PARTICLES: Final = 1e9
_STANDARD_ERRORS: Final = 3.0
_MIN_SHARE_TOLERANCE: Final = 0.02
_MIN_USAGE_TOLERANCE: Final = 0.02  # of the baseline


Name = Annotated[str, pydantic.Field(max_length=1000)]
Seed = Annotated[int, pydantic.Field(strict=True, ge=0, le=_LARGEST_SEED)]
Digest = Annotated[str, pydantic.Field(min_length=1, max_length=200)]
Value = Annotated[float, pydantic.Field(strict=True, ge=0, le=_MOST_PARTICLES)]


@dataclass(frozen=True, slots=True)
class BaselineRow:
    """Scores of one tracker on one scenario when the baseline was made.

    Attributes
    ----------
    scenario, variant, tracker : str
    seeds : list of int
        In ascending order.
    digests : list of str
        Digest of the sequence of each seed.
    mean, sd : mapping from measure to float
        Over the seeds, for ``precision_20``, ``success_50`` and ``particles_mean``.
    """

    scenario: Name
    variant: Name
    tracker: Name
    seeds: Annotated[list[Seed], pydantic.Field(max_length=MOST_SEEDS)]
    digests: Annotated[list[Digest], pydantic.Field(max_length=MOST_SEEDS)]
    mean: dict[str, Value]
    sd: dict[str, Value]

    @property
    def name(self) -> tuple[str, str, str]:
        """Scenario, variant and tracker."""
        return self.scenario, self.variant, self.tracker

    def tolerance(self, measure: str) -> float:
        """Return the difference of the mean up to which it counts as unchanged."""
        noise = _STANDARD_ERRORS * self.sd[measure] / math.sqrt(len(self.seeds))
        if measure == USAGE:
            return noise + _MIN_USAGE_TOLERANCE * abs(self.mean[measure])
        return noise + _MIN_SHARE_TOLERANCE


@dataclass(frozen=True, slots=True)
class Baseline:
    """The scores that those of later versions are compared with.

    Attributes
    ----------
    reason : str
        Why these numbers replaced the previous ones.
    versions : mapping from str to str
        Of simbench and its dependencies.
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
    ) -> Baseline:
        """Make a baseline from runs, all of which must have status ``ok``.

        Raises
        ------
        DatasetError
            If no reason is given, a run failed, a row has fewer than two seeds (and
            so no spread), or a measure has no value.
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
        rows = baseline_rows(scores.runs)
        for row in rows:
            _require_spread(row)
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
        """Write the baseline as JSON, atomically.

        Raises
        ------
        DatasetError
            If the file cannot be written.
        """
        text = json.dumps(dataclasses.asdict(self), indent=2, allow_nan=False)
        with atomic_write(path) as temporary:
            temporary.write_text(text + "\n")


def baseline_rows(runs: pd.DataFrame) -> list[BaselineRow]:
    """Summarise runs as rows of a baseline, by scenario, variant and tracker.

    Parameters
    ----------
    runs : DataFrame
        `simbench.evaluation.scores.Scores.runs`.

    Returns
    -------
    list of BaselineRow
        In order of appearance. Measures without a value are NaN.
    """
    by_seed = seed_means(runs, MEASURES)
    groups = runs.groupby(list(GROUP), sort=False)
    rows = []
    for name, scores in by_seed.groupby(list(GROUP), sort=False):
        digests = groups.get_group(name).groupby("seed")["digest"].max()
        spreads = {measure: spread(scores[measure]) for measure in MEASURES}
        scenario, variant, tracker = map(str, name)
        row = BaselineRow(
            scenario,
            variant,
            tracker,
            seeds=digests.index.astype(int).tolist(),
            digests=digests.tolist(),
            mean={measure: each.mean for measure, each in spreads.items()},
            sd={measure: each.sd for measure, each in spreads.items()},
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


def _fault(row: BaselineRow) -> str:
    """Return what a row that was read lacks, empty if it is consistent."""
    if not row.seeds:
        return "at least one seed, got none"
    if any(one >= other for one, other in pairwise(row.seeds)):
        return "seeds in ascending order, each once, got others"
    if len(row.digests) != len(row.seeds):
        return f"a digest for each of {len(row.seeds)} seeds, got {len(row.digests)}"
    for name in MEASURES:
        if name not in row.mean.keys() & row.sd.keys():
            return f"{name}, got none"
        if name == USAGE:
            continue
        if row.mean[name] > 1.0:
            return f"a mean {name} of at most 1, got {row.mean[name]:g}"
    for name in MEASURES:
        limit = _largest_sd(name, row.mean[name], len(row.seeds))
        if row.sd[name] > limit:
            return (
                f"an sd of {name} of at most {limit:.3g}, as its mean of "
                f"{row.mean[name]:.3g} allows, got {row.sd[name]:g}"
            )
    return ""


def _largest_sd(measure: str, mean: float, count: int) -> float:
    """Return the largest standard deviation of ``count`` values with a mean.

    Of shares it is reached where each is 0 or 1; of numbers that are not negative,
    where all but one are 0.
    """
    if measure == USAGE:
        largest = mean * math.sqrt(count)
    else:
        largest = math.sqrt(mean * (1.0 - mean) * 2.0)  # 2: of two values, n / (n - 1)
    return largest * (1.0 + 1e-9) + 1e-6


def _require_spread(row: BaselineRow) -> None:
    where = f"{row.tracker} on {row.scenario}"
    if len(row.seeds) < 2:
        raise DatasetError(
            "baseline: expected at least 2 seeds for the tolerance, "
            f"got {len(row.seeds)} for {where}"
        )
    if not all(row.digests):
        raise DatasetError(
            f"baseline: expected a digest of each sequence, got none for {where}"
        )
    for measure in MEASURES:
        if not math.isfinite(row.sd[measure]):
            raise DatasetError(
                f"baseline: expected {measure} on every seed, got none for {where}"
            )
