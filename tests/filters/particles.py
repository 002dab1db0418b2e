"""Time of a frame against the number of particles.

``python -m tests.filters.particles``, or ``make particles``, alone on the machine,
writes ``docs/particles.svg`` and prints the numbers as a table for the page beside it.
The clip is the one of ``make bench``, which every filter holds; dsp runs all of its
rounds, since where it stops early depends on the picture.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from threadpoolctl import threadpool_limits

from simbench.core.atomic_write import atomic_write
from simbench.core.box import Box
from simbench.report import svg
from simbench.report.comparison_text import markdown_table
from simbench.report.palette import tracker_styles
from simbench.trackers.find_tracker import find_tracker
from tests.beside.checkout import ROOT
from tests.trackers.clips import Clip, render_clip, straight

PICTURE: Final = ROOT / "docs" / "particles.svg"
COUNTS: Final = (50, 100, 200, 500, 1000, 2000, 5000, 10_000)
TRACKERS: Final = ("condensation", "directional-45", "dsp@stop=1.1")
_MOST_UPDATES, _LEAST_UPDATES, _ENOUGH_S = 40, 5, 2.0
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 640.0, 400.0, 64.0, 150.0, 24.0, 52.0

Times = dict[str, list[float]]
_Place = Callable[[float, float], tuple[float, float]]


def easy_clip() -> Clip:
    """Return the clip of ``make bench``."""
    centres = straight(80, (150, 240), (3.0, 0.4))
    return render_clip(centres, np.full(80, 40.0), size=(720, 480))


def frame_ms(spec: str, particles: int, clip: Clip) -> float:
    """Return the median time of an update, ms."""
    tracker = find_tracker(f"{spec}@particles={particles}").make()
    first = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], first, np.random.default_rng(0))
    took: list[float] = []
    for frame in clip.frames[1:]:
        if len(took) >= _MOST_UPDATES:
            break
        if len(took) >= _LEAST_UPDATES and sum(took) > _ENOUGH_S:
            break
        began = time.perf_counter()
        tracker.update(frame)
        took.append(time.perf_counter() - began)
    return 1e3 * float(np.median(took))


def measured(
    clip: Clip,
    counts: Sequence[int] = COUNTS,
    trackers: Sequence[str] = TRACKERS,
    rounds: int = 3,
) -> Times:
    """Return the least of some median times by tracker, for each count, ms."""
    times: Times = {spec: [math.inf] * len(counts) for spec in trackers}
    with threadpool_limits(1):  # as trackers run
        for _ in range(rounds):  # in turn: all see the same load
            for index, count in enumerate(counts):
                for spec in trackers:
                    took = frame_ms(spec, count, clip)
                    times[spec][index] = min(times[spec][index], took)
    return times


def drawing(counts: Sequence[int], times: Mapping[str, Sequence[float]]) -> str:
    """Return the plot, both axes logarithmic; a dotted line is linear in particles."""
    names = {spec: spec.partition("@")[0] for spec in times}
    styles = tracker_styles([*names.values()])
    every = [each for of in times.values() for each in of]
    low, high = math.floor(math.log10(min(every))), math.ceil(math.log10(max(every)))
    left, right = math.log10(min(counts)), math.log10(max(counts))

    def place(count: float, ms: float) -> tuple[float, float]:
        across = (math.log10(count) - left) / (right - left)
        up = (math.log10(ms) - low) / (high - low)
        return (
            _LEFT + across * (_WIDTH - _LEFT - _RIGHT),
            _HEIGHT - _BOTTOM - up * (_HEIGHT - _TOP - _BOTTOM),
        )

    parts = _axes(place, counts, range(low, high + 1))
    for spec, of in times.items():
        color = styles[names[spec]].color
        last = counts[-1], of[-1]
        start = max(counts[0], counts[-1] * 10.0**low / of[-1])
        parts.append(
            svg.path(
                [place(start, of[-1] * start / last[0]), place(*last)], color, "2 4"
            )
        )
        points = [place(*each) for each in zip(counts, of, strict=True)]
        parts += [
            svg.path(points, color),
            *(svg.circle(*each, color) for each in points),
        ]
        x, y = points[-1]
        parts.append(svg.label(x + 10.0, y + 4.0, names[spec], color=color))
    title = "Time of a frame against the number of particles"
    return svg.document(_WIDTH, _HEIGHT, title, parts)


def table(counts: Sequence[int], times: Mapping[str, Sequence[float]]) -> str:
    """Return milliseconds a frame as Markdown."""
    rows = [
        [str(count), *(f"{of[index]:.2f}" for of in times.values())]
        for index, count in enumerate(counts)
    ]
    names = [f"{spec.partition('@')[0]}, ms" for spec in times]
    return markdown_table(["particles", *names], rows)


def _axes(place: _Place, counts: Sequence[int], decades: range) -> list[str]:
    grey, faint = "#9aa5b1", "#e5e7eb"
    first, last = counts[0], counts[-1]
    parts = []
    for decade in decades:
        (x0, y), (x1, _) = place(first, 10.0**decade), place(last, 10.0**decade)
        parts.append(svg.segment(x0, y, x1, y, faint))
        parts.append(svg.label(x0 - 8.0, y + 4.0, f"{10.0**decade:g}", "end"))
    bottom, top = 10.0 ** decades[0], 10.0 ** decades[-1]
    for count in counts:
        x, y = place(count, bottom)
        parts.append(svg.segment(x, y, x, y + 4.0, grey))
        parts.append(svg.label(x, y + 20.0, f"{count:,}", "middle"))
    (x0, y0), (x1, _), (_, y1) = (
        place(first, bottom),
        place(last, bottom),
        place(1, top),
    )
    parts += [svg.segment(x0, y0, x1, y0, grey), svg.segment(x0, y0, x0, y1, grey)]
    parts.append(svg.label(0.5 * (x0 + x1), y0 + 42.0, "particles", "middle"))
    return [*parts, svg.label(x0 + 8.0, y1 - 8.0, "ms a frame; dotted: linear")]


def main(picture: Path = PICTURE) -> None:
    """Write the plot, and print the table."""
    times = measured(easy_clip())
    with atomic_write(picture) as temporary:
        temporary.write_text(drawing(COUNTS, times), encoding="utf-8")
    print(table(COUNTS, times))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
