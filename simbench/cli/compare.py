"""The command ``compare``: trackers among each other, or two versions of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from simbench.cli.display import print_line, print_table
from simbench.cli.json_output import Json, write_json
from simbench.cli.names import require_name
from simbench.core.atomic_write import atomic_write
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    import pandas as pd

    from simbench.evaluation.statistics.comparison import Comparison

__all__ = ["compare"]

_MEASURES = (
    "precision_20",
    "success_50",
    "success_auc",
    "average_overlap",
    "success_75",
    "norm_precision",
    "norm_precision_area",
    "fps",
    "held_s",
    "confidence_auc",
    "confidence_visible_auc",
    "overlap_occluded",
    "overlap_small",
    "overlap_fast",
    "overlap_near_distractor",
    "overlap_night",
    "vots_quality",
    "vots_accuracy",
    "vots_robustness",
    "vots_adq",
    "longterm_precision",
    "longterm_recall",
    "longterm_f",
)
"""Columns of which higher is better: of the others "better" would say the opposite."""


def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN [RUN]",
            help="One run folder: its trackers; two: before and after, label by label.",
        ),
    ],
    measure: Annotated[
        str, typer.Option(help="Score of which higher is better.")
    ] = "success_50",
    practical: Annotated[
        float,
        typer.Option(min=0.0, max=1.0, help="Least difference that matters."),
    ] = 0.02,
    out: Annotated[
        Path | None,
        typer.Option(
            file_okay=False,
            help="Folder for comparison.md, .csv, .tex and the diagram (.svg).",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare trackers by paired differences over the same scenario instances.

    The tests are corrected for their number; a difference counts if it is shown and
    matters. Repetitions are averaged first.
    """
    from simbench.evaluation.statistics.comparison import compare_runs, compare_trackers

    if len(runs) > 2:
        raise SimbenchError(f"compare: expected one or two runs, got {len(runs)}")
    tables = [_scores(path, measure) for path in runs]
    notices = []
    if len(tables) == 2:
        notices = _differing_films(tables[0], tables[1])
        found = compare_runs(tables[0], tables[1], measure, practical=practical)
        problem = "a tracker of the same label, scenario and seed in both runs"
    else:
        found = compare_trackers(tables[0], measure, practical=practical)
        problem = "two trackers or more"
    if not found or not any(one.difference.count for one in found):
        raise SimbenchError(f"compare: expected {problem}, got none")
    if out is not None:
        _write(out, tables, found, measure, practical)
    if as_json:
        write_json("compare", _facts(found, measure, practical, notices))
        return
    _print(Console(), tables, found, measure, practical, notices)
    if out is not None:
        print_line(Console(), f"written: {out}")


def _scores(path: Path, measure: str) -> pd.DataFrame:
    """Read the runs of a folder, which must have the measure."""
    from simbench.evaluation.scores import Scores
    from simbench.experiments.run_folder import RunFolder

    RunFolder(path).read_facts()
    runs = Scores.read(path).runs
    require_name("--measure", measure, _MEASURES)
    return runs


def _differing_films(before: pd.DataFrame, after: pd.DataFrame) -> list[str]:
    """Return a notice if the two runs saw other films under the same names."""
    keys = ["scenario", "variant", "seed"]
    old, new = (
        runs[runs["digest"] != ""].groupby(keys, dropna=False)["digest"].max()
        for runs in (before, after)
    )
    both = old.index.intersection(new.index)
    other = int((old.loc[both] != new.loc[both]).sum())
    if not other:
        return []
    return [f"{other} of {len(both)} films differ between the runs under the same name"]


def _sections(
    tables: Sequence[pd.DataFrame], measure: str, mark: str
) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return headings and rows of the means of the (last) run, the best marked."""
    from simbench.evaluation.statistics.comparison import contest, instance_table
    from simbench.evaluation.statistics.instance_statistics import is_share, spread
    from simbench.evaluation.statistics.intervals import describe_interval
    from simbench.report.comparison_text import score_rows
    from simbench.report.text import scenario_name

    table = instance_table(tables[-1], measure)
    places = [("all", table)] + [
        (scenario_name(*map(str, key)), part)
        for key, part in table.groupby(level=[0, 1], sort=False)
    ]
    if len(places) == 2:
        places = places[1:]
    contests = [contest(part, 1) for _, part in places]
    headings = ["tracker"]
    for (name, part), one in zip(places, contests, strict=True):
        note = " (does not discriminate)" if one.is_flat else ""
        headings.append(f"{name}, n = {len(part)}{note}")
    rows = []
    for tracker in table.columns:
        cells = []
        for _, part in places:
            over = spread(part[tracker], is_bounded=is_share(measure))
            ends = over.low, over.high, over.minimum, over.maximum
            cells.append(f"{over.mean:.3f} {describe_interval(*ends, 2)}".rstrip())
        rows.append((str(tracker), cells))
    return headings, score_rows(rows, contests, mark)


def _print(
    console: Console,
    tables: Sequence[pd.DataFrame],
    found: Sequence[Comparison],
    measure: str,
    practical: float,
    notices: Sequence[str],
) -> None:
    from simbench.report.comparison_text import SHORT_HEADINGS, notes, short_rows

    for notice in notices:
        print_line(console, notice, "yellow")
    print_line(console, f"{measure}, mean over instances and its interval:")
    (_, *places), rows = _sections(tables, measure, "*{}*")
    listed = [
        ("" if index else place, tracker, cells[column])
        for column, place in enumerate(places)
        for index, (tracker, *cells) in enumerate(rows)
    ]
    print_table(console, ("scenario", "tracker", "mean"), listed)
    if any(cell.startswith("*") for _, *cells in rows for cell in cells):
        print_line(console, "*marked*: no other is shown to be better", "dim")
    print_line(console, "")
    print_table(console, SHORT_HEADINGS, short_rows(found))
    for note in notes(found, practical):
        print_line(console, note, "dim")


def _write(
    folder: Path,
    tables: Sequence[pd.DataFrame],
    found: Sequence[Comparison],
    measure: str,
    practical: float,
) -> None:
    from simbench.evaluation.statistics.comparison import instance_table
    from simbench.report import comparison_text as text
    from simbench.report.critical_difference import critical_difference, mean_ranks

    headings, rows = _sections(tables, measure, "**{}**")
    listed = text.comparison_rows(found)
    notes = "".join(f"- {note}\n" for note in text.notes(found, practical))
    diagram = ""
    if len(tables) == 1:
        table = instance_table(tables[0], measure)
        ranks = mean_ranks(table)
        if ranks:
            drawing = critical_difference(ranks, found, measure)
            _write_text(folder / "critical-difference.svg", drawing)
            diagram = "![critical differences](critical-difference.svg)\n\n"
    markdown = (
        f"# Comparison by {measure}\n\n"
        "Bold: no other is shown to be better.\n\n"
        f"{text.markdown_table(headings, rows)}\n{diagram}"
        f"{text.markdown_table(text.HEADINGS, listed)}\n{notes}"
    )
    latex = (
        f"{text.latex_table(headings, rows)}\n{text.latex_table(text.HEADINGS, listed)}"
    )
    _write_text(folder / "comparison.md", markdown)
    _write_text(
        folder / "comparison.csv", text.comparison_csv([text.HEADINGS, *listed])
    )
    _write_text(folder / "comparison.tex", latex)


def _write_text(path: Path, text: str) -> None:
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _facts(
    found: Sequence[Comparison],
    measure: str,
    practical: float,
    notices: Sequence[str],
) -> Mapping[str, Any]:
    """Return what ``compare`` prints with ``--json``."""
    return {
        "measure": measure,
        "practical": practical,
        "notices": list(notices),
        "comparisons": [
            {
                "scenario": one.scenario,
                "variant": one.variant,
                "first": one.first,
                "second": one.second,
                "n": one.difference.count,
                "difference": one.difference.mean,
                "sd": one.difference.sd,
                "low": one.difference.low,
                "high": one.difference.high,
                "p": one.difference.p,
                "p_holm": one.p,
                "effect": one.difference.effect,
                "wins": one.difference.wins,
                "verdict": one.verdict,
                "needed": one.needed,
            }
            for one in found
        ],
    }
