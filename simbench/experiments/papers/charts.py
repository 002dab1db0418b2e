"""Line charts and point charts as SVG files: panels with axes, legend and shading."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simbench.report.palette import tracker_styles
from simbench.report.svg import document, label, mark, path, rectangle, segment

__all__ = ["Line", "Panel", "chart", "nice_ticks", "styled_lines"]

Floats = NDArray[np.float64]
INK: Final = "#1f2933"
_GRID: Final = "#e5e7eb"
_SHADE: Final = "#eceff3"
_DASHES: Final = {"solid": "", "dash": "7 4", "dot": "2 3", "dashdot": "7 3 2 3"}
_LEFT, _TOP, _RIGHT, _BOTTOM = 58, 30, 12, 44  # margins of a panel, px
_ROW = 20  # of the legend, px
_MOST_POINTS = 320  # of a line: a chart is 400 px wide


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """One line or cloud of points.

    Attributes
    ----------
    label : str
        In the legend, once for all panels.
    x, y : (n,) float
        NaN where there is a gap.
    color : str
    dash : str
        Of SVG; empty for a solid line.
    is_points : bool
    """

    label: str
    x: Floats
    y: Floats
    color: str = INK
    dash: str = ""
    is_points: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """A plot with two axes.

    Attributes
    ----------
    title, x_title, y_title : str
    lines : list of Line
    x_range, y_range : (float, float)
        What is shown; the first may be the larger, for pictures, whose y points down.
        What is outside is left out.
    shaded : list of (float, float)
        Spans of x on a grey ground.
    is_logarithmic : bool
        Whether both axes are; then ranges are above 0.
    """

    title: str
    x_title: str
    y_title: str
    lines: list[Line]
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    shaded: list[tuple[float, float]] = field(default_factory=list)
    is_logarithmic: bool = False


def styled_lines(
    labels: Sequence[str], curves: Sequence[tuple[ArrayLike, ArrayLike]]
) -> list[Line]:
    """Return lines in the colours that the report gives to trackers in this order."""
    styles = tracker_styles(labels)
    return [
        Line(
            name,
            np.asarray(x, dtype=np.float64),
            np.asarray(y, dtype=np.float64),
            styles[name].color,
            _DASHES[styles[name].dash],
        )
        for name, (x, y) in zip(labels, curves, strict=True)
    ]


def chart(
    title: str,
    panels: Sequence[Panel],
    *,
    columns: int = 2,
    width: int = 430,
    height: int = 300,
) -> str:
    """Return panels in rows with one legend above them, as an SVG file.

    Parameters
    ----------
    title : str
        For those who cannot see the figure.
    panels : sequence of Panel
    columns : int
        Panels in a row.
    width, height : int, px
        Of a panel with its margins.
    """
    columns = min(columns, len(panels))
    rows = math.ceil(len(panels) / columns)
    named = {one.label: one for panel in panels for one in panel.lines if one.label}
    legend, top = _legend(list(named.values()), columns * width)
    parts = [*legend]
    for index, panel in enumerate(panels):
        row, column = divmod(index, columns)
        parts += _panel(panel, column * width, top + row * height, width, height)
    return document(columns * width, top + rows * height, title, parts)


def nice_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Return round numbers in a range, at most about ``most``.

    Examples
    --------
    >>> nice_ticks(0.0, 150.0)
    [0.0, 50.0, 100.0, 150.0]
    """
    low, high = min(low, high), max(low, high)
    if not high > low:
        return [low]
    raw = (high - low) / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(s * power for s in (1, 2, 5, 10) if s * power >= raw * (1 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    count = math.floor(high / step + 1e-9) - first + 1
    return [round((first + index) * step, 12) for index in range(count)]


def _legend(lines: Sequence[Line], width: float) -> tuple[list[str], int]:
    parts, x, y = [], 14.0, 16.0
    for one in lines:
        needed = 44.0 + 7.2 * len(one.label)
        if x > 14.0 and x + needed > width:
            x, y = 14.0, y + _ROW
        if one.is_points:
            parts.append(mark(x + 12, y - 4, one.color, 3.0))
        else:
            ends = [(x, y - 4.0), (x + 24.0, y - 4.0)]
            parts.append(path(ends, one.color, one.dash, width=2.0))
        parts.append(label(x + 30, y, one.label))
        x += needed
    return parts, int(y) + 8 if lines else 0


def _panel(
    panel: Panel, left: float, top: float, width: float, height: float
) -> list[str]:
    x0, x1 = left + _LEFT, left + width - _RIGHT
    y0, y1 = top + height - _BOTTOM, top + _TOP
    to_x = _Axis(*panel.x_range, x0, x1, panel.is_logarithmic)
    to_y = _Axis(*panel.y_range, y0, y1, panel.is_logarithmic)
    parts = []
    for begin, end in panel.shaded:
        first, last = sorted((to_x(begin), to_x(end)))
        first, last = max(first, x0), min(last, x1)
        if last > first:
            parts.append(rectangle(first, y1, last - first, y0 - y1, _SHADE))
    for value in to_y.ticks():
        parts.append(segment(x0, to_y(value), x1, to_y(value), _GRID))
        parts.append(label(x0 - 7, to_y(value) + 4, f"{value:g}", "end"))
    for value in to_x.ticks():
        parts.append(segment(to_x(value), y0, to_x(value), y0 + 4, INK))
        parts.append(label(to_x(value), y0 + 18, f"{value:g}", "middle"))
    parts += [segment(x0, y0, x1, y0, INK), segment(x0, y0, x0, y1, INK)]
    parts.append(label(x0, top + 18, panel.title))
    parts.append(label((x0 + x1) / 2, y0 + 36, panel.x_title, "middle"))
    parts.append(label(x1, y1 - 12, panel.y_title, "end", "#52606d"))
    for one in panel.lines:
        parts += _drawn(one, to_x, to_y)
    return parts


@dataclass(frozen=True, slots=True)
class _Axis:
    """A mapping from values to px."""

    low: float
    high: float
    start: float
    end: float
    is_logarithmic: bool

    def __call__(self, value: float) -> float:
        low, high = self.low, self.high
        if self.is_logarithmic:
            value, low, high = (math.log10(one) for one in (value, low, high))
        share = (value - low) / (high - low)
        return self.start + share * (self.end - self.start)

    def holds(self, values: Floats) -> NDArray[np.bool_]:
        low, high = sorted((self.low, self.high))
        held: NDArray[np.bool_] = (values >= low) & (values <= high)
        return held

    def ticks(self) -> list[float]:
        if not self.is_logarithmic:
            return nice_ticks(self.low, self.high)
        first, last = (round(math.log10(one), 9) for one in (self.low, self.high))
        powers = range(math.floor(first), math.ceil(last) + 1)
        every = [s * 10.0**power for power in powers for s in (1, 2, 5)]
        return [one for one in every if self.low <= one <= self.high]


def _drawn(line: Line, to_x: _Axis, to_y: _Axis) -> list[str]:
    inside = to_x.holds(line.x) & to_y.holds(line.y)
    if line.is_points:
        return [
            mark(to_x(x), to_y(y), line.color, 2.0)
            for x, y in zip(line.x[inside], line.y[inside], strict=True)
        ]
    step = max(1, math.ceil(len(line.x) / _MOST_POINTS))
    parts, points = [], []
    for x, y, is_in in zip(line.x[::step], line.y[::step], inside[::step], strict=True):
        if is_in:
            points.append((to_x(float(x)), to_y(float(y))))
        if points and not is_in:
            parts.append(path(points, line.color, line.dash, width=1.6))
            points = []
    if points:
        parts.append(path(points, line.color, line.dash, width=1.6))
    return parts
