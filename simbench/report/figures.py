"""The figures of a report, as plain plotly figures: traces and a layout.

Each trace names its tracker in ``meta``, by which the page shows and hides it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench import measures
from simbench.report.palette import Style
from simbench.report.sections import Section
from simbench.statistics import curve

__all__ = [
    "Figure",
    "error_by_frame",
    "occluded_spans",
    "particles_by_frame",
    "precision",
    "success",
]

Figure = dict[str, Any]  # plotly's own JSON: {"data": [...], "layout": {...}}

_INK: Final = "#1f2933"
_GRID: Final = "#e5e7eb"
_HIDDEN: Final = 0.95  # a target seen to a lesser share counts as occluded
_ERROR_FLOOR_PX: Final = 0.1  # a logarithmic axis has no zero


def success(part: Section, looks: Mapping[str, Style]) -> Figure:
    """Return the success curves: mean over seeds, band of one standard deviation."""
    figure = _curves(
        part, looks, "overlap", measures.success_curve, measures.SUCCESS_THRESHOLDS
    )
    figure["layout"] |= _layout("overlap threshold", "share of frames", 340)
    figure["layout"]["xaxis"] |= {"range": [0, 1], "dtick": 0.2}
    figure["layout"]["shapes"] = [_guide(0.5)]
    return figure


def precision(part: Section, looks: Mapping[str, Style]) -> Figure:
    """Return the precision curves: mean over seeds, band of one standard deviation."""
    figure = _curves(
        part,
        looks,
        "center_error_px",
        measures.precision_curve,
        measures.PRECISION_THRESHOLDS,
    )
    figure["layout"] |= _layout("centre error threshold [px]", "share of frames", 340)
    figure["layout"]["xaxis"] |= {"range": [0, 50], "dtick": 10}
    figure["layout"]["shapes"] = [_guide(20.0)]
    return figure


def error_by_frame(
    tracks: Mapping[str, pd.DataFrame], looks: Mapping[str, Style]
) -> Figure:
    """Return the centre error by frame over the visible share of the target.

    Parameters
    ----------
    tracks : mapping from tracker to DataFrame
        Frames of one sequence, at least one tracker.
    looks : mapping from tracker to Style

    Returns
    -------
    Figure
        The error on a logarithmic axis, errors below 0.1 px drawn as 0.1 px; spans in
        which less than 95 % of the target is visible are shaded.
    """
    traces = [
        _line(
            tracker,
            looks[tracker],
            frames["frame"],
            np.maximum(frames["center_error_px"].to_numpy(), _ERROR_FLOOR_PX),
            "%{y:.1f} px",
        )
        for tracker, frames in _answered(tracks).items()
    ]
    truth = next(iter(tracks.values()))
    visible = 100.0 * truth["visible_fraction"].to_numpy()
    traces.append(
        {
            "type": "scatter",
            "mode": "lines",
            "name": "visible",
            "x": truth["frame"].tolist(),
            "y": _plain(visible, 0),
            "yaxis": "y2",
            "fill": "tozeroy",
            "fillcolor": "rgba(31, 41, 51, 0.10)",
            "line": {"color": _INK, "width": 1, "shape": "hvh"},
            "hovertemplate": "%{y} % visible<extra></extra>",
        }
    )
    layout = _layout("frame", "centre error [px]", 420)
    layout["xaxis"] |= {"anchor": "y2"}
    layout["yaxis"] |= {
        "type": "log",
        "domain": [0.27, 1.0],
        "range": _log_range(tracks),
        "dtick": 1,
        "tickformat": "~g",
    }
    layout["yaxis2"] = {
        **layout["yaxis"],
        "type": "linear",
        "domain": [0.0, 0.19],
        "range": [0, 108],
        "dtick": 50,
        "title": {"text": "visible [%]", "font": {"size": 12}},
    }
    layout["shapes"] = [*_spans(truth), _threshold(20.0)]
    layout["hoversubplots"] = "axis"
    return {"data": traces, "layout": _by_frame(layout, truth)}


def particles_by_frame(
    tracks: Mapping[str, pd.DataFrame], looks: Mapping[str, Style]
) -> Figure | None:
    """Return likelihood evaluations by frame; None if no tracker made any."""
    traces = [
        _line(
            tracker,
            looks[tracker],
            frames["frame"],
            frames["particles"].to_numpy(dtype=np.float64),
            "%{y:.0f} particles",
        )
        for tracker, frames in _answered(tracks).items()
        if frames["particles"].any()
    ]
    if not traces:
        return None
    truth = next(iter(tracks.values()))
    layout = _layout("frame", "particles", 280)
    layout["yaxis"] |= {"rangemode": "tozero"}
    layout["shapes"] = _spans(truth)
    return {"data": traces, "layout": _by_frame(layout, truth)}


def occluded_spans(frames: pd.DataFrame) -> list[tuple[int, int, float]]:
    """Return first frame, last frame and least visible share of each occluded span."""
    known = np.nan_to_num(frames["visible_fraction"].to_numpy(), nan=1.0)
    visible = np.where(frames["absent"], 0.0, known)
    hidden = visible < _HIDDEN
    edges = np.flatnonzero(np.diff(np.concatenate([[False], hidden, [False]])))
    numbers = frames["frame"].to_numpy()
    return [
        (int(numbers[start]), int(numbers[end - 1]), float(visible[start:end].min()))
        for start, end in edges.reshape(-1, 2)
    ]


def _answered(tracks: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Return the frames that the trackers themselves answered: frame 0 is given."""
    return {
        tracker: frames[frames["left"].notna() & (frames["frame"] > 0)]
        for tracker, frames in tracks.items()
    }


def _curves(
    part: Section,
    looks: Mapping[str, Style],
    column: str,
    shares: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    thresholds: NDArray[np.float64],
) -> Figure:
    bands, lines = [], []
    x = np.concatenate([thresholds, thresholds[::-1]])
    for tracker in part.trackers:
        over = curve(*part.of_tracker(tracker), column, shares)
        if over.count == 0:
            continue
        style = looks[tracker]
        high = np.minimum(over.mean + over.sd, 1.0)
        low = np.maximum(over.mean - over.sd, 0.0)
        if over.count > 1:
            bands.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": _plain(x, 2),
                    "y": _plain(np.concatenate([high, low[::-1]]), 4),
                    "fill": "toself",
                    "fillcolor": style.faded(0.12),
                    "line": {"width": 0},
                    "hoverinfo": "skip",
                    "meta": {"tracker": tracker},
                }
            )
        lines.append(
            _line(tracker, style, pd.Series(thresholds), over.mean, "%{y:.3f}", 4)
        )
    return {"data": bands + lines, "layout": {}}


def _line(
    tracker: str,
    style: Style,
    x: pd.Series[Any],
    y: NDArray[np.float64],
    hover: str,
    decimals: int = 2,
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": tracker,
        "x": x.tolist(),
        "y": _plain(y, decimals),
        "line": {"color": style.color, "width": 2, "dash": style.dash},
        "hovertemplate": f"{hover}<extra>{tracker}</extra>",
        "meta": {"tracker": tracker},
    }


def _layout(x_title: str, y_title: str, height: int) -> dict[str, Any]:
    axis = {
        "gridcolor": _GRID,
        "linecolor": "#9aa5b1",
        "showline": True,
        "ticks": "outside",
        "tickcolor": "#9aa5b1",
        "ticklen": 4,
        "zeroline": False,
    }
    y_axis: dict[str, Any] = {"title": {"text": y_title, "standoff": 8}, **axis}
    if y_title == "share of frames":
        y_axis |= {"range": [0, 1.02], "dtick": 0.2}
    return {
        "height": height,
        "margin": {"l": 58, "r": 14, "t": 12, "b": 48},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "font": {
            "family": "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif",
            "size": 13,
            "color": _INK,
        },
        "showlegend": False,  # the page has one legend for all figures of a chapter
        "hoverlabel": {"bgcolor": "white", "bordercolor": _GRID},
        "xaxis": {"title": {"text": x_title, "standoff": 8}, **axis},
        "yaxis": y_axis,
    }


def _guide(x: float) -> dict[str, Any]:
    """Mark the threshold at which the score of a curve is read."""
    return {
        "type": "line",
        "x0": x,
        "x1": x,
        "yref": "paper",
        "y0": 0,
        "y1": 1,
        "line": {"color": "#9aa5b1", "width": 1, "dash": "dot"},
        "layer": "below",
    }


def _threshold(error_px: float) -> dict[str, Any]:
    """Mark the centre error up to which a frame counts as precise."""
    return {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": error_px,
        "y1": error_px,
        "line": {"color": "#52606d", "width": 1, "dash": "dot"},
    }


def _spans(frames: pd.DataFrame) -> list[dict[str, Any]]:
    """Shade occluded spans, the darker the less is seen of the target."""
    return [
        {
            "type": "rect",
            "x0": first - 0.5,
            "x1": last + 0.5,
            "yref": "paper",
            "y0": 0,
            "y1": 1,
            "fillcolor": f"rgba(31, 41, 51, {0.05 + 0.13 * (1.0 - least):.3f})",
            "line": {"width": 0},
            "layer": "below",
        }
        for first, last, least in occluded_spans(frames)
    ]


def _by_frame(layout: dict[str, Any], frames: pd.DataFrame) -> dict[str, Any]:
    """Return a layout whose x axis is that of a sequence, with one hover label."""
    axis = {
        "range": [-0.5, float(frames["frame"].max()) + 0.5],
        "unifiedhovertitle": {"text": "frame %{x}"},
    }
    return {**layout, "hovermode": "x unified", "xaxis": layout["xaxis"] | axis}


def _log_range(tracks: Mapping[str, pd.DataFrame]) -> list[float]:
    errors = np.concatenate([one["center_error_px"] for one in tracks.values()])
    errors = errors[np.isfinite(errors)]
    most = float(errors.max()) if errors.size else 0.0
    return [np.log10(_ERROR_FLOOR_PX), round(float(np.log10(max(most, 30.0) * 1.3)), 3)]


def _plain(values: NDArray[np.float64], decimals: int) -> list[float | None]:
    """Return numbers as JSON has them: rounded, None for what is not finite."""
    return [
        round(value, decimals) if np.isfinite(value) else None
        for value in values.tolist()
    ]
