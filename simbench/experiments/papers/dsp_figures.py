"""Figures of the dynamic swarm particle's page: curves, confidence and usage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.evaluation.measures.track_measures import (
    PRECISION_THRESHOLDS,
    SUCCESS_THRESHOLDS,
    precision_curve,
    success_curve,
)
from simbench.experiments.papers.charts import Line, Panel, chart, styled_lines
from simbench.experiments.papers.dsp_trackers import (
    CLASSICS,
    DEEP,
    FAMILY,
    FAST,
    FEW,
    SLOW,
)
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.run_figures import hidden_spans, path_figure
from simbench.experiments.papers.settings import SETTINGS
from simbench.experiments.papers.study import Drawing, FilmOf

__all__ = ["draw"]

Floats = NDArray[np.float64]
_USAGE_FILMS: Final = (
    "car003@fast60",
    "car003@fast100",
    "motorcycle001@fast60",
    "motorcycle001@fast40",
)
_LOOK_ALIKES: Final = "racing"


def draw(measured: Measured, film_of: FilmOf) -> list[Drawing]:
    """Return the figures of the paper, in the paper's setting and in ours."""
    m, seed = measured, measured.seeds[0]
    drawings = []
    for setting in SETTINGS:
        drawings.append(_curves(m, FAST, f"fast-{setting}", "Figures 11 and 12"))
        if SLOW in m.places:
            drawings.append(_curves(m, [SLOW], f"slow-{setting}", "Figures 15 and 16"))
        films = [one for one in _USAGE_FILMS if one in m.places]
        spec = m.spec(FEW, setting)
        if any(len(m.frames(film, seed, spec)) for film in films):
            drawings.append(_usage(m, films, spec, f"usage-{setting}"))
        if _LOOK_ALIKES in m.places:
            names = ("dsp", "gdpf-fix", "kcf", "csk")
            specs = {name: m.spec(name, setting) for name in names}
            name = f"look-alikes-{setting}"
            path = path_figure(m, _LOOK_ALIKES, seed, specs, name, "Figure 21")
            drawings.append(path)
    return drawings


def _curves(m: Measured, places: Sequence[str], name: str, figures: str) -> Drawing:
    """Return precision and success curves, means over films."""
    setting = name.rpartition("-")[2]
    specs = {one: m.spec(one, setting) for one in ("dsp", *FAMILY, *CLASSICS, *DEEP)}
    labels = [one for one, spec in specs.items() if len(m.values(places, spec, "held"))]
    panels = [
        Panel(
            title,
            x_title,
            "share of frames",
            styled_lines(
                labels,
                [
                    (thresholds, _mean_curve(m, places, specs[one], column, shares))
                    for one in labels
                ],
            ),
            (0.0, float(thresholds[-1])),
            (0.0, 1.02),
        )
        for title, x_title, thresholds, column, shares in (
            (
                "precision",
                "error at most, px",
                PRECISION_THRESHOLDS,
                "center_error_px",
                precision_curve,
            ),
            ("success", "overlap above", SUCCESS_THRESHOLDS, "overlap", success_curve),
        )
    ]
    count = max(
        (len(m.values(places, specs[one], "held")) for one in labels), default=0
    )
    caption = f"{figures}, {setting}: mean over {count} films."
    return Drawing(name, chart(caption, panels), caption)


def _mean_curve(
    m: Measured,
    places: Sequence[str],
    spec: str,
    column: str,
    shares: Callable[[Floats], Floats],
) -> Floats:
    curves = []
    for place in places:
        for seed in m.seeds:
            frames = m.frames(place, seed, spec)
            values = frames.loc[frames["scored"], column].to_numpy(np.float64)
            missed = np.inf if column == "center_error_px" else 0.0
            if len(values):
                curves.append(shares(np.where(np.isnan(values), missed, values)))
    return np.asarray(np.mean(curves, axis=0), dtype=np.float64)


def _usage(m: Measured, films: Sequence[str], spec: str, name: str) -> Drawing:
    """Figures 17 to 20: confidence and usage by frame, with 20 particles."""
    seed = m.seeds[0]
    runs = {film: m.frames(film, seed, spec).iloc[1:] for film in films}
    runs = {film: frames for film, frames in runs.items() if len(frames)}
    most = max((frames["particles"].max() for frames in runs.values()), default=0)
    panels = []
    for film, frames in runs.items():
        x = frames["frame"].to_numpy(np.float64)
        used = frames["particles"].to_numpy(np.float64)
        confidence = frames["confidence"].to_numpy(np.float64)
        overlap = frames["overlap"].to_numpy(np.float64)
        lines = [
            Line("confidence", x, confidence, "#0072B2"),
            Line(f"usage, of {most:.0f}", x, used / max(most, 1.0), "#D55E00"),
            Line("overlap", x, overlap, "#9aa5b1", "3 3"),
        ]
        ends = (1.0, float(max(x[-1], 2.0)))
        spans = hidden_spans(frames)
        panels.append(Panel(film, "frame", "", lines, ends, (0.0, 1.05), spans))
    caption = (
        f"Figures 17 to 20, {name.rpartition('-')[2]}: confidence, use of particles "
        f"(20 a round) and true overlap by frame; seed {seed}."
    )
    return Drawing(name, chart(caption, panels), caption)
