"""Results of a sweep: scores by value of the dial, and breaking points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from simbench.evaluation.score_columns import read_table, write_table
from simbench.evaluation.statistics.breaking_point import breaking_point
from simbench.evaluation.statistics.instance_statistics import (
    is_share,
    seed_means,
    spread,
)
from simbench.evaluation.statistics.sweep_axes import Sweep, is_harder_upwards, is_off

__all__ = ["MEASURES", "SweepScores", "sweep_scores"]

MEASURES: Final = ("success_50", "precision_20", "success_auc", "particles_mean")

_POINTS_FILE: Final = "sweep.parquet"
_BREAKING_FILE: Final = "breaking_points.parquet"
_POINT_TYPES: Final = {
    "tracker": "str",
    "variant": "str",
    "seeds": "int64",
    "missing": "int64",
    "off": "int64",
    "reason": "str",
    **{
        f"{measure}.{statistic}": "float64"
        for measure in MEASURES
        for statistic in ("mean", "low", "high", "min", "max")
    },
}
_DIAL_COLUMNS: Final = ("requested.{}", "achieved.{}") + tuple(
    f"achieved.{{}}.{end}" for end in ("min", "max")
)
_BREAKING_TYPES: Final = {
    "tracker": "str",
    "dial": "str",
    "other": "float64",
    "state": "str",
    **dict.fromkeys(
        ("value", "low", "high", "range_low", "range_high", "intercept", "slope"),
        "float64",
    ),
    "seeds": "int64",
}


@dataclass(frozen=True, slots=True)
class SweepScores:
    """The results of a sweep.

    Attributes
    ----------
    sweep : Sweep
    points : DataFrame
        One row per tracker and point of the grid: ``tracker``, ``variant``; for each
        dial ``requested.<dial>`` and, over the sequences, the mean
        ``achieved.<dial>`` with ``achieved.<dial>.min`` and ``.max`` (as requested
        where the achieved value is unknown); the numbers of ``seeds`` with a sequence,
        of those ``off`` a dial by more than the tolerance, and of those with a
        ``missing`` sequence, with the ``reason``; then, for each of `MEASURES`, the
        mean over seeds ``<measure>.mean``, its interval ``.low`` and ``.high`` (NaN
        where there are too few seeds for one), and the range ``.min`` and ``.max``.
    breaking : DataFrame
        One row per tracker and, if there is a second dial, value of it: the fields of
        `simbench.evaluation.statistics.breaking_point.BreakingPoint` for the first
        dial; ``dial``, its name; ``other``, the second dial's value, else NaN. No row
        if no sequence could be generated.
    """

    sweep: Sweep
    points: pd.DataFrame
    breaking: pd.DataFrame

    @classmethod
    def read(cls, folder: Path, sweep: Sweep) -> SweepScores:
        """Read the two tables that `write` wrote.

        Raises
        ------
        DatasetError
            If a table is missing, unreadable, or lacks a column.
        """
        dials = {
            column.format(dial): "float64"
            for column in _DIAL_COLUMNS
            for dial in sweep.dials
        }
        points = read_table(folder / _POINTS_FILE, {**_POINT_TYPES, **dials})
        return cls(sweep, points, read_table(folder / _BREAKING_FILE, _BREAKING_TYPES))

    def write(self, folder: Path) -> None:
        """Write ``sweep.parquet`` and ``breaking_points.parquet``, each atomically.

        Raises
        ------
        DatasetError
            If the folder cannot be written to.
        """
        write_table(self.points, folder / _POINTS_FILE)
        write_table(self.breaking, folder / _BREAKING_FILE)

    @property
    def trackers(self) -> list[str]:
        """Labels of the trackers, in the order of the run."""
        return list(self.points["tracker"].drop_duplicates())


def sweep_scores(
    runs: pd.DataFrame, sweep: Sweep, rng: np.random.Generator
) -> SweepScores:
    """Summarise the runs of a sweep.

    Parameters
    ----------
    runs : DataFrame
        `simbench.evaluation.scores.Scores.runs`, at least one, of this sweep.
    sweep : Sweep
    rng : numpy.random.Generator
        For the bootstrap.

    Returns
    -------
    SweepScores
        Repetitions on a seed are averaged first. Sequences that could not be generated
        are excluded from every mean; failed trackers are included with their scores.
    """
    by_seed = _by_seed(runs, sweep)
    facts = {
        variant: _sequence_facts(variant, runs, by_seed, sweep)
        for variant in sweep.points()
    }
    points: list[dict[str, Any]] = []
    breaking: list[dict[str, Any]] = []
    for tracker, rows in by_seed.groupby("tracker", sort=False):
        by_variant = dict(list(rows.groupby("variant", sort=False)))
        for variant, shared in facts.items():
            if variant not in by_variant:  # refined for other trackers
                continue
            means = _means(by_variant[variant])
            points.append({"tracker": tracker, "variant": variant, **shared, **means})
        breaking += _breaking_points(str(tracker), rows, sweep, rng)
    return SweepScores(
        sweep,
        pd.DataFrame(points),
        pd.DataFrame(breaking, columns=list(_BREAKING_TYPES)).astype(_BREAKING_TYPES),
    )


def _by_seed(runs: pd.DataFrame, sweep: Sweep) -> pd.DataFrame:
    """Return one row per tracker, variant and seed: measures, and achieved dials."""
    points = sweep.points()
    by_seed = seed_means(runs, MEASURES)
    sequences = pd.MultiIndex.from_frame(by_seed[["variant", "seed"]])
    for index, dial in enumerate(sweep.dials):
        values = {variant: point[index] for variant, point in points.items()}
        requested = by_seed["variant"].map(values)
        column = f"achieved.{dial}"
        by_seed[f"requested.{dial}"] = by_seed[column] = requested
        if column in runs:
            # the rows of killed trackers lack it
            known = runs.groupby(["variant", "seed"])[column].max().reindex(sequences)
            by_seed[column] = np.where(known.isna(), requested, known)
    return by_seed


def _sequence_facts(
    variant: str, runs: pd.DataFrame, by_seed: pd.DataFrame, sweep: Sweep
) -> dict[str, Any]:
    """Return the columns of one point that do not depend on the tracker."""
    of_point = runs[runs["variant"] == variant].drop_duplicates("seed")
    missing = of_point[of_point["success_50"].isna() & (of_point["status"] != "ok")]
    made = by_seed[(by_seed["variant"] == variant)].drop_duplicates("seed")
    made = made[~made["seed"].isin(missing["seed"])]
    dials: dict[str, Any] = {}
    off = np.zeros(len(made), dtype=np.bool_)
    for dial, value in zip(sweep.dials, sweep.points()[variant], strict=True):
        achieved = made[f"achieved.{dial}"].astype(np.float64)
        dials[f"requested.{dial}"] = value
        dials[f"achieved.{dial}"] = achieved.mean()
        dials[f"achieved.{dial}.min"] = achieved.min()
        dials[f"achieved.{dial}.max"] = achieved.max()
        off |= np.array([is_off(dial, value, one) for one in achieved], dtype=np.bool_)
    return {
        **dials,
        "seeds": len(made),
        "missing": len(missing),
        "off": int(off.sum()),
        "reason": "; ".join(missing["reason"].drop_duplicates()),
    }


def _means(rows: pd.DataFrame) -> dict[str, float]:
    means = {}
    for measure in MEASURES:
        over = spread(rows[measure], is_bounded=is_share(measure))
        means[f"{measure}.mean"] = over.mean
        means[f"{measure}.low"], means[f"{measure}.high"] = over.low, over.high
        means[f"{measure}.min"], means[f"{measure}.max"] = over.minimum, over.maximum
    return means


def _breaking_points(
    tracker: str, rows: pd.DataFrame, sweep: Sweep, rng: np.random.Generator
) -> Iterator[dict[str, Any]]:
    dial, *others = sweep.dials
    scored = rows[rows["success_50"].notna()]
    groups = scored.groupby(f"requested.{others[0]}") if others else [(np.nan, scored)]
    for other, group in groups:
        if len(group) == 0:
            continue
        steps = group.groupby(f"requested.{dial}")[f"achieved.{dial}"].mean()
        found = breaking_point(
            group[f"achieved.{dial}"].to_numpy(np.float64),
            group["success_50"].to_numpy(np.float64),
            group["seed"].to_numpy(np.int64),
            rng,
            is_harder_upwards=is_harder_upwards(dial),
            steps=np.unique(steps.to_numpy(np.float64)),
        )
        yield {"tracker": tracker, "dial": dial, "other": other, **asdict(found)}
