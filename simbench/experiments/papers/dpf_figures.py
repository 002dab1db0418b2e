"""Figures of the directional particle filter's page: weights, paths, distances."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.experiments.papers.charts import INK, Line, Panel, chart, styled_lines
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.run_figures import clouds_of, padded, path_figure
from simbench.experiments.papers.settings import SETTINGS
from simbench.experiments.papers.study import Drawing, FilmOf

if TYPE_CHECKING:
    from simbench.trackers.parts.particle_cloud import ParticleCloud

__all__ = ["draw"]

Floats = NDArray[np.float64]
_FILTERS: Final = ("condensation", "directional-90", "directional-45", "directional-22")
_ANGLES: Final = dict(zip(_FILTERS[1:], ("pi/2", "pi/4", "pi/8"), strict=True))
_VIDEOS: Final = {"trees-dusk": 1, "poles": 2, "bridge": 3}
_NUMBERS: Final = {1: "8 to 10", 2: "11 to 13", 3: "14 to 16"}
_STEADY_FRAMES: Final = 20  # by then every filter knows a course
_COLORS: Final = ("#D55E00", "#009E73", "#CC79A7")


def draw(measured: Measured, film_of: FilmOf) -> list[Drawing]:
    """Return the figures of the paper, in the paper's setting and in ours."""
    seed = measured.seeds[0]
    drawings = []
    film = film_of("poles", seed)
    for setting in SETTINGS:
        specs = {name: measured.spec(name, setting) for name in _FILTERS}
        drawings.append(_weights_figure(film, specs, setting))
        drawings += [
            path_figure(
                measured,
                place,
                seed,
                specs,
                f"video{number}-{setting}",
                f"Figures {_NUMBERS[number]}",
            )
            for place, number in _VIDEOS.items()
            if place in measured.places
        ]
    drawings.append(_course_figure(film_of("lane-change", seed), measured))
    return drawings


def _weights_figure(film: Sequence, specs: dict[str, str], setting: str) -> Drawing:
    """Figures 4 to 7: weights against the angle to the direction of motion."""
    clouds = {name: clouds_of(film, spec) for name, spec in specs.items()}
    frame = _steady_frame(film, [clouds[name] for name in _FILTERS[1:]])
    plain = clouds["condensation"][frame]
    gated = {name: clouds[name][frame] for name in _FILTERS[1:]}
    equal = np.full(len(plain.weights), 1.0 / len(plain.weights))
    spread = plain.angles if math.isnan(plain.theta) else _turns(plain)
    first = [Line("condensation", np.degrees(spread), equal, "#0072B2", is_points=True)]
    after = [Line("", np.degrees(spread), plain.weights, "#0072B2", is_points=True)]
    alone, both = [], []
    for (name, cloud), color in zip(gated.items(), _COLORS, strict=True):
        share = cloud.factors / max(float(cloud.factors.sum()), 1e-12)
        x = np.degrees(_turns(cloud))
        alone.append(Line(_ANGLES[name], x, share, color, is_points=True))
        both.append(Line("", x, cloud.weights, color, is_points=True))
    panels = [
        _weights_panel("4: before the measurement", first),
        _weights_panel("5: after it, condensation", after),
        _weights_panel("6: the gate alone", alone),
        _weights_panel("7: gate and measurement", both),
    ]
    caption = (
        f"Figures 4 to 7, {setting}: weights of the particles against their angle to "
        f"the smoothed direction; poles, seed {film.seed}, frame {frame + 1}."
    )
    return Drawing(f"weights-{setting}", chart(caption, panels), caption)


def _weights_panel(title: str, lines: list[Line]) -> Panel:
    most = max(float(np.nanmax(one.y)) for one in lines)
    titles = "angle to the direction of motion, degrees", "weight"
    return Panel(title, *titles, lines, (-180.0, 180.0), (0.0, 1.15 * most))


def _steady_frame(film: Sequence, clouds: list[list[ParticleCloud]]) -> int:
    """Return a frame, less one, in which all gates are closed and nothing is hidden."""
    visible = film.truth.visible_fraction[1:]
    for index in range(min(_STEADY_FRAMES, len(visible) - 1), len(visible)):
        is_gated = all(math.isfinite(one[index].half_angle) for one in clouds)
        if is_gated and visible[index] > 0.99:
            return index
    return len(visible) - 1


def _turns(cloud: ParticleCloud) -> Floats:
    """Return the signed angles of particles to the direction of motion, rad."""
    turn = cloud.angles - cloud.theta
    return np.asarray((turn + np.pi) % (2.0 * np.pi) - np.pi, dtype=np.float64)


def _course_figure(film: Sequence, m: Measured) -> Drawing:
    """Equation 7: the smoothed direction against the true one, in a lane change."""
    boxes = film.truth.boxes
    centres = boxes[:, :2] + boxes[:, 2:] / 2.0
    # frames to each side: the true direction of single steps is jitter
    reach = min(4, (len(centres) - 1) // 2)
    steps = centres[2 * reach :] - centres[: -2 * reach]
    true = np.degrees(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
    frames = np.arange(len(true), dtype=np.float64) + reach
    lines = [Line("true direction", frames, true, INK, "3 3")]
    labels = [m.spec("directional-45", setting) for setting in SETTINGS]
    curves = []
    for spec in labels:
        theta = np.array([one.theta for one in clouds_of(film, spec)])
        degrees = np.degrees(theta)
        turns = 360.0 * np.round((np.nanmean(true) - degrees) / 360.0)
        curves.append((np.arange(1.0, len(theta) + 1.0), degrees + turns))
    lines += styled_lines(labels, curves)
    every = np.concatenate([one.y for one in lines])
    panel = Panel(
        "direction in the image",
        "frame",
        "degrees",
        lines,
        (0.0, float(len(boxes) - 1)),
        padded(every[np.isfinite(every)]),
    )
    caption = (
        f"Equation 7: the direction that the filter searches with, which turns by one "
        f"degree a frame, against the true one; lane-change, seed {film.seed}."
    )
    return Drawing("course", chart(caption, [panel], width=640), caption)
