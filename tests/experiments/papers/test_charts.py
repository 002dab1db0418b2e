from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from simbench.experiments.papers.charts import Line, Panel, chart, nice_ticks

SVG = "{http://www.w3.org/2000/svg}"


def _chart(*lines: Line, shaded: list[tuple[float, float]] | None = None) -> str:
    panel = Panel("p", "x", "y", list(lines), (0.0, 10.0), (0.0, 1.0), shaded or [])
    return chart("A title & more", [panel])


def test_line_breaks_where_it_leaves_the_panel_or_is_unknown() -> None:
    y = np.array([0.1, 0.2, np.nan, 0.3, 5.0, 0.4])
    root = ElementTree.fromstring(_chart(Line("one", np.arange(6.0), y)))
    drawn = root.findall(f"{SVG}polyline")
    # that of the legend, and three pieces: 2, 1 and 1 points
    assert [len(str(one.get("points")).split()) for one in drawn] == [2, 2, 1, 1]


def test_points_outside_the_panel_are_left_out() -> None:
    points = Line("", np.array([1.0, 20.0]), np.array([0.5, 0.5]), is_points=True)
    root = ElementTree.fromstring(_chart(points))
    assert len(root.findall(f"{SVG}circle")) == 1


def test_shading_ends_at_the_panel() -> None:
    line = Line("one", np.array([0.0]), np.array([0.0]))
    plain = ElementTree.fromstring(_chart(line))
    shaded = ElementTree.fromstring(_chart(line, shaded=[(8.0, 99.0), (50.0, 60.0)]))
    more = len(shaded.findall(f"{SVG}rect")) - len(plain.findall(f"{SVG}rect"))
    assert more == 1
    grey = shaded.findall(f"{SVG}rect")[1]
    assert float(grey.get("x", 0)) + float(grey.get("width", 0)) == pytest.approx(418.0)


def test_chart_is_the_same_in_every_call() -> None:
    line = Line("one", np.arange(500.0) / 50.0, np.linspace(0.0, 1.0, 500))
    assert _chart(line) == _chart(line)
    assert len(_chart(line)) < 8000


def test_ticks_are_round_numbers_within_the_range() -> None:
    assert nice_ticks(1.0, 0.0) == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    assert nice_ticks(-33.0, 41.0) == [-20.0, 0.0, 20.0, 40.0]
    assert nice_ticks(2.0, 2.0) == [2.0]
