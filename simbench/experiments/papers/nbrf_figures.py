"""Figures of the neural-Bayesian resampling filter's page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence as Film
from simbench.evaluation.run_tracker import track
from simbench.experiments.papers.charts import INK, Line, Panel, chart, styled_lines
from simbench.experiments.papers.instances import FAR_SIDES, normalised_distance
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.nbrf_trackers import COUNTS, FILMS, with_count
from simbench.experiments.papers.settings import SETTINGS
from simbench.experiments.papers.study import Drawing, FilmOf
from simbench.trackers.find_tracker import find_tracker

__all__ = ["draw"]

Floats = NDArray[np.float64]
_CLOUD_FRAME: Final = 6
_BY_FRAME: Final = {
    "Figure 4": ("ball-low-rate", (("sirbf", 100), ("sirbf", 1000), ("nbrf", 100))),
    "Figure 5": (
        "ball-low-rate",
        (
            ("sirbf", 100),
            ("sirbf", 400),
            ("sirbf", 600),
            ("sirbf", 800),
            ("sirbf", 1000),
            ("nbrf", 50),
            ("nbrf", 100),
        ),
    ),
    "Figures 6 and 7": (
        "ball-bounce",
        (("sirbf", 150), ("sirbf", 1000), ("nbrf", 150), ("nbrf", 10)),
    ),
    "Figure 8": ("ball-both", (("sirbf", 100), ("nbrf", 100))),
}


def draw(measured: Measured, film_of: FilmOf) -> list[Drawing]:
    """Return the figures of the paper, in the paper's setting and in ours."""
    m = measured
    drawings = []
    for setting in SETTINGS:
        if m.spec(with_count("sirbf", 100), setting) in set(m.table["tracker"]):
            film = film_of(FILMS[0], m.seeds[0])
            drawings.append(_clouds(film, m, setting))
            drawings.append(_by_count(m, setting))
        drawings += [
            one
            for figure, (film_name, trackers) in _BY_FRAME.items()
            if film_name in m.places
            and (one := _by_frame(m, film_name, trackers, figure, setting))
        ]
    return drawings


def _clouds(film: Film, m: Measured, setting: str) -> Drawing:
    """Figure 1: where few and many particles look for the target."""
    frame = min(_CLOUD_FRAME, len(film) - 1)
    truth = film.truth.boxes[frame]
    centre = truth[:2] + truth[2:] / 2.0
    panels = []
    for count in (COUNTS[1], COUNTS[-1]):
        spec = m.spec(with_count("sirbf", count), setting) + "@keep_cloud=true"
        found = find_tracker(spec)
        run = track(found.make(), film, label=found.label, keep_clouds=True)
        cloud = run.clouds[frame]
        places = np.empty((0, 2)) if cloud is None else cloud[:, :2]
        lines = [
            Line("particles", places[:, 0], places[:, 1], "#0072B2", is_points=True),
            Line("target", centre[:1], centre[1:], "#D55E00", is_points=True),
        ]
        ends = (0.0, float(film.width)), (float(film.height), 0.0)
        panels.append(
            Panel(f"{count} particles", "x, px", "y, px (down)", lines, *ends)
        )
    caption = (
        f"Figure 1, {setting}: places that sirbf looks at in frame {frame} of "
        f"{film.name}, seed {film.seed}."
    )
    return Drawing(f"places-{setting}", chart(caption, panels), caption)


def _by_count(m: Measured, setting: str) -> Drawing:
    """Figure 2: error and cost by the number of particles, with N and its cube."""
    counts = np.array(COUNTS, dtype=np.float64)
    labels, errors, seconds = [], [], []
    for name in ("sirbf", "nbrf"):
        specs = [m.spec(with_count(name, count), setting) for count in COUNTS]
        found = [m.values(FILMS, spec, "distance").mean() for spec in specs]
        rates = [m.values(FILMS, spec, "fps").mean() for spec in specs]
        if np.isfinite(found).any():
            labels.append(name)
            errors.append((counts, np.array(found)))
            seconds.append((counts, 1e3 / np.array(rates)))
    first = float(seconds[0][1][0])
    costs = styled_lines(labels, seconds)
    costs.append(Line("in proportion to N", counts, first * counts / 50, INK, "3 3"))
    cube = first * (counts / 50.0) ** 3
    costs.append(Line("its cube", counts, cube, "#9aa5b1", "7 4"))
    most = float(np.nanmax([one for _, one in errors]))
    ends = (40.0, 2000.0)
    slowest = float(np.nanmax([one for _, one in seconds]))
    panels = [
        Panel(
            "distance, mean of all films",
            "particles",
            "sides",
            styled_lines(labels, errors),
            (0.0, 1550.0),
            (0.0, 1.1 * most),
        ),
        Panel(
            "time of a frame",
            "particles",
            "ms",
            costs,
            ends,
            (first / 2.0, 20.0 * slowest),
            is_logarithmic=True,
        ),
    ]
    caption = f"Figure 2, {setting}: error and cost by the number of particles."
    return Drawing(f"counts-{setting}", chart(caption, panels), caption)


def _by_frame(
    m: Measured,
    film: str,
    trackers: Sequence[tuple[str, int]],
    figure: str,
    setting: str,
) -> Drawing | None:
    """Return distances by frame of one film, and their median over all films."""
    specs = {
        f"{name}, {count}": m.spec(with_count(name, count), setting)
        for name, count in trackers
    }
    seed = m.seeds[0]
    runs = {
        label: [m.frames(film, one, spec) for one in m.seeds]
        for label, spec in specs.items()
        if len(m.frames(film, seed, spec))
    }
    if not runs:
        return None
    labels = list(runs)
    single, median = [], []
    for of_seeds in runs.values():
        sides = [normalised_distance(run) for run in of_seeds if len(run)]
        x = np.arange(len(sides[0]), dtype=np.float64)
        single.append((x, np.minimum(sides[0], FAR_SIDES)))
        length = min(map(len, sides))
        middle = np.median(
            [np.minimum(one[:length], FAR_SIDES) for one in sides], axis=0
        )
        median.append((x[:length], middle))
    ends = (0.0, float(len(single[0][0]) - 1)), (0.0, 1.02 * FAR_SIDES)
    titles = "frame", "distance, sides"
    panels = [
        Panel(f"{film}, seed {seed}", *titles, styled_lines(labels, single), *ends),
        Panel(
            f"median of {len(m.seeds)} films",
            *titles,
            styled_lines(labels, median),
            *ends,
        ),
    ]
    caption = (
        f"{figure}, {setting}: distance by frame on {film}, in longer sides of "
        f"the target, at most {FAR_SIDES:g}."
    )
    name = f"{figure.lower().replace(' ', '-')}-{setting}"
    return Drawing(name, chart(caption, panels), caption)
