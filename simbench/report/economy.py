"""Figure and table of the particle economy: scores against particles used."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from simbench.evaluation.statistics.intervals import describe_interval
from simbench.evaluation.statistics.particle_economy import PRECISION, Cost, Economy
from simbench.report.palette import Style
from simbench.report.plotting import GREY, INK
from simbench.report.svg import circle, document, label, path, segment
from simbench.report.text import fixed

__all__ = ["economy_figure", "economy_rows"]

_WIDTH: Final = 640.0
_HEIGHT: Final = 340.0
_LEFT: Final = 52.0
_RIGHT: Final = 150.0
_TOP: Final = 16.0
_BOTTOM: Final = 46.0
_STEPS: Final = (1, 2, 5)


def economy_rows(economy: Economy) -> list[tuple[str, ...]]:
    """Return tracker, particles, precision, success, on the front, particles needed.

    The particles needed for the precision asked for stand beside the last tracker of a
    family.
    """
    last = {cost.family: cost.tracker for cost in economy.costs}
    rows: list[tuple[str, ...]] = []
    for cost in economy.costs:
        needed = economy.needed[cost.family]
        text = "not reached" if math.isnan(needed) else f"{needed:.0f}"
        nan = float("nan")
        interval = describe_interval(cost.low, cost.high, nan, nan, 2)
        rows.append(
            (
                cost.tracker,
                fixed(cost.particles, 1),
                f"{fixed(cost.precision, 2)} {interval}".rstrip(),
                fixed(cost.success, 2),
                "yes" if cost.is_on_front else "",
                text if last[cost.family] == cost.tracker else "",
            )
        )
    return rows


def economy_figure(economy: Economy, styles: Mapping[str, Style]) -> str:
    """Return precision (filled) and success (open) against particles, as SVG.

    The line in ink is the Pareto front of precision: no tracker left of it is as
    precise. Trackers of one family are joined. Empty where no tracker uses particles.
    """
    if not economy.costs:
        return ""
    used = [cost.particles for cost in economy.costs]
    low, high = min(used) / 1.6, max(used) * 1.6

    def x(particles: float) -> float:
        share = math.log(particles / low) / math.log(high / low)
        return _LEFT + share * (_WIDTH - _LEFT - _RIGHT)

    def y(score: float) -> float:
        return _HEIGHT - _BOTTOM - score * (_HEIGHT - _TOP - _BOTTOM)

    parts = _axes(x, y, low, high)
    parts.append(segment(_LEFT, y(PRECISION), _WIDTH - _RIGHT, y(PRECISION), GREY))
    families: dict[str, list[Cost]] = {}
    for cost in economy.costs:
        families.setdefault(cost.family, []).append(cost)
    for members in families.values():
        color = styles[members[0].tracker].color
        points = [(x(cost.particles), y(cost.precision)) for cost in members]
        parts.append(path(points, color, "4 3"))
    front = [
        (x(cost.particles), y(cost.precision))
        for cost in economy.costs
        if cost.is_on_front
    ]
    parts.append(path(front, INK))
    for cost in economy.costs:
        color = styles[cost.tracker].color
        place = x(cost.particles)
        parts.append(circle(place, y(cost.success), color, is_filled=False))
        parts.append(circle(place, y(cost.precision), color))
        parts.append(label(place + 8, y(cost.precision) - 6, cost.tracker))
    title = "Scores against particles used"
    return document(_WIDTH, _HEIGHT, title, parts, is_file=False)


def _axes(
    x: Callable[[float], float], y: Callable[[float], float], low: float, high: float
) -> list[str]:
    """Return the axes: particles on a logarithmic scale, scores from 0 to 1."""
    bottom, right = y(0.0), _WIDTH - _RIGHT
    parts = [
        segment(_LEFT, bottom, right, bottom, INK),
        segment(_LEFT, bottom, _LEFT, _TOP, INK),
    ]
    for tenth in range(0, 11, 2):
        parts.append(segment(_LEFT - 4, y(tenth / 10), _LEFT, y(tenth / 10), INK))
        parts.append(label(_LEFT - 8, y(tenth / 10) + 4, f"{tenth / 10:g}", "end"))
    decade = 10.0 ** math.floor(math.log10(low))
    while decade <= high:
        for step in _STEPS:
            value = decade * step
            if low <= value <= high:
                parts.append(segment(x(value), bottom, x(value), bottom + 4, INK))
                parts.append(label(x(value), bottom + 18, f"{value:g}", "middle"))
        decade *= 10.0
    middle = 0.5 * (_LEFT + right)
    parts.append(label(middle, _HEIGHT - 8, "particles per frame", "middle"))
    return parts
