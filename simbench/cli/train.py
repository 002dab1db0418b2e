"""The command ``train``: networks that learn from generated films."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs, prepare_workers
from simbench.cli.display import print_line, progress_bar
from simbench.cli.names import TRAININGS, complete_training, require_name

if TYPE_CHECKING:
    from simbench.runtime.run_jobs import Progress

__all__ = ["train"]


def train(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help=f"One of {', '.join(TRAININGS)}.",
            autocompletion=complete_training,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Weights to write; default: NAME.npz in this folder."
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, max=2**32 - 1, help="Of weights and samples.")
    ] = 0,
    recipe: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="YAML file; default: the recipe of the weights here."
        ),
    ] = None,
    sequences: Annotated[
        int | None,
        typer.Option(
            min=1, help="Films in place of the recipe's; rounded up to all scenarios."
        ),
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(min=1, help="Steps in place of the recipe's.")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Overwrite an existing file.")
    ] = False,
    jobs: Jobs = None,
) -> None:
    """Train a network on generated films, and write its weights and a card.

    Films are kept in the user's cache folder. The same recipe and seed give the same
    bytes on one machine and device. All but nbrf need the extra 'train'.
    """
    require_name("NAME", name, TRAININGS)
    prepare_workers(jobs, "")

    from simbench.learning.train import train as train_network
    from simbench.runtime.versions import core_count

    console = Console()

    def show(kind: str, units: float | None) -> AbstractContextManager[Progress]:
        return progress_bar(console, "the same command goes on", kind, units)

    path = out or Path(f"{name}.npz")
    digest = train_network(
        name,
        path,
        recipe_path=recipe,
        sequences=sequences,
        iterations=iterations,
        seed=seed,
        replace=replace,
        jobs=core_count() if jobs is None else jobs,
        show=show,
    )
    print_line(console, f"{path}: {path.stat().st_size:,} bytes, SHA-256 {digest}")
