"""Tables of the directional particle filter's page."""

from __future__ import annotations

from typing import Final

from simbench.experiments.papers.markdown import interval_text, table_text
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.published_figures import published
from simbench.experiments.papers.settings import SETTINGS
from simbench.experiments.papers.shared_tables import (
    comparison_table,
    kept_table,
    scene_table,
)

__all__ = ["tables"]

_VIDEOS: Final = ("trees-dusk", "poles", "bridge")
_GROUPS: Final = {"**all**": _VIDEOS, **{one: (one,) for one in _VIDEOS}}
_PAIRS: Final = (
    ("condensation-paper@drift=true", "condensation-paper", "what the drift gives"),
    ("directional-45-paper", "condensation-paper@drift=true", "what the gate gives"),
    (
        "directional-45-paper",
        "condensation-paper@drift=true@particles=50",
        "the gate, at equal measurements",
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
        "table.\n\n" + comparison_table(measured, _GROUPS, _PAIRS, "held"),
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
