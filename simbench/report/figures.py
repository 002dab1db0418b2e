"""The figures of a chapter: curves over thresholds, and what happens by frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.evaluation import measures
from simbench.evaluation.statistics import curve
from simbench.report.palette import Style
from simbench.report.plotting import (
    INK,
    Figure,
    band,
    base_layout,
    guide,
    line,
    plain,
)
from simbench.report.sections import ReportSection

__all__ = [
    "error_by_frame",
    "occluded_spans",
    "particles_by_frame",
    "precision",
    "success",
]

_HIDDEN: Final = 0.95  # a target seen to a lesser share counts as occluded
_ERROR_FLOOR_PX: Final = 0.1  # a logarithmic axis has no zero


def success(part: ReportSection, looks: Mapping[str, Style]) -> Figure:
    """Return the success curves: mean over seeds, band of one standard deviation."""
    figure = _curves(
        part, looks, "overlap", measures.success_curve, measures.SUCCESS_THRESHOLDS
    )
    figure["layout"] |= base_layout("overlap threshold", "share of frames", 340)
    figure["layout"]["xaxis"] |= {"range": [0, 1], "dtick": 0.2}
    figure["layout"]["shapes"] = [guide(0.5)]
    return figure


def precision(part: ReportSection, looks: Mapping[str, Style]) -> Figure:
    """Return the precision curves: mean over seeds, band of one standard deviation."""
    figure = _curves(
        part,
        looks,
        "center_error_px",
        measures.precision_curve,
        measures.PRECISION_THRESHOLDS,
    )
    figure["layout"] |= base_layout(
        "centre error threshold [px]", "share of frames", 340
    )
    figure["layout"]["xaxis"] |= {"range": [0, 50], "dtick": 10}
    figure["layout"]["shapes"] = [guide(20.0)]
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
        line(
            tracker,
            looks[tracker],
            frames["frame"].tolist(),
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
            "y": plain(visible, 0),
            "yaxis": "y2",
            "fill": "tozeroy",
            "fillcolor": "rgba(31, 41, 51, 0.10)",
            "line": {"color": INK, "width": 1, "shape": "hvh"},
            "hovertemplate": "%{y} % visible<extra></extra>",
        }
    )
    layout = base_layout("frame", "centre error [px]", 420)
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
        line(
            tracker,
            looks[tracker],
            frames["frame"].tolist(),
            frames["particles"].to_numpy(dtype=np.float64),
            "%{y:.0f} particles",
        )
        for tracker, frames in _answered(tracks).items()
        if frames["particles"].any()
    ]
    if not traces:
        return None
    truth = next(iter(tracks.values()))
    layout = base_layout("frame", "particles", 280)
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
    part: ReportSection,
    looks: Mapping[str, Style],
    column: str,
    shares: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    thresholds: NDArray[np.float64],
) -> Figure:
    bands, lines = [], []
    for tracker in part.trackers:
        over = curve(*part.of_tracker(tracker), column, shares)
        if over.count == 0:
            continue
        style = looks[tracker]
        high = np.minimum(over.mean + over.sd, 1.0)
        low = np.maximum(over.mean - over.sd, 0.0)
        if over.count > 1:
            bands.append(band(tracker, style, thresholds, low, high))
        lines.append(
            line(tracker, style, thresholds.tolist(), over.mean, "%{y:.3f}", 4)
        )
    return {"data": bands + lines, "layout": {}}


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
