"""Figures of a chapter: curves over thresholds, and values by frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.evaluation.measures import track_measures
from simbench.evaluation.statistics.instance_statistics import curve
from simbench.report.palette import Style
from simbench.report.plotting import (
    INK,
    Figure,
    band,
    base_layout,
    dotted_line,
    line,
    rounded,
)
from simbench.report.sections import ReportSection

__all__ = [
    "error_by_frame",
    "occluded_spans",
    "particles_by_frame",
    "precision",
    "success",
]

_OCCLUDED_BELOW: Final = 0.95  # visible share
_MIN_ERROR_PX: Final = 0.1  # a logarithmic axis has no zero


def success(section: ReportSection, styles: Mapping[str, Style]) -> Figure:
    """Return the success curves: mean over seeds and the band of its interval."""
    bounds = track_measures.SUCCESS_THRESHOLDS
    traces = _curves(section, styles, "overlap", track_measures.success_curve, bounds)
    layout = base_layout("overlap threshold", "share of frames", 340)
    layout["xaxis"] |= {"range": [0, 1], "dtick": 0.2}
    layout["shapes"] = [dotted_line("x", 0.5)]
    return {"data": traces, "layout": layout}


def precision(section: ReportSection, styles: Mapping[str, Style]) -> Figure:
    """Return the precision curves: mean over seeds and the band of its interval."""
    column, bounds = "center_error_px", track_measures.PRECISION_THRESHOLDS
    traces = _curves(section, styles, column, track_measures.precision_curve, bounds)
    layout = base_layout("centre error threshold [px]", "share of frames", 340)
    layout["xaxis"] |= {"range": [0, 50], "dtick": 10}
    layout["shapes"] = [dotted_line("x", 20.0)]
    return {"data": traces, "layout": layout}


def error_by_frame(
    tracks: Mapping[str, pd.DataFrame], styles: Mapping[str, Style]
) -> Figure:
    """Return the centre error by frame, above the visible share of the target.

    Parameters
    ----------
    tracks : mapping from tracker to DataFrame
        Frames of one sequence, at least one tracker.
    styles : mapping from tracker to Style

    Returns
    -------
    Figure
        The error on a logarithmic axis, errors below 0.1 px drawn as 0.1 px; spans in
        which less than 95 % of the target is visible are shaded.
    """
    truth = next(iter(tracks.values()))
    traces = _lines_by_frame(tracks, styles, "center_error_px", "%{y:.1f} px")
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
        "title": {"text": _visible_title(truth), "font": {"size": 12}},
    }
    layout["shapes"] = [*_spans(truth), dotted_line("y", 20.0, "#52606d", "above")]
    layout["hoversubplots"] = "axis"
    return {
        "data": [*traces, _visible_share(truth)],
        "layout": _by_frame(layout, truth),
    }


def particles_by_frame(
    tracks: Mapping[str, pd.DataFrame], styles: Mapping[str, Style]
) -> Figure | None:
    """Return likelihood evaluations by frame; None if no tracker made any."""
    used = {
        tracker: frames
        for tracker, frames in tracks.items()
        if frames.loc[_is_answer(frames), "particles"].any()
    }
    if not used:
        return None
    truth = next(iter(tracks.values()))
    layout = base_layout("frame", "particles", 280)
    layout["yaxis"] |= {"rangemode": "tozero"}
    layout["shapes"] = _spans(truth)
    traces = _lines_by_frame(used, styles, "particles", "%{y:.0f} particles")
    return {"data": traces, "layout": _by_frame(layout, truth)}


def occluded_spans(frames: pd.DataFrame) -> list[tuple[int, int, float]]:
    """Return first frame, last frame and least visible share of each occluded span."""
    known = np.nan_to_num(frames["visible_fraction"].to_numpy(), nan=1.0)
    visible = np.where(frames["absent"], 0.0, known)
    occluded = visible < _OCCLUDED_BELOW
    edges = np.flatnonzero(np.diff(np.concatenate([[False], occluded, [False]])))
    numbers = frames["frame"].to_numpy()
    return [
        (int(numbers[start]), int(numbers[end - 1]), float(visible[start:end].min()))
        for start, end in edges.reshape(-1, 2)
    ]


def _is_answer(frames: pd.DataFrame) -> pd.Series[bool]:
    """Return where the tracker gave a box: the box of frame 0 is given to it."""
    return frames["left"].notna() & (frames["frame"] > 0)


def _lines_by_frame(
    tracks: Mapping[str, pd.DataFrame],
    styles: Mapping[str, Style],
    column: str,
    hover: str,
) -> list[dict[str, Any]]:
    lines = []
    for tracker, frames in tracks.items():
        answers = frames[_is_answer(frames)]
        values = answers[column].to_numpy(dtype=np.float64)
        if column == "center_error_px":
            values = np.maximum(values, _MIN_ERROR_PX)
        numbers = answers["frame"].tolist()
        lines.append(line(tracker, styles[tracker], numbers, values, hover))
    return lines


def _visible_title(frames: pd.DataFrame) -> str:
    is_known = frames.loc[~frames["absent"], "visible_fraction"].notna().any()
    return "visible [%]" if is_known else "visible: unknown"


def _visible_share(frames: pd.DataFrame) -> dict[str, Any]:
    """Return the filled curve of the target's visible share, in percent."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": "visible",
        "x": frames["frame"].tolist(),
        "y": rounded(100.0 * frames["visible_fraction"].to_numpy(), 0),
        "yaxis": "y2",
        "fill": "tozeroy",
        "fillcolor": "rgba(31, 41, 51, 0.10)",
        "line": {"color": INK, "width": 1, "shape": "hvh"},
        "hovertemplate": "%{y} % visible<extra></extra>",
    }


def _curves(
    section: ReportSection,
    styles: Mapping[str, Style],
    column: str,
    shares: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    thresholds: NDArray[np.float64],
) -> list[dict[str, Any]]:
    """Return the bands of all trackers, then their lines."""
    bands, lines = [], []
    for tracker in section.trackers:
        over = curve(*section.of_tracker(tracker), column, shares)
        if over.count == 0:
            continue
        style = styles[tracker]
        if over.count > 1:
            bands.append(band(tracker, style, thresholds, over.low, over.high))
        lines.append(
            line(tracker, style, thresholds.tolist(), over.mean, "%{y:.3f}", 4)
        )
    return bands + lines


def _spans(frames: pd.DataFrame) -> list[dict[str, Any]]:
    """Return shaded occluded spans, the darker the less of the target is visible."""
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
    """Return a layout whose x axis is the frames, with one hover label for all."""
    axis = {
        "range": [-0.5, float(frames["frame"].max()) + 0.5],
        "unifiedhovertitle": {"text": "frame %{x}"},
    }
    return {**layout, "hovermode": "x unified", "xaxis": layout["xaxis"] | axis}


def _log_range(tracks: Mapping[str, pd.DataFrame]) -> list[float]:
    errors = np.concatenate([one["center_error_px"] for one in tracks.values()])
    errors = errors[np.isfinite(errors)]
    most = float(errors.max()) if errors.size else 0.0
    return [np.log10(_MIN_ERROR_PX), round(float(np.log10(max(most, 30.0) * 1.3)), 3)]
