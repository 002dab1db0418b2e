"""Commands that make pictures: ``generate`` and ``show``."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Cluster, Frames, Jobs, Names, recipes_from
from simbench.cli.display import interruptible, progress_bar
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.generation.dataset.produce import ProductionResult
    from simbench.generation.dataset.request import Batch, DatasetRequest
    from simbench.scenarios.files.recipe import Recipe

__all__ = ["generate", "show"]

MOST = 1_000_000
_LINES = 20  # of what failed; all of it stands in the data set


def generate(
    scenarios: Names,
    out: Annotated[
        str, typer.Option(metavar="DIR|URL", help="Folder, or any fsspec URL.")
    ],
    count: Annotated[
        int | None,
        typer.Option(
            min=1, max=MOST, help="Sequences in all, spread evenly over the scenarios."
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="With --count: the first seed of each.")
    ] = None,
    seeds: Annotated[
        str | None,
        typer.Option(help="Of each scenario: 0:5, or numbers 0,3,7, or both."),
    ] = None,
    layout: Annotated[
        str,
        typer.Option(
            "--format",
            help="native, got10k, vot, otb, mot17, davis, youtube-vis or coco.",
        ),
    ] = "native",
    split: Annotated[
        str,
        typer.Option(help="train, val or test; by default what readers look at first."),
    ] = "",
    channels: Annotated[
        str, typer.Option(help="Beside the pictures: depth, flow, or both by a comma.")
    ] = "",
    licence: Annotated[
        str, typer.Option(help="Of the pictures, for the data set's card.")
    ] = "",
    replace: Annotated[
        bool,
        typer.Option(
            "--replace",
            help="Make finished sequences again that would come out otherwise now.",
        ),
    ] = False,
    frames: Frames = None,
    jobs: Jobs = None,
    cluster: Cluster = "",
) -> None:
    """Make a data set; the same call again goes on where it stopped.

    A scenario that cannot be told costs its own sequence; the exit status is then 1.
    """
    from simbench.datasets.channels import require_known
    from simbench.generation.dataset.produce import produce_dataset
    from simbench.generation.dataset.request import DatasetRequest
    from simbench.runtime.versions import core_count

    recipes = recipes_from(scenarios, frames)
    batches = _batches(recipes, count, seed, seeds)
    recorded = require_known(filter(None, channels.replace(" ", "").split(",")))
    wanted = DatasetRequest(batches, layout, split, recorded)
    console = Console()
    with (
        interruptible("the same command goes on from here"),
        progress_bar(console) as progress,
    ):
        outcome = produce_dataset(
            wanted,
            out,
            command=shlex.join(["simbench", *sys.argv[1:]]),
            licence=licence,
            replace=replace,
            jobs=jobs or core_count(),
            cluster=cluster,
            progress=progress,
        )
    _print(console, outcome, out, wanted)
    raise typer.Exit(1 if outcome.lost else 0)


def _batches(
    recipes: list[Recipe], count: int | None, seed: int | None, seeds: str | None
) -> tuple[Batch, ...]:
    from simbench.experiments.request import parse_seeds
    from simbench.generation.dataset.request import Batch, spread

    if count is not None and seeds is not None:
        raise SimbenchError("--count counts seeds up by itself: leave --seeds out")
    if count is not None:
        return spread(recipes, count, seed or 0)
    if seed is not None:
        raise SimbenchError("--seed goes with --count; else say --seeds")
    return tuple(Batch(recipe, parse_seeds(seeds or "0")) for recipe in recipes)


def _print(
    console: Console, outcome: ProductionResult, out: str, wanted: DatasetRequest
) -> None:
    def line(text: str, style: str | None = None) -> None:
        console.print(text, style=style, highlight=False, markup=False, soft_wrap=True)

    lost = [f"failed: {name}: {reason}" for name, reason in outcome.lost.items()]
    for text in lost[:_LINES]:
        line(text, "red")
    if len(lost) > _LINES:
        line(f"failed: {len(lost) - _LINES} more, see dataset.json", "red")
    there = f", {outcome.kept} were there" if outcome.kept else ""
    again = f", {outcome.again} of them again" if outcome.again else ""
    failed = f", {len(lost)} failed" if lost else ""
    line(f"{outcome.made} of {len(wanted)} sequences made{again}{there}{failed}: {out}")
    if wanted.layout == "native" and len(wanted) <= _LINES:
        for wish in wanted:
            if wish.name not in outcome.lost:
                line(f"{out.rstrip('/')}/{wish.name}")


def show(
    name: Annotated[str, typer.Argument(metavar="SCENARIO", help="Name or YAML file.")],
    out: Annotated[
        Path | None,
        typer.Option(dir_okay=False, help="PNG to write; default: SCENARIO.png here."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sequence.")] = 0,
    frame: Annotated[int, typer.Option(min=0, help="Which frame, from 0.")] = 0,
) -> None:
    """Film a scenario up to one frame, draw the truth into it, and write a PNG."""
    from simbench.experiments.request import full_name, path_safe
    from simbench.generation.preview import write_picture
    from simbench.scenarios.files.recipe import load_recipe

    scenario = load_recipe(name).scenario(seed)
    path = out or Path(f"{path_safe(full_name(scenario))}.png")
    with interruptible("nothing was written"):
        write_picture(scenario, seed, frame, path)
    Console().print(str(path), highlight=False, soft_wrap=True)
