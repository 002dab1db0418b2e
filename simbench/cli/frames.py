"""The command ``frames``: frames of a run that meet a condition, and their pictures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from simbench.cli.display import print_line, print_table, progress_bar

__all__ = ["frames"]

_HEADINGS = (
    "scenario",
    "seed",
    "tracker",
    "rep.",
    "frame",
    "time",
    "overlap",
    "visible",
    "conf.",
    "failure",
)


def frames(
    run_folder: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
    where: Annotated[
        str,
        typer.Option(
            help="Condition on columns, such as 'overlap < .2 and visible_fraction > "
            ".9'; docs/measures.md names them.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(file_okay=False, help="Folder for pictures; default: RUN/frames."),
    ] = None,
    limit: Annotated[
        int, typer.Option(min=1, max=10_000, help="Most frames to show.")
    ] = 50,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="Whether to write them.")
    ] = True,
) -> None:
    """List the frames of a run that meet a condition, and write their pictures.

    In a picture the true box is white and the estimate red. Sequences that the run did
    not keep are generated again.
    """
    from simbench.evaluation.frame_query import select_frames
    from simbench.evaluation.scores import Scores
    from simbench.experiments.frame_pictures import write_frame_pictures
    from simbench.experiments.run_folder import RunFolder

    RunFolder(run_folder).read_facts()  # a run folder, or a clear line
    found = select_frames(Scores.read(run_folder).frames, where)
    console = Console()
    shown = found.head(limit)
    if len(shown):
        print_table(console, _HEADINGS, map(_row, shown.to_dict("records")))
    count = f"{len(found)} frame{'' if len(found) == 1 else 's'}"
    rest = f", the first {limit} listed (--limit)" if len(found) > limit else ""
    print_line(console, f"{count}{rest}")
    if not pictures or not len(shown):
        return
    folder = out or run_folder / "frames"
    with progress_bar(console, "the same command begins again", "frames") as progress:
        write_frame_pictures(run_folder, shown, folder, progress)
    print_line(console, f"pictures: {folder}")


def _row(row: dict[Any, Any]) -> list[str]:
    place = "@".join(filter(None, (row["scenario"], row["variant"])))
    seed = "-" if row["seed"] is None or row["seed"] != row["seed"] else row["seed"]
    return [
        place,
        str(seed),
        row["tracker"],
        str(row["repetition"]),
        str(row["frame"]),
        f"{row['time_s']:.2f}",
        *(_share(row[name]) for name in ("overlap", "visible_fraction", "confidence")),
        row["failure"] or "-",
    ]


def _share(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2f}"
