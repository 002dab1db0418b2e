"""Report page: chapters, tables, figures and pictures in one HTML file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, TypeAlias

import plotly.offline

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.evaluation.explained import EXPLAINED
from simbench.evaluation.measures.rules import RULES
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.intervals import LEAST_COUNT
from simbench.evaluation.statistics.paired import LEAST_PAIRS
from simbench.evaluation.statistics.particle_economy import particle_economy
from simbench.evaluation.statistics.sweep_scores import SweepScores
from simbench.report import figures, tables
from simbench.report.diagnosis_figures import calibration_curves, held_curves
from simbench.report.economy import economy_figure, economy_rows
from simbench.report.palette import Style, tracker_styles
from simbench.report.pictures import animation, stills
from simbench.report.sections import ReportSection, split_scores, tracker_labels
from simbench.report.sweep_chapter import sweep_chapter
from simbench.report.text import count, seed_name
from simbench.report.write_html import FOLDER, write_html

__all__ = ["write_report"]

# All animations together, as text. With plotly (5 MB) and the rest below 15 MB.
_ANIMATION_BYTES: Final = 7_500_000

Key: TypeAlias = tuple[str, str, int | None]  # scenario, variant, seed


def write_report(
    scores: Scores,
    sequences: Iterable[Sequence],
    run: Mapping[str, Any],
    out: Path,
    *,
    swept: SweepScores | None = None,
) -> None:
    """Write the report of a run as one HTML file that needs no network.

    Parameters
    ----------
    scores : Scores
        At least one run.
    sequences : iterable of Sequence
        Sequences to show in pictures: of each scenario and variant, the first seed that
        has one. A scenario without any is reported without pictures.
    run : mapping
        Facts of the run, as in ``run.json``: ``command``, ``created``, ``versions``,
        ``host``, ``seeds``, ``scenarios`` (each ``name, variant, title, tests,
        digest``), ``trackers`` (each ``label, spec``), ``duration_s``. Missing facts
        are left out of the page.
    out : Path
        File to write, atomically.
    swept : SweepScores, optional
        Scores by value of the dials, if the run is a sweep: then all variants share one
        chapter.

    Raises
    ------
    DatasetError
        If there is no run to report, or the file cannot be written.
    """
    if len(scores.runs) == 0:
        raise DatasetError(f"{out}: a report needs at least one run, got none")
    sections = split_scores(scores, run)
    labels = tracker_labels(scores, run)
    styles = tracker_styles(labels)
    specs = {one.get("label"): one.get("spec", "") for one in run.get("trackers", ())}
    economy = particle_economy(scores.runs, specs) if swept is None else None
    by_key = {(one.name, one.variant, one.seed): one for one in sequences}
    shown = [_first_sequence(section, by_key) for section in sections]
    sweep, chapters = None, []
    if swept is None:
        budget_bytes = _ANIMATION_BYTES // len(sections)
        chapters = [
            _chapter(section, styles, sequence, budget_bytes)
            for section, sequence in zip(sections, shown, strict=True)
        ]
        heading = count(len(sections), "scenario")
    else:
        by_variant = {one.variant: one for one in shown if one is not None}
        sweep = sweep_chapter(swept, sections, styles, by_variant)
        heading = f"{sweep['name']} by {' and '.join(sweep['dials'])}"
    seeds = scores.runs["seed"].nunique()
    write_html(
        "page.html",
        out,
        run=run,
        heading=", ".join(
            [
                heading,
                count(len(labels), "tracker"),
                *([count(seeds, "seed")] if seeds else []),
                *(["recorded data"] if scores.runs["seed"].isna().any() else []),
            ]
        ),
        chapters=chapters,
        sweep=sweep,
        sections=sections,
        sequences=[
            (section.name, row)
            for section in sections
            for row in tables.sequence_rows(section)
        ],
        styles=styles,
        overall=tables.overall_rows(sections, labels),
        overall_notes=tables.overall_notes(sections),
        economy=economy_rows(economy) if economy else [],
        economy_figure=economy_figure(economy, styles) if economy else "",
        failures=tables.failure_rows(scores.runs),
        run_count=len(scores.runs),
        least_count=LEAST_COUNT,
        least_pairs=LEAST_PAIRS,
        score_columns=tables.SCORE_COLUMNS,
        diagnosis_columns=tables.DIAGNOSIS_COLUMNS,
        explained=EXPLAINED,
        rules=[one for name, one in RULES.items() if name in set(scores.runs["rules"])],
        plotly=plotly.offline.get_plotlyjs(),
        scripts=[
            (FOLDER / name).read_text(encoding="utf-8")
            for name in ("figures.js", "player.js", "page.js")
        ],
    )


def _chapter(
    section: ReportSection,
    styles: Mapping[str, Style],
    sequence: Sequence | None,
    budget_bytes: int,
) -> dict[str, Any]:
    """Return the template's variables of one scenario."""
    by_frame = {
        seed_name(seed): {
            "error": figures.error_by_frame(tracks, styles),
            "particles": figures.particles_by_frame(tracks, styles),
        }
        for seed in section.seeds
        if (tracks := section.of_seed(seed))
    }
    player = None
    if sequence is not None:
        player = animation(sequence, section.of_seed(sequence.seed), budget_bytes)
    return {
        "section": section,
        "sequence": sequence,
        "stills": stills(sequence) if sequence is not None else [],
        "scores": tables.score_rows(section),
        "diagnosis": tables.diagnosis_rows(section),
        "column_notes": tables.column_notes(section),
        "dials": tables.dial_rows(section),
        "attributes": tables.attribute_rows(section),
        "failures": tables.failure_rows(section.runs),
        "has_particles": any(one["particles"] for one in by_frame.values()),
        "seeds": list(by_frame),
        "data": {
            "curves": {
                "success": figures.success(section, styles),
                "precision": figures.precision(section, styles),
                "held": held_curves(section, styles),
                "calibration": calibration_curves(section, styles),
            },
            "by_frame": by_frame,
            "player": player,
            "colors": {tracker: styles[tracker].color for tracker in section.trackers},
        },
    }


def _first_sequence(
    section: ReportSection, by_key: Mapping[Key, Sequence]
) -> Sequence | None:
    """Return the sequence of the first seed that has one."""
    keys = ((section.scenario, section.variant, seed) for seed in section.seeds)
    return next((by_key[key] for key in keys if key in by_key), None)
