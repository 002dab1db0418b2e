"""What all figures are made of: layout, lines and numbers as plotly has them.

A figure is plain data: traces and a layout. Each trace names its tracker in ``meta``,
by which the page shows and hides it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.report.palette import Style

__all__ = ["INK", "Figure", "band", "base_layout", "guide", "line", "plain"]

Figure = dict[str, Any]  # plotly's own JSON: {"data": [...], "layout": {...}}

INK: Final = "#1f2933"
_GRID: Final = "#e5e7eb"


def base_layout(x_title: str, y_title: str, height: int) -> dict[str, Any]:
    """Return the layout that all figures share; shares run from 0 to 1."""
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


def line(
    tracker: str,
    style: Style,
    x: Sequence[float],
    y: NDArray[np.float64],
    hover: str,
    decimals: int = 2,
) -> dict[str, Any]:
    """Return the line of one tracker, with what to say where it is pointed at."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": tracker,
        "x": list(x),
        "y": plain(y, decimals),
        "line": {"color": style.color, "width": 2, "dash": style.dash},
        "hovertemplate": f"{hover}<extra>{tracker}</extra>",
        "meta": {"tracker": tracker},
    }


def band(
    tracker: str,
    style: Style,
    x: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> dict[str, Any]:
    """Return the band of one tracker, to lie below its line."""
    return {
        "type": "scatter",
        "mode": "lines",
        "x": plain(np.concatenate([x, x[::-1]]), 4),
        "y": plain(np.concatenate([high, low[::-1]]), 4),
        "fill": "toself",
        "fillcolor": style.faded(0.12),
        "line": {"width": 0},
        "hoverinfo": "skip",
        "meta": {"tracker": tracker},
    }


def guide(x: float) -> dict[str, Any]:
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


def plain(values: NDArray[np.float64], decimals: int) -> list[float | None]:
    """Return numbers as JSON has them: rounded, None for what is not finite."""
    return [
        round(value, decimals) if np.isfinite(value) else None
        for value in values.tolist()
    ]
