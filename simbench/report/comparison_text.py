"""Comparisons as tables: text for the terminal, markdown, CSV and LaTeX."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Sequence
from typing import Final

from simbench.core.text import printable
from simbench.evaluation.statistics.comparison import LEVEL, Comparison, Contest
from simbench.evaluation.statistics.intervals import describe_interval
from simbench.evaluation.statistics.paired import least_pairs
from simbench.report.text import scenario_name

__all__ = [
    "HEADINGS",
    "SHORT_HEADINGS",
    "comparison_csv",
    "comparison_rows",
    "latex_table",
    "markdown_table",
    "notes",
    "score_rows",
    "short_rows",
]

HEADINGS: Final = (
    "scenario",
    "first",
    "second",
    "n",
    "difference",
    "interval",
    "p",
    "effect",
    "wins",
    "verdict",
    "needed",
)
SHORT_HEADINGS: Final = (
    "first − second",
    "n",
    "difference",
    "p",
    "effect",
    "verdict",
    "needed",
)
"""Columns for a terminal."""
_NOTES: Final = (
    "difference: mean of first minus second over the same scenario instances, with its "
    "95 % interval (Student's)",
    "p: two-sided sign-flip test, corrected for all comparisons of the scenario (Holm)",
    "effect: mean by standard deviation of the differences; wins: share of instances "
    "in which the first is better",
    "needed: instances to see a difference as small as {practical:g}, should there be "
    "one, with a power of 0.8",
    "better, worse: the first is so, shown at 5 % and by {practical:g} or more; equal: "
    "the interval is within {practical:g}; open: neither is shown",
)
_LATEX: Final = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "&": r"\&",
        "%": r"\%",
        "$": r"\$",
        "#": r"\#",
        "_": r"\_",
        "{": r"\{",
        "}": r"\}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
    }
)


def comparison_rows(comparisons: Sequence[Comparison]) -> list[tuple[str, ...]]:
    """Return comparisons as text, with the columns of `HEADINGS`."""
    rows: list[tuple[str, ...]] = []
    for one in comparisons:
        of = one.difference
        ends = of.low, of.high, of.minimum, of.maximum
        rows.append(
            (
                scenario_name(one.scenario, one.variant) or "all",
                one.first,
                one.second,
                str(of.count),
                _number(of.mean, "+.3f"),
                describe_interval(*ends, 3),
                f"{one.p:.2g}",
                _number(of.effect, "+.2f"),
                _number(of.wins, ".2f"),
                one.verdict,
                "-" if one.needed is None else str(one.needed),
            )
        )
    return rows


def short_rows(comparisons: Sequence[Comparison]) -> list[tuple[str, ...]]:
    """Return comparisons as text for a terminal, with `SHORT_HEADINGS`."""
    rows: list[tuple[str, ...]] = []
    for one, of in zip(comparisons, comparison_rows(comparisons), strict=True):
        place, first, second, n, mean, interval, p, effect, _, verdict, needed = of
        what = f"{first} − {second}" if first != second else first
        where = f"{place}:\n{what}" if one.scenario else what
        difference = f"{mean}\n{interval}" if interval else mean
        rows.append((where, n, difference, p, effect, verdict, needed))
    return rows


def notes(comparisons: Sequence[Comparison], practical: float) -> list[str]:
    """Return what the columns and verdicts of these comparisons mean, a line each."""
    lines = [note.format(practical=practical) for note in _NOTES]
    if any(one.verdict == "n too small" for one in comparisons):
        places = Counter((one.scenario, one.variant) for one in comparisons)
        count = max(places.values())
        tests = "a comparison needs" if count == 1 else f"{count} comparisons need"
        lines.append(
            f"n too small: {tests} {least_pairs(count, LEVEL)} instances (seeds) or "
            "more; with fewer no difference can be shown, however large it is"
        )
    return lines


def score_rows(
    rows: Sequence[tuple[str, Sequence[str]]], contests: Sequence[Contest], mark: str
) -> list[tuple[str, ...]]:
    """Return a table of trackers by measure, with the best of each column marked.

    Parameters
    ----------
    rows : sequence of (tracker, cells)
        A cell for each contest.
    contests : sequence of Contest
    mark : str
        Format of a best cell, such as ``**{}**``.
    """
    return [
        (
            tracker,
            *(
                mark.format(cell) if tracker in contest.best else cell
                for cell, contest in zip(cells, contests, strict=True)
            ),
        )
        for tracker, cells in rows
    ]


def markdown_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in markdown."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join(f"| {' | '.join(map(_cell, line))} |\n" for line in lines)


def comparison_csv(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of text as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def latex_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in LaTeX, for the package booktabs; ``**bold**`` becomes so."""
    columns = "l" * 3 + "r" * max(len(headings) - 3, 0)
    lines = [f"\\begin{{tabular}}{{{columns[: len(headings)]}}}", "\\toprule"]
    lines.append(" & ".join(map(_latex, headings)) + r" \\")
    lines.append("\\midrule")
    lines += [" & ".join(map(_latex, row)) + r" \\" for row in rows]
    return "\n".join([*lines, "\\bottomrule", "\\end{tabular}", ""])


def _latex(text: str) -> str:
    if text.startswith("**") and text.endswith("**") and len(text) > 4:
        return f"\\textbf{{{_latex(text[2:-2])}}}"
    return printable(text).translate(_LATEX)


def _cell(text: str) -> str:
    return printable(text).replace("|", "\\|")


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)
