"""Parts of the figures, as plain data: layout, lines, bands and numbers.

A figure is a list of plotly traces and a layout. Each trace names its tracker in
``meta``, by which the page shows and hides it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.report.palette import Style

__all__ = [
    "GREY",
    "INK",
    "Figure",
    "band",
    "base_layout",
    "dotted_line",
    "line",
    "rounded",
    "scatter",
]

Figure = dict[str, Any]  # plotly's own JSON: {"data": [...], "layout": {...}}

INK: Final = "#1f2933"
GREY: Final = "#9aa5b1"
_GRID: Final = "#e5e7eb"


def base_layout(x_title: str, y_title: str, height: int) -> dict[str, Any]:
    """Return the layout that all figures share; shares of frames run from 0 to 1."""
    axis = {
        "gridcolor": _GRID,
        "linecolor": GREY,
        "showline": True,
        "ticks": "outside",
        "tickcolor": GREY,
        "ticklen": 4,
        "zeroline": False,
    }
    y_axis: dict[str, Any] = {"title": {"text": y_title, "standoff": 8}, **axis}
    if y_title.startswith("share of frames"):
        y_axis |= {"range": [0, 1.02], "dtick": 0.2}
    return {
        "height": height,
        "margin": {"l": 58, "r": 14, "t": 12, "b": 48},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "font": {
            "family": "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif",
            "size": 13,
            "color": INK,
        },
        "showlegend": False,  # the page has one legend for all figures of a chapter
        "hoverlabel": {"bgcolor": "white", "bordercolor": _GRID},
        "xaxis": {"title": {"text": x_title, "standoff": 8}, **axis},
        "yaxis": y_axis,
    }


def scatter(tracker: str, **properties: Any) -> dict[str, Any]:
    """Return a scatter trace of one tracker, drawn as a line unless ``mode`` is set."""
    trace = {"type": "scatter", "mode": "lines", "meta": {"tracker": tracker}}
    return trace | properties


def line(
    tracker: str,
    style: Style,
    x: Sequence[float],
    y: NDArray[np.float64],
    hover: str,
    decimals: int = 2,
) -> dict[str, Any]:
    """Return the line of one tracker, with the template of its hover label."""
    return scatter(
        tracker,
        name=tracker,
        x=list(x),
        y=rounded(y, decimals),
        line={"color": style.color, "width": 2, "dash": style.dash},
        hovertemplate=f"{hover}<extra>{tracker}</extra>",
    )


def band(
    tracker: str,
    style: Style,
    x: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> dict[str, Any]:
    """Return the band of one tracker, to be drawn below its line."""
    return scatter(
        tracker,
        x=rounded(np.concatenate([x, x[::-1]]), 4),
        y=rounded(np.concatenate([high, low[::-1]]), 4),
        fill="toself",
        fillcolor=style.faded(0.12),
        line={"width": 0},
        hoverinfo="skip",
    )


def dotted_line(
    axis: str, value: float, color: str = GREY, layer: str = "below"
) -> dict[str, Any]:
    """Return a dotted line through the whole plot at a value of the x or y axis."""
    other = "y" if axis == "x" else "x"
    return {
        "type": "line",
        f"{axis}0": value,
        f"{axis}1": value,
        f"{other}ref": "paper",
        f"{other}0": 0,
        f"{other}1": 1,
        "line": {"color": color, "width": 1, "dash": "dot"},
        "layer": layer,
    }


def rounded(values: NDArray[np.float64], decimals: int) -> list[float | None]:
    """Return rounded numbers for JSON; None for what is not finite."""
    finite = np.isfinite(values).tolist()
    return [
        round(value, decimals) if is_finite else None
        for value, is_finite in zip(values.tolist(), finite, strict=True)
    ]
