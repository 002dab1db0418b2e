"""The figures of a sweep: scores against the dial, and maps of two dials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import expit

from simbench.evaluation.sweep_axes import is_harder_upwards
from simbench.evaluation.sweep_scores import SweepScores
from simbench.report.palette import Style
from simbench.report.plotting import INK, Figure, band, base_layout, line, plain
from simbench.report.sweep_text import breaking_words

__all__ = ["against_dial", "breaking_by_other", "success_map"]

_HALF: Final = 0.5
_CURVE_POINTS: Final = 60


def against_dial(
    swept: SweepScores,
    looks: Mapping[str, Style],
    measure: str,
    title: str,
    *,
    height: int = 380,
    has_breaking: bool = False,
) -> Figure | None:
    """Return a measure against the dial achieved: mean over seeds and its interval.

    Parameters
    ----------
    swept : SweepScores
        Of one dial.
    looks : mapping from tracker to Style
    measure : str
        One of `simbench.evaluation.sweep_scores.MEASURES`.
    title : str
        Of the vertical axis.
    height : int, px
    has_breaking : bool
        Mark where success falls to one half, and draw the fitted curves.

    Returns
    -------
    Figure or None
        None where there is no value, or no tracker uses particles.
    """
    (dial,) = swept.sweep.dials
    bands, lines, marks = [], [], []
    for tracker in swept.trackers:
        rows = swept.points[swept.points["tracker"] == tracker]
        rows = rows[rows[f"{measure}.mean"].notna()].sort_values(f"achieved.{dial}")
        if len(rows) == 0 or (
            measure == "particles_mean" and not rows[f"{measure}.mean"].any()
        ):
            continue
        x = rows[f"achieved.{dial}"].to_numpy(np.float64)
        low, mean, high = (
            rows[f"{measure}.{part}"].to_numpy() for part in ("low", "mean", "high")
        )
        known = np.isfinite(low)
        if known.any() and len(x) > 1:
            low, high = np.where(known, (low, high), mean)  # one seed has no interval
            bands.append(band(tracker, looks[tracker], x, low, high))
        drawn = line(tracker, looks[tracker], plain_axis(x), mean, "%{y:.3~f}", 4)
        drawn |= {"mode": "lines+markers", "marker": {"size": 6}}
        lines.append(drawn)
        if has_breaking:
            found = swept.breaking[swept.breaking["tracker"] == tracker]
            marks += [
                trace
                for row in found.itertuples()
                for trace in _breaking_marks(row, looks[tracker])
            ]
    if not lines:
        return None
    layout = base_layout(f"{dial}, achieved", title, height)
    if measure == "particles_mean":
        layout["yaxis"] |= {"rangemode": "tozero"}
    if has_breaking:
        layout["shapes"] = [_half_line()]
    return {"data": [*bands, *lines, *marks], "layout": layout}


def success_map(swept: SweepScores, tracker: str) -> Figure:
    """Return success over two dials as a map, with the contour at one half.

    The axes are the values achieved, averaged along the other dial; those requested
    where the achieved ones do not ascend. Points that could not be made are empty.
    """
    first, second = swept.sweep.axes
    rows = swept.points[swept.points["tracker"] == tracker]
    x, y = (_map_axis(rows, axis.dial, axis.values) for axis in (first, second))
    table = rows.pivot_table(
        index=f"requested.{second.dial}",
        columns=f"requested.{first.dial}",
        values="success_50.mean",
        dropna=False,
    ).reindex(index=list(second.values), columns=list(first.values))
    shares = [plain(row, 3) for row in table.to_numpy(np.float64)]
    shared = {"x": x, "y": y, "z": shares, "hoverinfo": "skip", "showscale": False}
    layout = base_layout(f"{first.dial}, achieved", f"{second.dial}, achieved", 360)
    layout["margin"] |= {"l": 66, "r": 14}
    return {
        "data": [
            {
                **shared,
                "type": "heatmap",
                "zmin": 0,
                "zmax": 1,
                "colorscale": [[0, "#f1f4f7"], [0.5, "#7fb3d5"], [1, "#0b3c5d"]],
                "showscale": True,
                "colorbar": {"thickness": 10, "dtick": 0.25, "outlinewidth": 0},
                "hoverinfo": "all",
                "hovertemplate": f"{first.dial} %{{x:.3~g}}, {second.dial} "
                "%{y:.3~g}: %{z:.3f}<extra></extra>",
            },
            {
                **shared,
                "type": "contour",
                "contours": {
                    "start": _HALF,
                    "end": _HALF,
                    "size": 1,
                    "coloring": "none",
                },
                "line": {"color": "#D55E00", "width": 3, "smoothing": 0},
            },
        ],
        "layout": layout,
    }


def breaking_by_other(swept: SweepScores, looks: Mapping[str, Style]) -> Figure:
    """Return the breaking point of the first dial against the second dial.

    Where it lies beyond or below the range, the mark lies on the edge of it, open.
    """
    first, second = swept.sweep.dials
    traces = []
    for tracker in swept.trackers:
        rows = swept.breaking[swept.breaking["tracker"] == tracker]
        if len(rows) == 0:
            continue
        within = (rows["state"] == "within").to_numpy()
        places = np.array([_place(row) for row in rows.itertuples()])
        drawn = line(tracker, looks[tracker], rows["other"].tolist(), places, "", 4)
        less, more = _error_bars(rows, places)
        drawn |= {
            "mode": "lines+markers",
            "marker": {
                "size": 9,
                "symbol": ["circle" if inside else "circle-open" for inside in within],
            },
            "error_y": {
                "type": "data",
                "symmetric": False,
                "array": more,
                "arrayminus": less,
                "thickness": 1.2,
                "width": 4,
            },
            "text": [breaking_words(row) for row in rows.itertuples()],
            "hovertemplate": f"%{{text}}<extra>{tracker}</extra>",
        }
        traces.append(drawn)
    title = f"{first} where success is one half"
    return {"data": traces, "layout": base_layout(second, title, 380)}


def plain_axis(values: NDArray[np.float64]) -> list[float]:
    """Return values of a dial rounded to what an axis can show."""
    return [float(f"{value:.6g}") for value in values]


def _breaking_marks(row: Any, style: Style) -> list[dict[str, Any]]:
    """Return the fitted curve and, where it crosses one half, the mark of it."""
    meta = {"tracker": row.tracker}
    marks: list[dict[str, Any]] = []
    if np.isfinite(row.slope) and row.range_high > row.range_low:
        x = np.linspace(row.range_low, row.range_high, _CURVE_POINTS)
        fitted = line(
            row.tracker,
            style,
            plain_axis(x),
            expit(row.intercept + row.slope * x),
            "",
            4,
        )
        fitted |= {
            "hoverinfo": "skip",
            "line": {"color": style.color, "width": 1, "dash": "dot"},
        }
        marks.append(fitted)
    if row.state != "within":
        return marks
    low, high = _ends(row)
    words = f"{row.tracker}: one half at {breaking_words(row)}"
    shared = {"type": "scatter", "meta": meta, "name": row.tracker}
    marks.append(
        {
            **shared,
            "mode": "lines",
            "x": plain_axis(np.array([row.value, row.value])),
            "y": [0.0, _HALF],
            "line": {"color": style.color, "width": 1.5, "dash": "dash"},
            "hoverinfo": "skip",
        }
    )
    marks.append(
        {
            **shared,
            "mode": "markers",
            "x": plain_axis(np.array([row.value])),
            "y": [_HALF],
            "marker": {
                "symbol": "diamond",
                "size": 11,
                "color": style.color,
                "line": {"color": "white", "width": 1.5},
            },
            "error_x": {
                "type": "data",
                "symmetric": False,
                "array": [high - row.value],
                "arrayminus": [row.value - low],
                "color": style.color,
                "thickness": 2,
                "width": 6,
            },
            "hovertemplate": f"{words}<extra></extra>",
        }
    )
    return marks


def _ends(row: Any) -> tuple[float, float]:
    """Return the interval of a breaking point, cut to the range; empty if unknown."""
    low = row.value if np.isnan(row.low) else max(row.low, row.range_low)
    high = row.value if np.isnan(row.high) else min(row.high, row.range_high)
    return low, high


def _place(row: Any) -> float:
    if row.state == "within":
        return float(row.value)
    is_high = (row.state == "beyond") == is_harder_upwards(row.dial)
    return float(row.range_high if is_high else row.range_low)


def _error_bars(
    rows: pd.DataFrame, places: NDArray[np.float64]
) -> tuple[list[float], list[float]]:
    low = rows["low"].clip(rows["range_low"], rows["range_high"]).fillna(0.0)
    high = rows["high"].clip(rows["range_low"], rows["range_high"]).fillna(0.0)
    known = rows["low"].notna().to_numpy()
    less = np.where(known, np.maximum(places - low.to_numpy(), 0.0), 0.0)
    more = np.where(known, np.maximum(high.to_numpy() - places, 0.0), 0.0)
    return less.tolist(), more.tolist()


def _map_axis(rows: pd.DataFrame, dial: str, values: tuple[float, ...]) -> list[float]:
    achieved = rows.groupby(f"requested.{dial}")[f"achieved.{dial}"].mean()
    found = achieved.reindex(list(values)).to_numpy(np.float64)
    ascends = np.isfinite(found).all() and bool((np.diff(found) > 0).all())
    return plain_axis(found if ascends else np.array(values))


def _half_line() -> dict[str, Any]:
    return {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": _HALF,
        "y1": _HALF,
        "line": {"color": INK, "width": 1, "dash": "dot"},
        "layer": "below",
    }
