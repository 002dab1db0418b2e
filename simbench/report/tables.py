"""The tables of a report, as text ready to be set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from simbench.evaluation.statistics import spread, summary
from simbench.report.sections import ReportSection
from simbench.report.text import count, fixed, plus_minus, share

__all__ = [
    "SCORE_COLUMNS",
    "Cell",
    "dial_rows",
    "failure_rows",
    "overall_rows",
    "score_rows",
    "sequence_rows",
]


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of a table.

    Attributes
    ----------
    mean : str
    sd : str
        Deviation over seeds; empty where there is none.
    is_best : bool
        Whether no other tracker of the column has a better mean.
    level : float, in [0, 1]
        How strongly to tint it; 0 for not at all.
    """

    mean: str
    sd: str = ""
    is_best: bool = False
    level: float = 0.0


@dataclass(frozen=True, slots=True)
class ScoreColumn:
    """A measure as a column: its heading, unit, decimals, and which end is better."""

    measure: str
    heading: str
    unit: str
    decimals: int
    better: int  # 1 higher, -1 lower, 0 neither


SCORE_COLUMNS: Final = (
    ScoreColumn("success_50", "Success", "overlap > 0.5", 3, 1),
    ScoreColumn("success_auc", "Success area", "AUC", 3, 1),
    ScoreColumn("precision_20", "Precision", "at 20 px", 3, 1),
    ScoreColumn("norm_precision", "Norm. precision", "at 0.20", 3, 1),
    ScoreColumn("center_error_px", "Centre error", "mean, px", 1, -1),
    ScoreColumn("particles_mean", "Particles", "mean a frame", 1, 0),
    ScoreColumn("particles_min", "Particles", "least a frame", 0, 0),
    ScoreColumn("fps", "Speed", "frames/s", 1, 0),
)


def overall_rows(
    parts: Sequence[ReportSection], trackers: Sequence[str]
) -> list[tuple[str, list[Cell]]]:
    """Return success and precision of every tracker on every scenario.

    Returns
    -------
    list of (str, list of Cell)
        A row a tracker; two cells a scenario, success at 0.5 and precision at 20 px.
        A tracker that did not run on a scenario has dashes there.
    """
    columns = [
        column
        for part in parts
        for column in _columns(part, ("success_50", "precision_20"), 2)
    ]
    return [
        (tracker, [column.get(tracker, Cell(fixed(np.nan, 2))) for column in columns])
        for tracker in trackers
    ]


def score_rows(part: ReportSection) -> list[tuple[str, int, int, list[Cell]]]:
    """Return a row a tracker: label, seeds, failed runs, a cell a `SCORE_COLUMNS`."""
    table = summary(part.runs, [column.measure for column in SCORE_COLUMNS])
    columns = [_column(table, column) for column in SCORE_COLUMNS]
    seeds = dict(zip(table["tracker"], table["seeds"], strict=True))
    failed = dict(zip(table["tracker"], table["failed"], strict=True))
    return [
        (
            tracker,
            seeds[tracker],
            failed[tracker],
            [cells[tracker] for cells in columns],
        )
        for tracker in part.trackers
    ]


def dial_rows(part: ReportSection) -> list[tuple[str, str, str, str]]:
    """Return dial, requested, achieved, and the range achieved over the sequences."""
    by_seed = part.runs.drop_duplicates("seed")
    names = [
        str(column).removeprefix(kind)
        for kind in ("requested.", "achieved.")
        for column in by_seed
        if str(column).startswith(kind) and by_seed[column].notna().any()
    ]
    rows = []
    for name in dict.fromkeys(names):
        asked = spread(_values(by_seed, f"requested.{name}"))
        got = spread(_values(by_seed, f"achieved.{name}"))
        span = f"{fixed(got.minimum, 2)} … {fixed(got.maximum, 2)}"
        rows.append(
            (
                name,
                fixed(asked.mean, 2),
                plus_minus(got.mean, got.sd, 2),
                span if got.count > 1 else fixed(np.nan, 2),
            )
        )
    return rows


def failure_rows(runs: pd.DataFrame) -> list[tuple[str, str, str, str]]:
    """Return scenario, tracker, seed and reason of each failed run."""
    failed = runs[runs["status"] != "ok"]
    seeds = failed["seed"].astype(str)
    return [
        (
            " · ".join(filter(None, (str(run.scenario), str(run.variant)))),
            str(run.tracker),
            seed.replace("<NA>", "recorded"),
            str(run.reason),
        )
        for run, seed in zip(failed.itertuples(), seeds, strict=True)
    ]


def sequence_rows(part: ReportSection) -> list[tuple[str, str, str, str, str, str]]:
    """Return seed, frames, absent frames, least visible, redraws and digest."""
    rows = []
    for seed in part.seeds:
        same = part.runs["seed"].isna() if seed is None else part.runs["seed"] == seed
        runs = part.runs[same.fillna(False).astype(bool)]
        frames = next(iter(part.of_seed(seed).values()), part.frames.iloc[:0])
        visible = frames.loc[~frames["absent"], "visible_fraction"].min()
        # The row of a killed run knows nothing of its sequence: take one that does.
        rows.append(
            (
                "recorded" if seed is None else str(seed),
                count(int(runs["frames"].max()), "frame"),
                str(runs["frames_absent"].max()),
                share(float(visible)),
                str(runs["traffic_redraws"].max()),
                str(runs["digest"].max()),
            )
        )
    return rows


def _columns(
    part: ReportSection, measures: Sequence[str], decimals: int
) -> list[dict[str, Cell]]:
    table = summary(part.runs, measures)
    return [
        _column(table, ScoreColumn(measure, "", "", decimals, 1))
        for measure in measures
    ]


def _column(table: pd.DataFrame, column: ScoreColumn) -> dict[str, Cell]:
    means = table[f"{column.measure}.mean"].to_numpy()
    deviations = table[f"{column.measure}.sd"].to_numpy()
    decimals = column.decimals if np.nanmax(means, initial=0.0) < 1000.0 else 0
    # Compared as printed: what reads the same is equally good.
    signed = (means * column.better).round(decimals)
    is_contest = column.better != 0 and np.isfinite(signed).sum() > 1
    best = signed == np.nanmax(signed) if is_contest else np.zeros(len(means), bool)
    is_share = column.better > 0
    return {
        str(tracker): Cell(
            fixed(mean, decimals),
            "" if np.isnan(sd) else fixed(sd, decimals),
            is_best=bool(wins),
            level=mean if is_share and not np.isnan(mean) else 0.0,
        )
        for tracker, mean, sd, wins in zip(
            table["tracker"], means, deviations, best, strict=True
        )
    }


def _values(table: pd.DataFrame, column: str) -> list[float]:
    return table[column].tolist() if column in table else []
