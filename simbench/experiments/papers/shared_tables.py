"""Tables that the pages share: what is kept, paired differences, what films show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from simbench.evaluation.statistics.comparison import LEVEL
from simbench.evaluation.statistics.paired import holm, paired_difference
from simbench.experiments.papers.instances import HIDDEN
from simbench.experiments.papers.markdown import interval_text, table_text
from simbench.experiments.papers.measured import Measured

__all__ = ["comparison_table", "kept_table", "scene_table"]


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
    groups: Mapping[str, Iterable[str]],
    pairs: tuple[tuple[str, str, str], ...],
    column: str,
) -> str:
    """Return paired differences of two trackers, by group of films.

    Parameters
    ----------
    m : Measured
    groups : mapping from str to iterable of str
        Places of each group, by its name.
    pairs : tuple of (str, str, str)
        Specifications of the first and the second tracker, and what differs.
    column : str
        Measure, see `simbench.experiments.papers.instances.instance_measures`.
    """
    listed = []
    for first, second, what in pairs:
        for name, places in groups.items():
            found = paired_difference(m.difference(places, first, second, column))
            if found.count:
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
    return table_text(["what", "trackers", "films", "n", "difference", "p", ""], rows)


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
