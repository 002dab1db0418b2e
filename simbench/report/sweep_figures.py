"""Figures of a sweep: scores against the dial, and maps of two dials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import expit

from simbench.evaluation.statistics.sweep_axes import is_harder_upwards
from simbench.evaluation.statistics.sweep_scores import SweepScores
from simbench.report.palette import Style
from simbench.report.plotting import (
    INK,
    Figure,
    band,
    base_layout,
    dotted_line,
    line,
    rounded,
    scatter,
)
from simbench.report.sweep_text import describe_breaking_point

__all__ = ["breaking_by_other", "score_by_dial", "success_map", "sweep_figures"]

_HALF: Final = 0.5
_CURVE_POINTS: Final = 60


def sweep_figures(swept: SweepScores, styles: Mapping[str, Style]) -> dict[str, Figure]:
    """Return the figures of a sweep of one dial or of two, by name."""
    if len(swept.sweep.dials) > 1:
        maps = {
            f"map-{rank}": success_map(swept, tracker)
            for rank, tracker in enumerate(swept.trackers)
        }
        return {**maps, "breaking": breaking_by_other(swept, styles)}
    share, usage = "share of frames", "particles per frame"
    found = {
        "success": score_by_dial(
            swept, styles, "success_50", share, height=440, has_breaking=True
        ),
        "precision": score_by_dial(swept, styles, "precision_20", share),
        "area": score_by_dial(swept, styles, "success_auc", share),
        "particles": score_by_dial(swept, styles, "particles_mean", usage, height=280),
    }
    return {name: figure for name, figure in found.items() if figure is not None}


def score_by_dial(
    swept: SweepScores,
    styles: Mapping[str, Style],
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
    styles : mapping from tracker to Style
    measure : str
        One of `simbench.evaluation.statistics.sweep_scores.MEASURES`.
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
        style = styles[tracker]
        x = rows[f"achieved.{dial}"].to_numpy(np.float64)
        low, mean, high = (
            rows[f"{measure}.{part}"].to_numpy() for part in ("low", "mean", "high")
        )
        known = np.isfinite(low)
        if known.any() and len(x) > 1:
            low, high = np.where(known, (low, high), mean)  # one seed has no interval
            bands.append(band(tracker, style, x, low, high))
        curve = line(tracker, style, _axis_values(x), mean, "%{y:.3~f}", 4)
        lines.append(curve | {"mode": "lines+markers", "marker": {"size": 6}})
        if has_breaking:
            for row in _breaking_rows(swept, tracker):
                marks += _fitted_curve(row, style) + _breaking_marks(row, style)
    if not lines:
        return None
    layout = base_layout(f"{dial}, achieved", title, height)
    if measure == "particles_mean":
        layout["yaxis"] |= {"rangemode": "tozero"}
    if has_breaking:
        layout["shapes"] = [dotted_line("y", _HALF, INK)]
    return {"data": [*bands, *lines, *marks], "layout": layout}


def success_map(swept: SweepScores, tracker: str) -> Figure:
    """Return success over two dials as a map, with the contour at one half.

    The axes are the values achieved, averaged along the other dial; those requested
    where the achieved ones do not ascend. Points without a sequence are empty.
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
    shares = [rounded(row, 3) for row in table.to_numpy(np.float64)]
    shared = {"x": x, "y": y, "z": shares}
    layout = base_layout(f"{first.dial}, achieved", f"{second.dial}, achieved", 360)
    layout["margin"] |= {"l": 66, "r": 14}
    heatmap = {
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
    }
    contour = {
        **shared,
        "type": "contour",
        "contours": {"start": _HALF, "end": _HALF, "size": 1, "coloring": "none"},
        "line": {"color": "#D55E00", "width": 3, "smoothing": 0},
        "hoverinfo": "skip",
        "showscale": False,
    }
    return {"data": [heatmap, contour], "layout": layout}


def breaking_by_other(swept: SweepScores, styles: Mapping[str, Style]) -> Figure:
    """Return the breaking point of the first dial against the second dial.

    A breaking point outside the range is an open mark on the edge of the range.
    """
    first, second = swept.sweep.dials
    traces = []
    for tracker in swept.trackers:
        rows = _breaking_rows(swept, tracker)
        if not rows:
            continue
        others = [row.other for row in rows]
        values = np.array([_position(row) for row in rows])
        symbols = ["circle" if row.state == "within" else "circle-open" for row in rows]
        trace = line(tracker, styles[tracker], others, values, "", 4) | {
            "mode": "lines+markers",
            "marker": {"size": 9, "symbol": symbols},
            "error_y": _error_bars(rows, thickness=1.2, width=4),
            "text": [describe_breaking_point(row) for row in rows],
            "hovertemplate": f"%{{text}}<extra>{tracker}</extra>",
        }
        traces.append(trace)
    title = f"{first} where success is one half"
    return {"data": traces, "layout": base_layout(second, title, 380)}


def _breaking_rows(swept: SweepScores, tracker: str) -> list[Any]:
    return list(swept.breaking[swept.breaking["tracker"] == tracker].itertuples())


def _axis_values(values: NDArray[np.float64]) -> list[float]:
    """Return values of a dial rounded to six digits."""
    return [float(f"{value:.6g}") for value in values]


def _fitted_curve(row: Any, style: Style) -> list[dict[str, Any]]:
    """Return the logistic curve fitted to all sequences; empty where there is none."""
    if not np.isfinite(row.slope) or row.range_high <= row.range_low:
        return []
    x = np.linspace(row.range_low, row.range_high, _CURVE_POINTS)
    y = expit(row.intercept + row.slope * x)
    look = {"color": style.color, "width": 1, "dash": "dot"}
    curve = line(row.tracker, style, _axis_values(x), y, "", 4)
    return [curve | {"hoverinfo": "skip", "line": look}]


def _breaking_marks(row: Any, style: Style) -> list[dict[str, Any]]:
    """Return the vertical line and the diamond of a breaking point within the range."""
    if row.state != "within":
        return []
    (x,) = _axis_values(np.array([row.value]))
    text = f"{row.tracker}: one half at {describe_breaking_point(row)}"
    return [
        scatter(
            row.tracker,
            name=row.tracker,
            x=[x, x],
            y=[0.0, _HALF],
            line={"color": style.color, "width": 1.5, "dash": "dash"},
            hoverinfo="skip",
        ),
        scatter(
            row.tracker,
            name=row.tracker,
            mode="markers",
            x=[x],
            y=[_HALF],
            marker={
                "symbol": "diamond",
                "size": 11,
                "color": style.color,
                "line": {"color": "white", "width": 1.5},
            },
            error_x=_error_bars([row], color=style.color, thickness=2, width=6),
            hovertemplate=f"{text}<extra></extra>",
        ),
    ]


def _position(row: Any) -> float:
    """Return a breaking point, or the edge of the range that it is beyond."""
    if row.state == "within":
        return float(row.value)
    is_high = (row.state == "beyond") == is_harder_upwards(row.dial)
    return float(row.range_high if is_high else row.range_low)


def _error_bars(rows: Sequence[Any], **look: Any) -> dict[str, Any]:
    """Return the intervals of breaking points, cut to the range; 0 where unknown."""
    above, below = [], []
    for row in rows:
        low, high = np.clip((row.low, row.high), row.range_low, row.range_high)
        above.append(float(np.fmax(high - _position(row), 0.0)))
        below.append(float(np.fmax(_position(row) - low, 0.0)))
    bars = {"type": "data", "symmetric": False, "array": above, "arrayminus": below}
    return bars | look


def _map_axis(rows: pd.DataFrame, dial: str, values: tuple[float, ...]) -> list[float]:
    achieved = rows.groupby(f"requested.{dial}")[f"achieved.{dial}"].mean()
    found = achieved.reindex(list(values)).to_numpy(np.float64)
    ascends = np.isfinite(found).all() and bool((np.diff(found) > 0).all())
    return _axis_values(found if ascends else np.array(values))
