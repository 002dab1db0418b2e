"""Output of the commands: progress with time left, lines and tables."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.table import Table
from rich.text import Text

from simbench.cli.time_left import TimeLeft, duration
from simbench.core.text import printable

if TYPE_CHECKING:
    from simbench.evaluation.scores import Scores
    from simbench.evaluation.statistics.comparison import Contest
    from simbench.runtime.run_jobs import Progress as ReportProgress

__all__ = [
    "SCORE_COLUMNS",
    "interruptible",
    "print_line",
    "print_table",
    "progress_bar",
    "score_table",
]

_LINE_EVERY_S = 15.0

SCORE_COLUMNS: Final = {
    "precision_20": ("precision", "{:.3f}"),
    "success_50": ("success", "{:.3f}"),
    "success_auc": ("area", "{:.3f}"),
    "center_error_px": ("error", "{:.1f}"),
    "particles_mean": ("particles", "{:.0f}"),
    "fps": ("fps", "{:.0f}"),
}
"""Measures of the score table, with their headings and number formats."""
_BETTER: Final = {
    "precision_20": 1,
    "success_50": 1,
    "success_auc": 1,
    "center_error_px": -1,
}

_WHOLE: Final = {"error", "particles", "fps"}
"""Columns that do not wrap where the terminal is narrow: numbers without interval."""
_TABLE: Final[dict[str, Any]] = {
    "box": SIMPLE_HEAD,
    "padding": (0, 1, 0, 0),
    "show_edge": False,
    "pad_edge": False,
}


@contextmanager
def progress_bar(
    console: Console, hint: str, kind: str = "run", units: float | None = None
) -> Iterator[ReportProgress]:
    """Yield a function to call with work done, total work and the current task.

    On a terminal it moves a bar with the time left; elsewhere, as in a CI log, it
    prints a line every 15 s.

    Parameters
    ----------
    console : rich.console.Console
    hint : str
        See `interruptible`.
    kind : str
        Kind of work, whose speed is remembered for the next time.
    units : float, optional
        Size of the work, see `simbench.cli.time_left.TimeLeft`.
    """
    time_left = TimeLeft(kind, units)
    with interruptible(hint):
        if console.is_terminal:
            with _moving_bar(console, time_left) as report:
                yield report
        else:
            yield _progress_lines(console, time_left)
        time_left.remember()


@contextmanager
def interruptible(hint: str) -> Iterator[None]:
    """Turn Ctrl-C into one line, which ends with a hint, and exit status 130."""
    import typer

    try:
        yield
    except KeyboardInterrupt:
        print_line(Console(stderr=True), f"simbench: stopped; {hint}")
        raise typer.Exit(130) from None


def score_table(scores: Scores) -> Table:
    """Return means over instances as a table, one row a scenario and tracker.

    Shares have their interval on a second line; bold means that no other tracker is
    shown to be better.
    """
    from simbench.evaluation.statistics.comparison import contest_in
    from simbench.evaluation.statistics.instance_statistics import summary
    from simbench.evaluation.statistics.intervals import LEAST_COUNT

    caption = (
        "means over seeds: precision at 20 px, success at overlap 0.5, area under the "
        "success curve, error in px at the centre, particles per frame, frames/s\n"
        f"below: 95 % interval of the mean; with fewer than {LEAST_COUNT} seeds "
        "(n too small) there is none, and the range stands there\n"
        "bold: no other is shown to be better (if seeds suffice); = : does not "
        "discriminate, as 'still' ties the best"
    )
    table = Table(caption=caption, **_TABLE)
    for title in ("scenario", "tracker"):
        table.add_column(title, overflow="fold")
    for title, _ in SCORE_COLUMNS.values():
        table.add_column(title, justify="right", no_wrap=title in _WHOLE)
    means = summary(scores.runs, list(SCORE_COLUMNS))
    for place, rows in means.groupby(["scenario", "variant"], sort=False):
        if len(table.rows):
            table.add_section()
        name = "@".join(filter(None, map(str, place)))
        runs = scores.runs
        of_place = runs[(runs["scenario"] == place[0]) & (runs["variant"] == place[1])]
        contests = {
            measure: contest_in(of_place, measure, _BETTER.get(measure, 0))
            for measure in SCORE_COLUMNS
        }
        for index, (_, row) in enumerate(rows.iterrows()):
            cells = [
                _score_cell(row, measure, contests[measure])
                for measure in SCORE_COLUMNS
            ]
            place_cell = _cell(name)
            if index == 0:
                place_cell.append(_count(int(row["seeds"])), "dim")
            table.add_row(place_cell, _cell(row["tracker"]), *cells)
    return table


def _count(seeds: int) -> str:
    """Return the number of instances, and whether they are too few for intervals."""
    from simbench.evaluation.statistics.intervals import LEAST_COUNT

    return f"\nn = {seeds}" + ("\ntoo small" if seeds < LEAST_COUNT else "")


def _score_cell(row: Any, measure: str, contest: Contest) -> Text:
    """Return a mean with its interval; bold if no other is shown to be better."""
    from simbench.evaluation.statistics.instance_statistics import is_share
    from simbench.evaluation.statistics.intervals import describe_interval

    is_best = row["tracker"] in contest.best
    number = _number(row[f"{measure}.mean"], SCORE_COLUMNS[measure][1])
    cell = Text(number + ("=" if contest.is_flat else ""), "bold" if is_best else "")
    low, high, least, most = (
        row[f"{measure}.{part}"] for part in ("low", "high", "min", "max")
    )
    if is_share(measure):
        interval = describe_interval(low, high, least, most, 2)
        if interval.startswith("n too small, "):  # which stands beside the scenario
            interval = f"{least:.2f} – {most:.2f}"
        cell.append(f"\n{interval}" if interval else "", "dim")
    return cell


def print_table(
    console: Console, headings: Sequence[str], rows: Iterable[Sequence[str]]
) -> None:
    """Print a plain table; a cell may have several lines, and long words are folded."""
    table = Table(**_TABLE)
    for heading in headings:
        table.add_column(heading, overflow="fold")
    for row in rows:
        table.add_row(*map(_cell, row))
    console.print(table)


def print_line(console: Console, text: str, style: str | None = None) -> None:
    """Print text on one line, without markup or highlighting, see `printable`."""
    line = Text(printable(text), style=style or "")
    console.print(line, highlight=False, soft_wrap=True)


def _cell(text: str) -> Text:
    return Text(printable(text, lines=True))


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else form.format(value)


@contextmanager
def _moving_bar(console: Console, time_left: TimeLeft) -> Iterator[ReportProgress]:
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[left]}", markup=False),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        row = bar.add_task("starting", total=None, left="")

        def report(done: float, total: float, task: str) -> None:
            left_s = time_left.update(done, total)
            left = "" if left_s is None else f"{duration(left_s)} left"
            title = printable(task)
            bar.update(row, completed=done, total=total, description=title, left=left)

        yield report


def _progress_lines(console: Console, time_left: TimeLeft) -> ReportProgress:
    last = time.monotonic()

    def report(done: float, total: float, task: str) -> None:
        nonlocal last
        left_s, now = time_left.update(done, total), time.monotonic()
        if now - last < _LINE_EVERY_S or left_s is None:
            return
        last = now
        share = f"{100 * done / total:3.0f} %"
        print_line(console, f"{share}, about {duration(left_s)} left; {task}")

    return report
