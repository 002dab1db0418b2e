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
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pandas as pd
import pydantic

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics import GROUP, seed_means, spread

__all__ = ["MEASURES", "USAGE", "Baseline", "BaselineRow", "baseline_rows"]

USAGE: Final = "particles_mean"
MEASURES: Final = ("precision_20", "success_50", USAGE)

_STANDARD_ERRORS: Final = 3.0
_MIN_SHARE_TOLERANCE: Final = 0.02
_MIN_USAGE_TOLERANCE: Final = 0.02  # of the baseline


@dataclass(frozen=True, slots=True)
class BaselineRow:
    """Scores of one tracker on one scenario when the baseline was made.

    Attributes
    ----------
    scenario, variant, tracker : str
    seeds : list of int
        In ascending order.
    digests : list of str
        Digest of the sequence of each seed; empty where unknown.
    mean, sd : mapping from measure to float
        Over the seeds, for ``precision_20``, ``success_50`` and ``particles_mean``.
    """

    scenario: str
    variant: str
    tracker: str
    seeds: list[int]
    digests: list[str]
    mean: dict[str, pydantic.FiniteFloat]
    sd: dict[str, pydantic.FiniteFloat]

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

    reason: str
    versions: dict[str, str]
    settings: dict[str, Any]
    rows: list[BaselineRow]

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
            If it is missing, not JSON, or not a baseline, or a row is inconsistent.
        """
        try:
            baseline = pydantic.TypeAdapter(cls).validate_json(path.read_bytes())
        except OSError as error:
            raise DatasetError(
                f"{path}: baseline cannot be read: {error.strerror}"
            ) from error
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"])) or "the file"
            raise DatasetError(f"{path}: {place}: {first['msg']}") from error
        for row in baseline.rows:
            if fault := _fault(row):
                where = f"{row.tracker} on {row.scenario}"
                raise DatasetError(f"{path}: {where}: expected {fault}")
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


def _fault(row: BaselineRow) -> str:
    """Return what a row that was read lacks, empty if it is consistent."""
    if not row.seeds:
        return "at least one seed, got none"
    if len(row.digests) != len(row.seeds):
        return f"a digest for each of {len(row.seeds)} seeds, got {len(row.digests)}"
    lacking = [name for name in MEASURES if name not in row.mean.keys() & row.sd.keys()]
    return f"{lacking[0]}, got none" if lacking else ""


def _require_spread(row: BaselineRow) -> None:
    where = f"{row.tracker} on {row.scenario}"
    if len(row.seeds) < 2:
        raise DatasetError(
            "baseline: expected at least 2 seeds for the tolerance, "
            f"got {len(row.seeds)} for {where}"
        )
    for measure in MEASURES:
        if not math.isfinite(row.sd[measure]):
            raise DatasetError(
                f"baseline: expected {measure} on every seed, got none for {where}"
            )
