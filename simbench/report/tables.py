"""Tables of a report, as formatted text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd

from simbench.evaluation.statistics.comparison import Contest, contest_in
from simbench.evaluation.statistics.instance_statistics import spread, summary
from simbench.evaluation.statistics.intervals import describe_interval
from simbench.report.sections import ReportSection, rows_of_seed
from simbench.report.text import count, fixed, percent, scenario_name, seed_name

__all__ = [
    "DIAGNOSIS_COLUMNS",
    "SCORE_COLUMNS",
    "Cell",
    "attribute_rows",
    "column_notes",
    "diagnosis_rows",
    "dial_rows",
    "failure_rows",
    "overall_notes",
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
    interval : str
        Of the mean, in brackets; "n too small" and the range where there are too few
        instances for one, empty where there is none.
    is_best : bool
        Whether no other tracker of the column is shown to be better.
    level : float, in [0, 1]
        Strength of the tint; 0 for none.
    """

    mean: str
    interval: str = ""
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
    ScoreColumn("average_overlap", "Average overlap", "AO", 3, 1),
    ScoreColumn("precision_20", "Precision", "at 20 px", 3, 1),
    ScoreColumn("norm_precision", "Norm. precision", "at 0.20", 3, 1),
    ScoreColumn("center_error_px", "Centre error", "mean, px", 1, -1),
    ScoreColumn("particles_mean", "Particles", "mean per frame", 1, 0),
    ScoreColumn("particles_min", "Particles", "min. per frame", 0, 0),
    ScoreColumn("fps", "Speed", "frames/s", 1, 0),
)
DIAGNOSIS_COLUMNS: Final = (
    ScoreColumn("losses", "Losses", "per run", 2, -1),
    ScoreColumn("losses_per_occlusion", "Lost", "share of occlusions", 2, -1),
    ScoreColumn("recovery_s", "Recovery", "mean, s", 2, -1),
    ScoreColumn("confidence_auc", "Confidence", "AUC", 2, 1),
    ScoreColumn("calibration_error", "Calibration", "error", 2, -1),
    ScoreColumn("alarm_delay_frames", "Alarm", "frames after loss", 1, -1),
    ScoreColumn("false_alarms", "False alarms", "share", 2, -1),
    ScoreColumn("overlap_occluded", "Overlap", "occluded", 2, 1),
    ScoreColumn("overlap_near_distractor", "Overlap", "near distractor", 2, 1),
    ScoreColumn("position_error_m", "Position", "error, m", 2, -1),
    ScoreColumn("speed_error_kmh", "Speed", "error, km/h", 1, -1),
)
"""What happened, beside how good it was; the main failure stands beside it."""
_OVERALL_COLUMNS: Final = tuple(
    replace(column, decimals=2)
    for column in SCORE_COLUMNS
    if column.measure in ("success_50", "precision_20")
)


def overall_rows(
    sections: Sequence[ReportSection], trackers: Sequence[str]
) -> list[tuple[str, list[Cell]]]:
    """Return success and precision of every tracker on every scenario.

    Returns
    -------
    list of (str, list of Cell)
        One row per tracker; two cells per scenario, success at 0.5 and precision at
        20 px. A tracker that did not run on a scenario has dashes there.
    """
    columns = [
        cells
        for section in sections
        for cells in _columns(section, _OVERALL_COLUMNS)[1]
    ]
    return [
        (tracker, [column.get(tracker, Cell(fixed(np.nan, 2))) for column in columns])
        for tracker in trackers
    ]


def score_rows(section: ReportSection) -> list[tuple[str, int, int, list[Cell]]]:
    """Return by tracker: label, seeds, failed runs, a cell for each `SCORE_COLUMNS`."""
    table, columns = _columns(section, SCORE_COLUMNS)
    seeds, failed = table["seeds"].to_dict(), table["failed"].to_dict()
    return [
        (
            tracker,
            seeds[tracker],
            failed[tracker],
            [cells[tracker] for cells in columns],
        )
        for tracker in section.trackers
    ]


def diagnosis_rows(section: ReportSection) -> list[tuple[str, list[Cell], str]]:
    """Return by tracker: label, a cell for each `DIAGNOSIS_COLUMNS`, main failure.

    The failure is the most frequent kind of its runs and the share of wrong frames.
    """
    _, columns = _columns(section, DIAGNOSIS_COLUMNS)
    return [
        (
            tracker,
            [cells[tracker] for cells in columns],
            _main_failure(section.of_tracker(tracker)[1]),
        )
        for tracker in section.trackers
    ]


def _main_failure(frames: pd.DataFrame) -> str:
    kinds = frames.loc[frames["failure"] != "", "failure"].value_counts()
    if kinds.empty:
        return "–"
    return f"{kinds.index[0]}: {percent(kinds.iloc[0] / len(frames))} of frames"


def dial_rows(section: ReportSection) -> list[tuple[str, str, str, str]]:
    """Return dial, requested, achieved, and the range achieved over the sequences."""
    by_seed = section.runs.drop_duplicates("seed")
    names = [
        str(column).removeprefix(kind)
        for kind in ("requested.", "achieved.")
        for column in by_seed
        if str(column).startswith(kind) and by_seed[column].notna().any()
    ]
    rows = []
    for name in dict.fromkeys(names):
        requested = spread(by_seed.get(f"requested.{name}", []))
        achieved = spread(by_seed.get(f"achieved.{name}", []))
        mean, limits = fixed(achieved.mean, 2), fixed(np.nan, 2)
        if not np.isnan(achieved.sd):
            mean += f" ± {fixed(achieved.sd, 2)}"
        if achieved.count > 1:
            limits = f"{fixed(achieved.minimum, 2)} … {fixed(achieved.maximum, 2)}"
        rows.append((name, fixed(requested.mean, 2), mean, limits))
    return rows


def failure_rows(runs: pd.DataFrame) -> list[tuple[str, str, str, str]]:
    """Return scenario, tracker, seed and reason of each failed run."""
    failed = runs[runs["status"] != "ok"]
    seeds = [None if pd.isna(seed) else int(seed) for seed in failed["seed"]]
    return [
        (
            scenario_name(str(run.scenario), str(run.variant)),
            str(run.tracker),
            seed_name(seed),
            str(run.reason),
        )
        for run, seed in zip(failed.itertuples(), seeds, strict=True)
    ]


def sequence_rows(section: ReportSection) -> list[tuple[str, str, str, str, str, str]]:
    """Return seed, frames, absent frames, least visible share, redraws and digest.

    What recorded data do not tell is ``unknown``.
    """
    rows = []
    for seed in section.seeds:
        runs = rows_of_seed(section.runs, seed)
        frames = next(iter(section.of_seed(seed).values()), section.frames.iloc[:0])
        visible = float(frames.loc[~frames["absent"], "visible_fraction"].min())
        # The maximum skips the rows of killed runs, which do not know their sequence.
        rows.append(
            (
                seed_name(seed),
                count(int(runs["frames"].max()), "frame"),
                _known(runs["frames_absent"].max()),
                "unknown" if np.isnan(visible) else percent(visible),
                _known(runs["traffic_redraws"].max()),
                str(runs["digest"].max()),
            )
        )
    return rows


def column_notes(
    section: ReportSection, columns: Sequence[ScoreColumn] = SCORE_COLUMNS
) -> list[str]:
    """Return for each column what it cannot tell; empty where it tells trackers apart.

    That is that it "does not discriminate", where ``still`` ties the best, or that n is
    too small to show that any tracker is better than another.
    """
    found = [_contest(section, column) for column in columns]
    return [
        "does not discriminate"
        if one.is_flat
        else "n too small to show a best"
        if one.is_small
        else ""
        for one in found
    ]


def overall_notes(sections: Sequence[ReportSection]) -> list[str]:
    """Return `column_notes` of the columns of `overall_rows`."""
    return [
        note for section in sections for note in column_notes(section, _OVERALL_COLUMNS)
    ]


def attribute_rows(section: ReportSection) -> list[tuple[str, str]]:
    """Return each attribute of a clip and the share of its frames that have it."""
    runs = section.runs[section.runs["status"] == "ok"]
    prefix = "attribute."
    shares = {
        str(name).removeprefix(prefix): float(runs[name].mean())
        for name in runs
        if str(name).startswith(prefix)
    }
    return [
        (name.replace("_", " "), percent(share))
        for name, share in sorted(shares.items())
        if not np.isnan(share)
    ]


def _known(value: object) -> str:
    return "unknown" if pd.isna(value) else str(value)  # type: ignore[call-overload]


def _columns(
    section: ReportSection, columns: Sequence[ScoreColumn]
) -> tuple[pd.DataFrame, list[dict[str, Cell]]]:
    """Return the summary, indexed by tracker, and the cells of each column."""
    measures = [column.measure for column in columns]
    table = summary(section.runs, measures).set_index("tracker")
    return table, [_column(section, table, column) for column in columns]


def _contest(section: ReportSection, column: ScoreColumn) -> Contest:
    return contest_in(section.runs, column.measure, column.better, column.decimals)


def _column(
    section: ReportSection, table: pd.DataFrame, column: ScoreColumn
) -> dict[str, Cell]:
    means = table[f"{column.measure}.mean"]
    decimals = 0 if means.max() >= 1000.0 else column.decimals
    best = _contest(section, column).best
    cells = {}
    for tracker, row in table.iterrows():
        mean, low, high, least, most = (
            float(row[f"{column.measure}.{part}"])
            for part in ("mean", "low", "high", "min", "max")
        )
        cells[str(tracker)] = Cell(
            fixed(mean, decimals),
            describe_interval(low, high, least, most, decimals),
            is_best=str(tracker) in best,
            level=mean if column.better > 0 and not np.isnan(mean) else 0.0,
        )
    return cells
