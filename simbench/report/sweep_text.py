"""What a sweep found, in words: tables and notes for terminal and report."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pandas as pd

from simbench.evaluation.sweep_axes import is_harder_upwards
from simbench.evaluation.sweep_scores import SweepScores

__all__ = ["breaking_table", "breaking_words", "notes", "point_table"]

Table = tuple[list[str], list[list[str]]]


def point_table(swept: SweepScores) -> Table:
    """Return headings and rows: the scores of each tracker by value of the dials.

    Dials stand as requested and achieved, on the first row of each point. A star marks
    points of which a sequence misses its dials.
    """
    headings = [*swept.sweep.dials, "tracker", "success", "precision"]
    headings += ["area", "particles"]
    rows, last = [], None
    for _, row in _in_order(swept).iterrows():
        dials = [_turned(row, dial) for dial in swept.sweep.dials]
        rows.append(
            [
                *([""] * len(dials) if row["variant"] == last else dials),
                row["tracker"],
                _around(row, "success_50"),
                _number(row["precision_20.mean"], ".2f"),
                _number(row["success_auc.mean"], ".2f"),
                _number(row["particles_mean.mean"], ".0f"),
            ]
        )
        last = row["variant"]
    return headings, rows


def breaking_table(swept: SweepScores) -> Table:
    """Return headings and rows: where the success of each tracker falls to one half."""
    dial, *others = swept.sweep.dials
    rows = [
        [
            str(row.tracker),
            *([f"{row.other:.12g}"] if others else []),
            breaking_words(row),
        ]
        for row in swept.breaking.itertuples()
    ]
    return ["tracker", *others, f"breaking point of {dial}"], rows


def breaking_words(row: Any) -> str:
    """Say one row of `SweepScores.breaking` in words.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> row = dict(state="within", value=0.43, low=0.38, high=float("inf"))
    >>> row |= dict(range_low=0.0, range_high=1.0, seeds=3, dial="occlusion.hidden")
    >>> breaking_words(SimpleNamespace(**row))
    '0.43 (0.38 to above 1)'
    """
    least, most = _dial(row.range_low), _dial(row.range_high)
    low = f"under {least}" if math.isinf(row.low) else _dial(row.low)
    high = f"above {most}" if math.isinf(row.high) else _dial(row.high)
    around = "" if math.isnan(row.low) else f" ({low} to {high})"
    if row.state == "within":
        return f"{_dial(row.value)}{around}"
    # what stays above one half breaks farther on, whichever way that is
    is_up = (row.state == "beyond") == is_harder_upwards(row.dial)
    where = "beyond" if is_up else "below"
    side = "above" if row.state == "beyond" else "under"
    over = f"{least} to {most}"
    known = math.isfinite(row.low) or math.isfinite(row.high)
    return f"{where} the range: {side} one half from {over}{around if known else ''}"


def notes(swept: SweepScores) -> list[str]:
    """Return a line for each point that was not reached, or missed its dials."""
    return list(_notes(swept))


def _notes(swept: SweepScores) -> Iterator[str]:
    for _, row in swept.points.drop_duplicates("variant").iterrows():
        seeds = row["seeds"] + row["missing"]
        if row["missing"]:
            where = "" if not row["seeds"] else f" ({row['missing']} of {seeds} seeds)"
            yield f"{row['variant']}{where}: {row['reason']}"
        if row["off"]:
            achieved = ", ".join(
                f"{dial} {_dial(row[f'achieved.{dial}.min'])} to "
                f"{_dial(row[f'achieved.{dial}.max'])}"
                for dial in swept.sweep.dials
            )
            yield (
                f"{row['variant']}: beyond the tolerance on {row['off']} of "
                f"{row['seeds']} seeds: achieved {achieved}"
            )


def _in_order(swept: SweepScores) -> pd.DataFrame:
    """Return the points as the grid has them, at each of them all trackers."""
    rank = {variant: index for index, variant in enumerate(swept.sweep.points())}
    return swept.points.sort_values(
        "variant", key=lambda variants: variants.map(rank), kind="stable"
    )


def _around(row: Any, measure: str) -> str:
    mean, low, high = (row[f"{measure}.{part}"] for part in ("mean", "low", "high"))
    around = "" if math.isnan(low) else f" [{low:.2f}, {high:.2f}]"
    return f"{_number(mean, '.2f')}{around}"


def _turned(row: Any, dial: str) -> str:
    achieved = row[f"achieved.{dial}"]
    star = "*" if row["off"] else ""
    return f"{row[f'requested.{dial}']:.12g} → {_dial(achieved)}{star}"


def _dial(value: float) -> str:
    """Return a value of a dial; what is all but 0 in four digits."""
    return _number(round(value, 4), ".3g")


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)
