"""Tables of the directional particle filter's page."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

from simbench.evaluation.statistics.comparison import LEVEL
from simbench.evaluation.statistics.paired import holm, paired_difference
from simbench.experiments.papers.instances import HIDDEN
from simbench.experiments.papers.markdown import interval_text, table_text
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.published_figures import published
from simbench.experiments.papers.settings import SETTINGS

__all__ = ["comparison_table", "kept_table", "scene_table", "tables"]

_VIDEOS: Final = ("trees-dusk", "poles", "bridge")
_PAIRS: Final = (
    ("condensation-paper@drift=true", "condensation-paper", "what the drift gives"),
    ("directional-45-paper", "condensation-paper@drift=true", "what the gate gives"),
    (
        "directional-45-paper",
        "condensation-paper@drift=true@particles=50",
        "the gate, at equal measurements",
    ),
    (
        "directional-45-paper@drift=false",
        "condensation-paper",
        "the gate without drift",
    ),
    ("condensation-paper@warm_up_noise=0.3", "condensation-paper", "more noise"),
    ("directional-45", "condensation", "ours: what the gate gives"),
    ("directional-45", "condensation@particles=50", "ours, at equal measurements"),
    ("condensation", "condensation@drift=false", "ours: what the drift gives"),
    ("condensation", "condensation-paper", "ours - paper, condensation"),
    ("directional-45", "directional-45-paper", "ours - paper, pi/4"),
)


def tables(measured: Measured) -> list[str]:
    """Return the sections: published and measured figures, all trackers, ablations."""
    return [
        "## Table 1: particles used, of 100\n\n"
        "Measured: the least and the mean number by frame, averaged over instances.\n\n"
        + usage_table(measured),
        "## What is kept, by video and tracker\n\n" + kept_table(measured, _VIDEOS),
        "## Ablations: where the gain comes from\n\n"
        "Paired differences of the share of frames in which the target is held (error "
        "below .6 of its longer side); p is corrected by Holm's method within the "
        "table.\n\n" + comparison_table(measured, _VIDEOS, _PAIRS, "held"),
        "## What the films show\n\n" + scene_table(measured, _VIDEOS),
    ]


def usage_table(m: Measured) -> str:
    """Return the published table 1 beside the measured ones."""
    printed = published("dpf").tables[0]
    rows = []
    for name, values in printed.rows.items():
        rows.append([name, "published", *(f"{value:g}" for value in values), "1 each"])
        for setting in SETTINGS:
            cells, counts = [], []
            for video in _VIDEOS:
                for column in ("particles_min", "particles_mean"):
                    found = m.values(video, m.spec(name, setting), column)
                    cells.append(interval_text(found, 0))
                    counts.append(len(found))
            rows.append([name, setting, *cells, str(max(counts))])
    return table_text(["tracker", "setting", *printed.columns, "n"], rows)


def kept_table(m: Measured, places: tuple[str, ...]) -> str:
    """Return what each tracker keeps in each place.

    Columns: instances that are kept (by the target's size, and by 20 px), the share of
    frames in which the target is held, the mean distance.
    """
    rows = []
    for place in places:
        for entry in m.entries:
            kept = m.values(place, entry.spec, "keeps")
            if not len(kept):
                continue
            rows.append(
                [
                    place,
                    entry.name,
                    entry.setting,
                    f"{int(kept.sum())} of {len(kept)}",
                    str(int(m.values(place, entry.spec, "keeps_20px").sum())),
                    interval_text(m.values(place, entry.spec, "held"), is_share=True),
                    interval_text(m.values(place, entry.spec, "distance")),
                    interval_text(m.values(place, entry.spec, "particles_mean"), 0),
                ]
            )
    headings = ["film", "tracker", "setting", "kept", "by 20 px", "held"]
    return table_text([*headings, "distance, sides", "measured a frame"], rows)


def comparison_table(
    m: Measured,
    places: tuple[str, ...],
    pairs: tuple[tuple[str, str, str], ...],
    column: str,
) -> str:
    """Return paired differences of two trackers, over all places and by place."""
    listed = []
    for first, second, what in pairs:
        for place in [*places, places] if len(places) > 1 else places:
            found = paired_difference(m.difference(place, first, second, column))
            if found.count:
                name = place if isinstance(place, str) else "**all**"
                listed.append((what, f"`{first}` - `{second}`", name, found))
    corrected = holm([one.p for *_, one in listed])
    rows = []
    for (what, which, place, one), p in zip(listed, corrected, strict=True):
        interval = f" [{one.low:.2f}, {one.high:.2f}]" if np.isfinite(one.low) else ""
        shown = "open"
        if p <= LEVEL:
            shown = "**better**" if one.mean > 0 else "**worse**"
        difference = f"{one.mean:+.2f}{interval}"
        rows.append([what, which, place, one.count, difference, f"{p:.2g}", shown])
    return table_text(["what", "trackers", "film", "n", "difference", "p", ""], rows)


def scene_table(m: Measured, places: tuple[str, ...]) -> str:
    """Return what the films show: size, motion and visibility of the target."""
    rows = []
    for place in places:
        scenes = []
        for seed in m.seeds:
            frames = next(
                (f for e in m.entries if len(f := m.frames(place, seed, e.spec))), None
            )
            if frames is not None:
                scenes.append(_scene(frames))
        if not scenes:
            continue
        table = pd.DataFrame(scenes)
        cells = (interval_text(table[name], 1) for name in table.columns[:-1])
        visible = interval_text(table["visible"], is_share=True)
        rows.append([place, len(table), *cells, visible])
    headings = ["film", "n", "longer side, px", "step, px", "frames below half visible"]
    return table_text([*headings, "longest occlusion, frames", "mean visible"], rows)


def _scene(frames: pd.DataFrame) -> dict[str, float]:
    side = frames[["truth_width", "truth_height"]].max(axis=1)
    x = (frames["truth_left"] + frames["truth_width"] / 2).to_numpy()
    y = (frames["truth_top"] + frames["truth_height"] / 2).to_numpy()
    hidden = (frames["visible_fraction"] < HIDDEN).to_numpy()
    ends = np.flatnonzero(np.diff(np.concatenate([[0], hidden, [0]])))
    lengths = ends[1::2] - ends[::2]
    return {
        "side": float(side.mean()),
        "step": float(np.nanmean(np.hypot(np.diff(x), np.diff(y)))),
        "hidden": float(hidden.sum()),
        "longest": float(lengths.max()) if len(lengths) else 0.0,
        "visible": float(frames["visible_fraction"].mean()),
    }
