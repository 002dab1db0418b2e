"""The baseline of the regression gate: what was reached, how it spread, and why.

The tolerance comes from the spread over seeds. On one machine the same code gives the
same numbers to the bit. On another, float noise may flip a resampling draw, after
which a particle filter goes its own way: for the mean over n seeds that is like new
draws of the tracker on the same sequences, whose spread is at most that over seeds,
``sd``. The difference of two such means has a standard deviation of at most
``sqrt(2) sd / sqrt(n)``; the tolerance is about twice that, ``3 sd / sqrt(n)``, plus a
floor for seeds that happen to agree: 0.02 for shares, 2 % for particle usage.
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

__all__ = [
    "HIGHER_IS_BETTER",
    "MEASURES",
    "USAGE",
    "Baseline",
    "BaselineRow",
    "summarised",
]

HIGHER_IS_BETTER: Final = ("precision_20", "success_50")
USAGE: Final = "particles_mean"
MEASURES: Final = (*HIGHER_IS_BETTER, USAGE)

_STANDARD_ERRORS: Final = 3.0
_SHARE_FLOOR: Final = 0.02
_USAGE_FLOOR: Final = 0.02  # of the baseline


@dataclass(frozen=True, slots=True)
class BaselineRow:
    """What one tracker reached on one scenario when the baseline was made.

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
        """Return how far the mean may move without being called a change."""
        noise = _STANDARD_ERRORS * self.sd[measure] / math.sqrt(len(self.seeds))
        if measure == USAGE:
            return noise + _USAGE_FLOOR * abs(self.mean[measure])
        return noise + _SHARE_FLOOR


@dataclass(frozen=True, slots=True)
class Baseline:
    """The numbers that later versions are held against.

    Attributes
    ----------
    reason : str
        Why these numbers replaced the ones before.
    versions : mapping from str to str
        Of simbench and what it stands on.
    settings : mapping
        What was run, as plain data: enough to run the same again.
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
        """Make a baseline of runs, all of which must have ended.

        Raises
        ------
        DatasetError
            If no reason is given, a run failed, a row has fewer than two seeds (there
            is no spread then), or a measure has no value.
        """
        if not reason.strip():
            raise DatasetError("a new baseline must state its reason, got none")
        failed = scores.runs[scores.runs["status"] != "ok"]
        if len(failed):
            run = failed.iloc[0]
            raise DatasetError(
                f"a baseline must be of runs that ended, got {run['tracker']} on "
                f"{run['scenario']}, seed {run['seed']}: {run['reason']}"
            )
        rows = summarised(scores.runs)
        for row in rows:
            _require_spread(row)
        return cls(reason.strip(), dict(versions), dict(settings), rows)

    @classmethod
    def read(cls, path: Path) -> Baseline:
        """Read what `write` wrote.

        Raises
        ------
        DatasetError
            If it is missing, not JSON, or not a baseline, or a row lacks something.
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
            if (fault := _fault(row)) is not None:
                where = f"{row.tracker} on {row.scenario}"
                raise DatasetError(f"{path}: {where} must have {fault}")
        return baseline

    def with_rows_of(self, earlier: Baseline) -> Baseline:
        """Return this baseline with the rows of an earlier one that it lacks.

        Reason and versions stay those of this one.
        """
        rows = {row.name: row for row in (*earlier.rows, *self.rows)}
        scenarios = list(dict.fromkeys(name[:2] for name in rows))
        ordered = sorted(rows, key=lambda name: scenarios.index(name[:2]))
        return dataclasses.replace(self, rows=[rows[name] for name in ordered])

    def write(self, path: Path) -> None:
        """Write the baseline as JSON, whole: under another name first, then renamed.

        Raises
        ------
        DatasetError
            If the place cannot be written to.
        """
        text = json.dumps(dataclasses.asdict(self), indent=2, allow_nan=False)
        try:
            with atomic_write(path) as partial:
                partial.write_text(text + "\n")
        except OSError as error:
            raise DatasetError(
                f"{path}: cannot be written: {error.strerror}"
            ) from error


def summarised(runs: pd.DataFrame) -> list[BaselineRow]:
    """Return the rows that runs amount to, by scenario, variant and tracker.

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
    for name, seeds in by_seed.groupby(list(GROUP), sort=False):
        digests = groups.get_group(name).groupby("seed")["digest"].max()
        over = {measure: spread(seeds[measure]) for measure in MEASURES}
        scenario, variant, tracker = map(str, name)
        rows.append(
            BaselineRow(
                scenario=scenario,
                variant=variant,
                tracker=tracker,
                seeds=digests.index.astype(int).tolist(),
                digests=digests.tolist(),
                mean={measure: one.mean for measure, one in over.items()},
                sd={measure: one.sd for measure, one in over.items()},
            )
        )
    return rows


def _fault(row: BaselineRow) -> str | None:
    """Return what a row that was read should have and has not."""
    if not row.seeds:
        return "at least one seed, has none"
    if len(row.digests) != len(row.seeds):
        return f"a digest for each of {len(row.seeds)} seeds, has {len(row.digests)}"
    for measure in MEASURES:
        if measure not in row.mean or measure not in row.sd:
            return f"{measure}, has none"
    return None


def _require_spread(row: BaselineRow) -> None:
    where = f"{row.tracker} on {row.scenario}"
    if len(row.seeds) < 2:
        raise DatasetError(
            "a baseline needs at least 2 seeds for its tolerance, "
            f"got {len(row.seeds)} for {where}"
        )
    for measure in MEASURES:
        if not math.isfinite(row.sd[measure]):
            raise DatasetError(
                f"a baseline needs {measure} on every seed, got none for {where}"
            )
