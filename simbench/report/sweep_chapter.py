"""Chapter of a sweep: one for all its variants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from simbench.core import sequence
from simbench.evaluation.statistics.sweep_scores import SweepScores
from simbench.report import figures, sweep_figures
from simbench.report.palette import Style
from simbench.report.sections import ReportSection
from simbench.report.sweep_pictures import sweep_pictures
from simbench.report.sweep_text import breaking_table, notes, point_table
from simbench.report.text import anchor, scenario_name

__all__ = ["sweep_chapter"]


def sweep_chapter(
    swept: SweepScores,
    sections: Sequence[ReportSection],
    styles: Mapping[str, Style],
    sequences: Mapping[str, sequence.Sequence],
) -> dict[str, Any]:
    """Return the template's variables of a sweep.

    Parameters
    ----------
    swept : SweepScores
    sections : sequence of ReportSection
        One for each variant, at least one.
    styles : mapping from tracker to Style
    sequences : mapping from variant to Sequence
        Sequences to show in pictures.
    """
    sweep, first = swept.sweep, sections[0]
    by_frame = {
        section.variant: {"error": figures.error_by_frame(tracks, styles)}
        for section in sections
        if (tracks := section.of_seed(section.seeds[0]))
    }
    return {
        "anchor": anchor("scenario", sweep.scenario, sweep.variant),
        "title": first.title,
        "name": scenario_name(sweep.scenario, sweep.variant),
        "tests": first.tests,
        "dials": sweep.dials,
        "trackers": swept.trackers,
        "seed": first.seeds[0],
        "pictures": sweep_pictures(sweep, sequences),
        "breaking": breaking_table(swept),
        "points": point_table(swept),
        "notes": notes(swept),
        "variants": list(by_frame),
        "data": {
            "curves": sweep_figures.sweep_figures(swept, styles),
            "by_frame": by_frame,
            "player": None,
            "colors": {tracker: styles[tracker].color for tracker in swept.trackers},
        },
    }
