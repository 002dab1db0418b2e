"""Figures that the pages share: paths and distances by frame, and particle clouds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.sequence import Sequence
from simbench.evaluation.run_tracker import track_seed
from simbench.experiments.papers.charts import INK, Line, Panel, chart, styled_lines
from simbench.experiments.papers.instances import (
    HELD_SIDES,
    HIDDEN,
    centre_distance,
    normalised_distance,
)
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.study import Drawing
from simbench.trackers.find_tracker import find_tracker

if TYPE_CHECKING:
    from simbench.trackers.parts.particle_cloud import ParticleCloud

__all__ = ["clouds_of", "hidden_spans", "padded", "path_figure"]

Floats = NDArray[np.float64]


def clouds_of(film: Sequence, spec: str) -> list[ParticleCloud]:
    """Return the particles of a filter after each frame of a film but the first.

    They are those of ``simbench run`` with this tracker.
    """
    found = find_tracker(spec)
    tracker = found.make()
    rng = np.random.default_rng(track_seed(film.seed or 0, found.label, 0))
    clouds: list[ParticleCloud] = []
    for index, frame in enumerate(film.frames):
        if index == 0:
            tracker.init(frame, Box.from_array(film.truth.boxes[0]), rng)
            continue
        tracker.update(frame)
        clouds.append(tracker.cloud)  # type: ignore[attr-defined]  # of the filters
    return clouds


def path_figure(
    m: Measured,
    place: str,
    seed: int,
    specs: Mapping[str, str],
    name: str,
    figures: str,
) -> Drawing:
    """Return paths and distances of one film, and what is held by frame in all.

    Parameters
    ----------
    m : Measured
    place : str
    seed : int
        Of the film that paths and distances are drawn of.
    specs : mapping from str to str
        Specification of each tracker, by its label in the figure.
    name : str
        Of the file; what is behind its last hyphen is the setting.
    figures : str
        Which of the paper they redraw, for the caption.
    """
    runs = {label: m.frames(place, seed, spec) for label, spec in specs.items()}
    runs = {label: run for label, run in runs.items() if len(run)}
    first = next(iter(runs.values()))
    labels = list(runs)
    panels = [
        _path_panel(first, labels, list(runs.values())),
        _distance_panel(first, labels, list(runs.values())),
        _held_panel(m, place, {label: specs[label] for label in labels}),
    ]
    caption = (
        f"{figures}, {name.rpartition('-')[2]}: {place}, path and distance with seed "
        f"{seed}, and the share of all {len(m.seeds)} films in which the target is "
        "held. Grey: less than half of the target is visible."
    )
    return Drawing(name, chart(caption, panels, columns=3), caption)


def _path_panel(
    first: pd.DataFrame, labels: list[str], runs: list[pd.DataFrame]
) -> Panel:
    truth = _centres(first, "truth_")
    lines = styled_lines(labels, [_centres(run, "") for run in runs])
    lines.append(Line("truth", *truth, INK, "3 3"))
    x_range, y_range = padded(truth[0]), padded(truth[1])
    titles = "x, px", "y, px (down)"
    return Panel("path", *titles, lines, x_range, (y_range[1], y_range[0]))


def _distance_panel(
    first: pd.DataFrame, labels: list[str], runs: list[pd.DataFrame]
) -> Panel:
    distances = [(run["frame"].to_numpy(), centre_distance(run)) for run in runs]
    lines = styled_lines(labels, distances)
    every = np.concatenate([one for _, one in distances])
    side = first[["truth_width", "truth_height"]].max(axis=1).mean()
    known = every[np.isfinite(every)]
    most = float(np.clip(np.quantile(known, 0.97), 2 * side, 8 * side))
    frames = float(max(first["frame"].max(), 1))
    titles = "frame", "distance, px"
    spans = hidden_spans(first)
    return Panel("distance", *titles, lines, (0.0, frames), (0.0, most), spans)


def _held_panel(m: Measured, place: str, specs: dict[str, str]) -> Panel:
    curves = []
    for spec in specs.values():
        runs = [m.frames(place, seed, spec) for seed in m.seeds]
        held = [normalised_distance(run) < HELD_SIDES for run in runs if len(run)]
        length = min(map(len, held))
        shares = np.mean([one[:length] for one in held], axis=0)
        curves.append((np.arange(length, dtype=np.float64), shares))
    lines = styled_lines(list(specs), curves)
    frames = float(max(len(curves[0][0]) - 1, 1))
    titles = "frame", "share of films, held"
    return Panel("held, all films", *titles, lines, (0.0, frames), (0.0, 1.02))


def hidden_spans(frames: pd.DataFrame) -> list[tuple[float, float]]:
    """Return the spans of frames in which less than half of the target is visible."""
    hidden = (frames["visible_fraction"] < HIDDEN).to_numpy()
    ends = np.flatnonzero(np.diff(np.concatenate([[0], hidden, [0]])))
    return [(float(a) - 0.5, float(b) - 0.5) for a, b in ends.reshape(-1, 2)]


def _centres(frames: pd.DataFrame, prefix: str) -> tuple[Floats, Floats]:
    x = frames[f"{prefix}left"] + frames[f"{prefix}width"] / 2
    y = frames[f"{prefix}top"] + frames[f"{prefix}height"] / 2
    return x.to_numpy(np.float64), y.to_numpy(np.float64)


def padded(values: Floats) -> tuple[float, float]:
    """Return a range with room around the values."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.15 * max(high - low, 10.0)
    return low - room, high + room
