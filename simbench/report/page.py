"""The page itself: chapters, tables, figures and pictures put into one HTML file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, TypeAlias

import jinja2
import plotly.offline

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.evaluation.scores import Scores
from simbench.evaluation.sweep_scores import SweepScores
from simbench.report import figures, tables
from simbench.report.palette import Style, styles
from simbench.report.pictures import animation, stills
from simbench.report.sections import ReportSection, sections, tracker_labels
from simbench.report.sweep_chapter import sweep_chapter
from simbench.report.tables import sequence_rows
from simbench.report.text import count

__all__ = ["write_report"]

_FOLDER: Final = Path(__file__).parent
# All animations together, as text. With plotly (5 MB) and the rest below 15 MB.
_ANIMATION_BYTES: Final = 7_500_000

_FACTS: Final = (
    "command",
    "created",
    "versions",
    "host",
    "seeds",
    "trackers",
    "duration_s",
)

Kept: TypeAlias = Mapping[tuple[str, str, int | None], Sequence]


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
        Those to show in pictures: of each scenario and variant, the first seed that is
        among them. One without any is reported without pictures.
    run : mapping
        What was asked, as in ``run.json``: ``command``, ``created``, ``versions``,
        ``host``, ``seeds``, ``scenarios`` (each ``name, variant, title, tests,
        digest``), ``trackers`` (each ``label, spec``), ``duration_s``. What is missing
        is left out of the page.
    out : Path
        File to write; written whole.
    swept : SweepScores, optional
        What the scores amount to as a sweep: then all variants share one chapter.

    Raises
    ------
    DatasetError
        If there is no run to report, or the file cannot be written.
    """
    if len(scores.runs) == 0:
        raise DatasetError(f"{out}: a report needs at least one run, got none")
    html = _render(scores, sequences, run, swept)
    try:
        with atomic_write(out) as partial:
            partial.write_text(html, encoding="utf-8")
    except OSError as error:
        raise DatasetError(f"{out}: cannot be written: {error.strerror}") from error


def _render(
    scores: Scores,
    sequences: Iterable[Sequence],
    run: Mapping[str, Any],
    swept: SweepScores | None,
) -> str:
    parts = sections(scores, run)
    labels = tracker_labels(scores, run)
    looks = styles(labels)
    kept = {(one.name, one.variant, one.seed): one for one in sequences}
    sweep, chapters = None, []
    if swept is None:
        chapters = [_chapter(part, looks, kept, len(parts)) for part in parts]
    else:
        found = {part.variant: _filmed(part, kept) for part in parts}
        filmed = {variant: one for variant, one in found.items() if one is not None}
        sweep = sweep_chapter(swept, parts, looks, filmed)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    seeds = scores.runs["seed"].nunique()
    return environment.get_template("page.html").render(
        run={**dict.fromkeys(_FACTS), **run},
        heading=", ".join(
            [
                count(len(parts), "scenario") if sweep is None else _swept_name(sweep),
                count(len(labels), "tracker"),
                count(seeds, "seed") if seeds else "recorded data",
            ]
        ),
        chapters=chapters,
        sweep=sweep,
        parts=parts,
        sequences=[(part.name, row) for part in parts for row in sequence_rows(part)],
        looks=looks,
        overall=tables.overall_rows(parts, labels),
        failures=tables.failure_rows(scores.runs),
        run_count=len(scores.runs),
        score_columns=tables.SCORE_COLUMNS,
        plotly=plotly.offline.get_plotlyjs(),
        style=(_FOLDER / "page.css").read_text(encoding="utf-8"),
        scripts=[
            (_FOLDER / name).read_text(encoding="utf-8")
            for name in ("figures.js", "player.js", "page.js")
        ],
    )


def _swept_name(sweep: Mapping[str, Any]) -> str:
    return f"{sweep['name']} by {' and '.join(sweep['dials'])}"


def _chapter(
    part: ReportSection, looks: Mapping[str, Style], kept: Kept, of: int
) -> dict[str, Any]:
    """Return what the template shows of one of so many scenarios."""
    by_seed = {seed: part.of_seed(seed) for seed in part.seeds}
    filmed = _filmed(part, kept)
    by_frame = {
        "recorded" if seed is None else str(seed): {
            "error": figures.error_by_frame(tracks, looks),
            "particles": figures.particles_by_frame(tracks, looks),
        }
        for seed, tracks in by_seed.items()
        if tracks
    }
    player = None
    if filmed is not None:
        tracks = by_seed[filmed.seed]
        player = animation(filmed, tracks, _ANIMATION_BYTES // of)
    return {
        "part": part,
        "filmed": filmed,
        "stills": stills(filmed) if filmed is not None else [],
        "scores": tables.score_rows(part),
        "dials": tables.dial_rows(part),
        "failures": tables.failure_rows(part.runs),
        "has_particles": any(one["particles"] for one in by_frame.values()),
        "seeds": list(by_frame),
        "data": {
            "curves": {
                "success": figures.success(part, looks),
                "precision": figures.precision(part, looks),
            },
            "by_frame": by_frame,
            "player": player,
            "colors": {tracker: looks[tracker].color for tracker in part.trackers},
        },
    }


def _filmed(part: ReportSection, kept: Kept) -> Sequence | None:
    """Return the sequence of the first seed that has one."""
    wanted = ((part.scenario, part.variant, seed) for seed in part.seeds)
    return next((kept[key] for key in wanted if key in kept), None)
