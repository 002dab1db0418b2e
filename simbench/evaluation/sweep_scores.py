"""What a sweep found: scores by value of the dial, and where trackers break."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from simbench.evaluation.breaking_point import breaking_point
from simbench.evaluation.score_columns import read_table, write_table
from simbench.evaluation.statistics import bootstrap_interval, seed_means
from simbench.evaluation.sweep_axes import Sweep, is_harder_upwards, is_off

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
        f"{measure}.{what}": "float64"
        for measure in MEASURES
        for what in ("mean", "low", "high")
    },
}
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
        One row a tracker and point of the grid: ``tracker``, ``variant``; for each
        dial ``requested.<dial>`` and, over the sequences, the mean
        ``achieved.<dial>`` with ``achieved.<dial>.min`` and ``.max`` (as requested
        where sequences do not tell); how many ``seeds`` have a sequence, on how many
        it is ``off`` a dial by more than the tolerance, and how many are ``missing``
        one, with the ``reason``; then, for each of `MEASURES`, the mean over seeds
        ``<measure>.mean`` and its bootstrap interval ``.low`` and ``.high``, NaN where
        there is none.
    breaking : DataFrame
        One row a tracker and, where a second dial was turned, value of it: as
        `simbench.evaluation.breaking_point.BreakingPoint`, for the first dial;
        ``dial``, its name; ``other``, the second dial's value, else NaN. No row where
        no sequence could be made.
    """

    sweep: Sweep
    points: pd.DataFrame
    breaking: pd.DataFrame

    @classmethod
    def read(cls, folder: Path, sweep: Sweep) -> SweepScores:
        """Read what `write` wrote.

        Raises
        ------
        DatasetError
            If a table is missing, unreadable, or lacks a column.
        """
        dials = {
            f"{kind}.{dial}": "float64"
            for kind in ("requested", "achieved")
            for dial in sweep.dials
        }
        dials |= {
            f"achieved.{dial}.{end}": "float64"
            for dial in sweep.dials
            for end in ("min", "max")
        }
        points = read_table(folder / _POINTS_FILE, {**_POINT_TYPES, **dials})
        return cls(sweep, points, read_table(folder / _BREAKING_FILE, _BREAKING_TYPES))

    def write(self, folder: Path) -> None:
        """Write ``sweep.parquet`` and ``breaking_points.parquet``, each of them whole.

        Raises
        ------
        DatasetError
            If the folder cannot be written to.
        """
        write_table(self.points, folder / _POINTS_FILE)
        write_table(self.breaking, folder / _BREAKING_FILE)

    @property
    def trackers(self) -> list[str]:
        """Labels, in the order of the run."""
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
        Repetitions on a seed are averaged first. Sequences that could not be made
        have no part in any mean; a tracker that failed has, with what it scored.
    """
    by_seed = _by_seed(runs, sweep)
    facts = {
        variant: _facts(variant, runs, by_seed, sweep) for variant in sweep.points()
    }
    points, breaking = [], []
    for tracker, rows in by_seed.groupby("tracker", sort=False):
        by_variant = dict(list(rows.groupby("variant", sort=False)))
        for variant, told in facts.items():
            spread = _spreads(by_variant[variant], rng)
            points.append({"tracker": tracker, "variant": variant, **told, **spread})
        breaking += list(_breaking(str(tracker), rows, sweep, rng))
    return SweepScores(
        sweep,
        pd.DataFrame(points),
        pd.DataFrame(breaking, columns=list(_BREAKING_TYPES)).astype(_BREAKING_TYPES),
    )


def _by_seed(runs: pd.DataFrame, sweep: Sweep) -> pd.DataFrame:
    """Return a row a tracker, variant and seed: measures, and the dials achieved."""
    asked = sweep.points()
    by_seed = seed_means(runs, MEASURES)
    for index, dial in enumerate(sweep.dials):
        requested = by_seed["variant"].map({v: at[index] for v, at in asked.items()})
        column = f"achieved.{dial}"
        by_seed[f"requested.{dial}"] = requested
        if column in runs:
            # not every row tells: a killed tracker's knows nothing of its sequence
            known = runs.groupby(["variant", "seed"])[column].max()
            found = known.reindex(
                pd.MultiIndex.from_frame(by_seed[["variant", "seed"]])
            )
            by_seed[column] = np.where(found.isna(), requested, found)
        else:
            by_seed[column] = requested
    return by_seed


def _facts(
    variant: str, runs: pd.DataFrame, by_seed: pd.DataFrame, sweep: Sweep
) -> dict[str, Any]:
    """Return what the sequences of one point have in common for all trackers."""
    mine = runs[runs["variant"] == variant].drop_duplicates("seed")
    missing = mine[mine["success_50"].isna() & (mine["status"] != "ok")]
    made = by_seed[(by_seed["variant"] == variant)].drop_duplicates("seed")
    made = made[~made["seed"].isin(missing["seed"])]
    told: dict[str, Any] = {}
    off = np.zeros(len(made), dtype=np.bool_)
    for dial, value in zip(sweep.dials, sweep.points()[variant], strict=True):
        achieved = made[f"achieved.{dial}"].astype(np.float64)
        told[f"requested.{dial}"] = value
        told[f"achieved.{dial}"] = achieved.mean()
        told[f"achieved.{dial}.min"] = achieved.min()
        told[f"achieved.{dial}.max"] = achieved.max()
        off |= np.array([is_off(dial, value, one) for one in achieved], dtype=np.bool_)
    return {
        **told,
        "seeds": len(made),
        "missing": len(missing),
        "off": int(off.sum()),
        "reason": "; ".join(missing["reason"].drop_duplicates()),
    }


def _spreads(rows: pd.DataFrame, rng: np.random.Generator) -> dict[str, float]:
    spreads = {}
    for measure in MEASURES:
        low, high = bootstrap_interval(rows[measure], rng)
        spreads[f"{measure}.mean"] = float(rows[measure].mean())
        spreads[f"{measure}.low"] = low
        spreads[f"{measure}.high"] = high
    return spreads


def _breaking(
    tracker: str, rows: pd.DataFrame, sweep: Sweep, rng: np.random.Generator
) -> Iterator[dict[str, Any]]:
    dial, *others = sweep.dials
    scored = rows[rows["success_50"].notna()]
    groups = scored.groupby(f"requested.{others[0]}") if others else [(np.nan, scored)]
    for other, group in groups:
        if len(group) == 0:
            continue
        found = breaking_point(
            group[f"achieved.{dial}"].to_numpy(np.float64),
            group["success_50"].to_numpy(np.float64),
            group["seed"].to_numpy(np.int64),
            rng,
            is_harder_upwards=is_harder_upwards(dial),
        )
        yield {"tracker": tracker, "dial": dial, "other": other, **asdict(found)}
