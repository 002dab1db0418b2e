"""Results of a sweep as text: tables and notes for terminal and report."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from simbench.evaluation.statistics.intervals import describe_interval
from simbench.evaluation.statistics.sweep_axes import is_harder_upwards
from simbench.evaluation.statistics.sweep_scores import SweepScores

__all__ = ["breaking_table", "describe_breaking_point", "notes", "point_table"]

Table: TypeAlias = tuple[list[str], list[list[str]]]


def point_table(swept: SweepScores) -> Table:
    """Return headings and rows: the scores of each tracker by value of the dials.

    The first row of each point has the dials as requested and achieved. A star marks
    points of which a sequence misses its dials.
    """
    rank = {variant: index for index, variant in enumerate(swept.sweep.points())}
    points = swept.points.sort_values(
        "variant", key=lambda variants: variants.map(rank), kind="stable"
    )
    dials = swept.sweep.dials
    rows, last = [], None
    for _, row in points.iterrows():
        is_first, last = row["variant"] != last, row["variant"]
        rows.append(
            [
                *(_dial_cell(row, dial) if is_first else "" for dial in dials),
                row["tracker"],
                _mean_and_interval(row, "success_50"),
                _number(row["precision_20.mean"], ".2f"),
                _number(row["success_auc.mean"], ".2f"),
                _number(row["particles_mean.mean"], ".0f"),
            ]
        )
    return [*dials, "tracker", "success", "precision", "area", "particles"], rows


def breaking_table(swept: SweepScores) -> Table:
    """Return headings and rows: where the success of each tracker falls to one half."""
    dial, *others = swept.sweep.dials
    rows = [
        [
            str(row.tracker),
            *([f"{row.other:.12g}"] if others else []),
            describe_breaking_point(row),
        ]
        for row in swept.breaking.itertuples()
    ]
    return ["tracker", *others, f"breaking point of {dial}"], rows


def describe_breaking_point(row: Any) -> str:
    """Return one row of `SweepScores.breaking` as text.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> row = dict(state="within", value=0.43, low=0.38, high=float("inf"))
    >>> row |= dict(range_low=0.0, range_high=1.0, seeds=3, dial="occlusion.hidden")
    >>> describe_breaking_point(SimpleNamespace(**row))
    '0.43 (0.38 to above 1)'
    """
    least, most = _dial(row.range_low), _dial(row.range_high)
    low = f"under {least}" if math.isinf(row.low) else _dial(row.low)
    high = f"above {most}" if math.isinf(row.high) else _dial(row.high)
    interval = f" ({low} to {high})"
    if math.isnan(row.low):
        interval = " (n too small)"
    if row.state == "within":
        return f"{_dial(row.value)}{interval}"
    # A tracker that stays above one half breaks at a harder value, higher or lower.
    is_up = (row.state == "beyond") == is_harder_upwards(row.dial)
    where = "beyond" if is_up else "below"
    side = "above" if row.state == "beyond" else "under"
    if not (math.isfinite(row.low) or math.isfinite(row.high)):
        interval = ""
    return f"{where} the range: {side} one half from {least} to {most}{interval}"


def notes(swept: SweepScores) -> list[str]:
    """Return a line for each point that was not reached, or missed its dials."""
    lines = []
    for _, row in swept.points.drop_duplicates("variant").iterrows():
        variant, seeds, missing = row["variant"], row["seeds"], row["missing"]
        if missing:
            where = f" ({missing} of {seeds + missing} seeds)" if seeds else ""
            lines.append(f"{variant}{where}: {row['reason']}")
        if row["off"]:
            achieved = ", ".join(
                f"{dial} {_dial(row[f'achieved.{dial}.min'])} to "
                f"{_dial(row[f'achieved.{dial}.max'])}"
                for dial in swept.sweep.dials
            )
            lines.append(
                f"{variant}: beyond the tolerance on {row['off']} of "
                f"{seeds} seeds: achieved {achieved}"
            )
    return lines


def _mean_and_interval(row: Any, measure: str) -> str:
    low, high, least, most = (
        row[f"{measure}.{part}"] for part in ("low", "high", "min", "max")
    )
    mean = _number(row[f"{measure}.mean"], ".2f")
    return f"{mean} {describe_interval(low, high, least, most, 2)}".rstrip()


def _dial_cell(row: Any, dial: str) -> str:
    achieved = row[f"achieved.{dial}"]
    star = "*" if row["off"] else ""
    return f"{row[f'requested.{dial}']:.12g} → {_dial(achieved)}{star}"


def _dial(value: float) -> str:
    """Return a value of a dial; 0 if it is 0 to four decimals."""
    return _number(round(value, 4), ".3g")


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)
