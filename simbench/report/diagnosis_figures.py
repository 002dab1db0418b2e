"""Figures of what happened: how long targets are held, and what confidence is worth."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simbench.evaluation.measures.confidence import calibration, stated
from simbench.evaluation.measures.losses import FOUND_OVERLAP, survival
from simbench.report.palette import Style
from simbench.report.plotting import (
    GREY,
    Figure,
    band,
    base_layout,
    line,
    rounded,
)
from simbench.report.sections import ReportSection

__all__ = ["calibration_curves", "held_curves"]


def held_curves(section: ReportSection, styles: Mapping[str, Style]) -> Figure | None:
    """Return the share of runs that never lost their target, by time.

    Kaplan-Meier, with bands of 95 %; runs that end without a loss are censored. None if
    no run has frames.
    """
    bands, lines = [], []
    for tracker in section.trackers:
        runs, _ = section.of_tracker(tracker)
        known = runs[runs["held_s"].notna() & runs["is_lost"].notna()]
        if len(known) == 0:
            continue
        curve = survival(known["held_s"].to_numpy(), known["is_lost"].to_numpy(bool))
        rows = np.repeat(np.arange(len(curve.time_s)), 2)
        time_s, before = curve.time_s[rows[1:]], rows[:-1]  # steps
        style = styles[tracker]
        low, high = curve.low[before], curve.high[before]
        if np.isfinite(low).all() and len(known) > 1:
            bands.append(band(tracker, style, time_s, low, high))
        hover = "%{y:.2f} hold it at %{x:.2f} s"
        x = [value or 0.0 for value in rounded(time_s, 4)]
        lines.append(line(tracker, style, x, curve.share[before], hover, 4))
    if not lines:
        return None
    layout = base_layout("time [s]", "share of runs", 340)
    layout["yaxis"] |= {"range": [0, 1.02], "dtick": 0.2}
    layout["xaxis"] |= {"rangemode": "tozero"}
    return {"data": [*bands, *lines], "layout": layout}


def calibration_curves(
    section: ReportSection, styles: Mapping[str, Style]
) -> Figure | None:
    """Return the share of frames on the target by confidence, in ten bins.

    All runs of a tracker together. None if no tracker states a confidence.
    """
    lines = []
    for tracker in section.trackers:
        _, frames = section.of_tracker(tracker)
        confidence = stated(
            frames["confidence"].to_numpy(), frames["said_absent"].to_numpy(bool)
        )
        if confidence is None:
            continue
        chosen = (frames["scored"] & (frames["frame"] > 0)).to_numpy(bool)
        right = frames["overlap"].to_numpy() > FOUND_OVERLAP
        found = calibration(confidence[chosen], right[chosen])
        filled = found.count > 0
        x = [value or 0.0 for value in rounded(found.confidence[filled], 3)]
        hover = "%{y:.2f} on the target at confidence %{x:.2f}"
        one = line(tracker, styles[tracker], x, found.share[filled], hover, 3)
        lines.append(one | {"mode": "lines+markers"})
    if not lines:
        return None
    layout = base_layout("confidence", "share of frames on the target", 340)
    layout["xaxis"] |= {"range": [0, 1], "dtick": 0.2}
    layout["shapes"] = [
        {
            "type": "line",
            **{"x0": 0, "y0": 0, "x1": 1, "y1": 1},
            "line": {"color": GREY, "width": 1, "dash": "dot"},
            "layer": "below",
        }
    ]
    return {"data": lines, "layout": layout}
