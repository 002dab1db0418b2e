"""Output of the commands: progress with time left, lines and tables."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

if TYPE_CHECKING:
    from simbench.evaluation.scores import Scores
    from simbench.runtime.run_jobs import Progress as ReportProgress

__all__ = [
    "interruptible",
    "print_line",
    "print_table",
    "progress_bar",
    "score_table",
]

_LINE_EVERY_S = 15.0
_LEAST_SHARE = 0.02  # of the work done, before the time left is estimated

_TABLE: Final[dict[str, Any]] = {
    "box": SIMPLE_HEAD,
    "padding": (0, 1, 0, 0),
    "show_edge": False,
    "pad_edge": False,
}


@contextmanager
def progress_bar(console: Console, hint: str) -> Iterator[ReportProgress]:
    """Yield a function to call with work done, total work and the current task.

    On a terminal it moves a bar with the time left; elsewhere, as in a CI log, it
    prints a line every 15 s.

    Parameters
    ----------
    console : rich.console.Console
    hint : str
        See `interruptible`.
    """
    with interruptible(hint):
        if not console.is_terminal:
            yield _progress_lines(console)
            return
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=console, transient=True) as bar:
            row = bar.add_task("starting", total=None)
            yield lambda done, total, task: bar.update(
                row, completed=done, total=total, description=task
            )


@contextmanager
def interruptible(hint: str) -> Iterator[None]:
    """Turn Ctrl-C into one line, which ends with a hint, and exit status 130."""
    import typer

    try:
        yield
    except KeyboardInterrupt:
        Console(stderr=True).print(f"simbench: stopped; {hint}", highlight=False)
        raise typer.Exit(130) from None


def score_table(scores: Scores) -> Table:
    """Return means over seeds as a table, one row a scenario, variant and tracker."""
    from simbench.evaluation.statistics import summary

    measures = {
        "precision_20": ("precision", "{:.3f}"),
        "success_50": ("success", "{:.3f}"),
        "success_auc": ("area", "{:.3f}"),
        "center_error_px": ("error", "{:.1f}"),
        "particles_mean": ("particles", "{:.0f}"),
        "fps": ("fps", "{:.0f}"),
    }
    caption = (
        "means over seeds: precision at 20 px, success at overlap 0.5, area under the "
        "success curve, error in px at the centre, particles per frame, frames/s"
    )
    table = Table("scenario", "tracker", caption=caption, **_TABLE)
    for title, _ in measures.values():
        table.add_column(title, justify="right")
    means = summary(scores.runs, list(measures))
    last = None
    for _, row in means.iterrows():
        name = "@".join(filter(None, (row["scenario"], row["variant"])))
        if last not in (None, name):
            table.add_section()
        last = name
        cells = [_number(row[f"{m}.mean"], form) for m, (_, form) in measures.items()]
        table.add_row(name, row["tracker"], *cells)
    return table


def print_table(
    console: Console, headings: Sequence[str], rows: Iterable[Sequence[str]]
) -> None:
    """Print a plain table."""
    table = Table(*headings, **_TABLE)
    for row in rows:
        table.add_row(*row)
    console.print(table)


def print_line(console: Console, text: str, style: str | None = None) -> None:
    """Print text as it is: on one line, without markup or highlighting."""
    console.print(text, style=style, highlight=False, markup=False, soft_wrap=True)


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else form.format(value)


def _progress_lines(console: Console) -> ReportProgress:
    start = time.monotonic()
    last = start

    def report(done: float, total: float, task: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < _LINE_EVERY_S or not _LEAST_SHARE * total < done < total:
            return
        last = now
        left_s = (now - start) * (total - done) / done
        share = f"{100 * done / total:3.0f} %"
        print_line(console, f"{share}, about {left_s:.0f} s left; {task}")

    return report
