"""The chapter of a sweep: one for all its variants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from simbench.core import sequence
from simbench.evaluation.sweep_scores import SweepScores
from simbench.report import figures, sweep_figures
from simbench.report.palette import Style
from simbench.report.samples import samples
from simbench.report.sections import ReportSection
from simbench.report.sweep_text import breaking_table, notes, point_table
from simbench.report.text import anchor

__all__ = ["sweep_chapter"]


def sweep_chapter(
    swept: SweepScores,
    parts: Sequence[ReportSection],
    looks: Mapping[str, Style],
    filmed: Mapping[str, sequence.Sequence],
) -> dict[str, Any]:
    """Return what the template shows of a sweep.

    Parameters
    ----------
    swept : SweepScores
    parts : sequence of ReportSection
        One a variant, at least one.
    looks : mapping from tracker to Style
    filmed : mapping from variant to Sequence
        Those to show in pictures.
    """
    sweep = swept.sweep
    curves = _maps(swept, looks) if len(sweep.dials) > 1 else _curves(swept, looks)
    by_frame = {
        part.variant: {"error": figures.error_by_frame(tracks, looks)}
        for part in parts
        if (tracks := part.of_seed(part.seeds[0]))
    }
    return {
        "anchor": anchor("scenario", sweep.scenario, sweep.variant),
        "title": parts[0].title,
        "name": " · ".join(filter(None, (sweep.scenario, sweep.variant))),
        "tests": parts[0].tests,
        "dials": sweep.dials,
        "trackers": swept.trackers,
        "seed": parts[0].seeds[0],
        "samples": samples(sweep, filmed),
        "breaking": breaking_table(swept),
        "points": point_table(swept),
        "notes": notes(swept),
        "variants": list(by_frame),
        "data": {
            "curves": curves,
            "by_frame": by_frame,
            "player": None,
            "colors": {tracker: looks[tracker].color for tracker in swept.trackers},
        },
    }


def _curves(swept: SweepScores, looks: Mapping[str, Style]) -> dict[str, Any]:
    shares = "share of frames"
    curves = {
        "success": sweep_figures.against_dial(
            swept, looks, "success_50", shares, height=440, has_breaking=True
        ),
        "precision": sweep_figures.against_dial(swept, looks, "precision_20", shares),
        "area": sweep_figures.against_dial(swept, looks, "success_auc", shares),
        "particles": sweep_figures.against_dial(
            swept, looks, "particles_mean", "particles a frame", height=280
        ),
    }
    return {name: figure for name, figure in curves.items() if figure is not None}


def _maps(swept: SweepScores, looks: Mapping[str, Style]) -> dict[str, Any]:
    maps = {
        f"map-{rank}": sweep_figures.success_map(swept, tracker)
        for rank, tracker in enumerate(swept.trackers)
    }
    return {**maps, "breaking": sweep_figures.breaking_by_other(swept, looks)}
