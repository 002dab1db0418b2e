"""The command ``generate``: data sets of rendered sequences."""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import (
    Cluster,
    Frames,
    Jobs,
    Names,
    most_frames,
    prepare_workers,
    recipes_from,
)
from simbench.cli.display import print_line, progress_bar
from simbench.cli.names import (
    CHANNELS,
    FORMATS,
    complete_channels,
    complete_format,
    require_name,
)
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.generation.dataset.produce import ProductionResult
    from simbench.generation.dataset.request import DatasetRequest, SeededRecipe
    from simbench.scenarios.files.recipe import Recipe

__all__ = ["generate"]

MOST = 1_000_000
MOST_CAMERAS = 32
_MOST_LINES = 20  # of failures, which dataset.json lists all


def generate(
    scenarios: Names,
    out: Annotated[
        str, typer.Option(metavar="DIR|URL", help="Folder, or any fsspec URL.")
    ],
    count: Annotated[
        int | None,
        typer.Option(
            min=1, max=MOST, help="Simulations, spread evenly over the scenarios."
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="With --count: first seed of each.")
    ] = None,
    seeds: Annotated[
        str | None,
        typer.Option(help="Of each scenario: range 0:5, or numbers 0,3,7, or both."),
    ] = None,
    layout: Annotated[
        str,
        typer.Option(
            "--format",
            help=f"One of {', '.join(FORMATS)}; see 'simbench list formats'.",
            autocompletion=complete_format,
        ),
    ] = "native",
    split: Annotated[
        str,
        typer.Option(help="train, val or test; default: what readers read first."),
    ] = "",
    channels: Annotated[
        str,
        typer.Option(
            help="Beside the images: depth, flow, or depth,flow.",
            autocompletion=complete_channels,
        ),
    ] = "",
    cameras: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=MOST_CAMERAS,
            help="Film each simulation by so many cameras; further ones are sampled.",
        ),
    ] = None,
    licence: Annotated[
        str, typer.Option(help="Of the images, for the card of the data set.")
    ] = "",
    replace: Annotated[
        bool, typer.Option("--replace", help="Overwrite outdated sequences.")
    ] = False,
    frames: Frames = None,
    jobs: Jobs = None,
    cluster: Cluster = "",
) -> None:
    """Generate a data set; the same command resumes a stopped call.

    A scenario that fails loses only its own sequences; the exit status is then 1.
    """
    require_name("--format", layout, FORMATS)
    requested_names = {
        require_name("--channels", name.strip(), CHANNELS)
        for name in channels.split(",")
        if name.strip()
    }
    channel_names = tuple(name for name in CHANNELS if name in requested_names)
    prepare_workers(jobs, cluster)

    from simbench.generation.dataset.produce import produce_dataset
    from simbench.generation.dataset.request import DatasetRequest
    from simbench.runtime.versions import core_count

    recipes = recipes_from(scenarios, frames)
    batches = _batches(recipes, count, seed, seeds)
    request = DatasetRequest(batches, layout, split, channel_names, cameras)
    console = Console()
    frames_in_all = sum(
        most_frames(recipe) * len(seeds) * request.cameras_of(recipe)
        for recipe, seeds in batches
    )
    with progress_bar(
        console, "the same command resumes it", "generate", frames_in_all
    ) as progress:
        result = produce_dataset(
            request,
            out,
            command=shlex.join(["simbench", *sys.argv[1:]]),
            licence=licence,
            replace=replace,
            jobs=jobs or core_count(),
            cluster=cluster,
            progress=progress,
        )
    _print_result(console, result, out, request)
    raise typer.Exit(1 if result.failed else 0)


def _batches(
    recipes: list[Recipe], count: int | None, seed: int | None, seeds: str | None
) -> tuple[SeededRecipe, ...]:
    from simbench.experiments.request import parse_seeds
    from simbench.generation.dataset.request import SeededRecipe, spread

    if count is not None and seeds is not None:
        raise SimbenchError("--count numbers the seeds: leave --seeds out")
    if count is not None:
        return spread(recipes, count, seed or 0)
    if seed is not None:
        raise SimbenchError("--seed goes with --count; otherwise use --seeds")
    return tuple(SeededRecipe(recipe, parse_seeds(seeds or "0")) for recipe in recipes)


def _print_result(
    console: Console, result: ProductionResult, out: str, request: DatasetRequest
) -> None:
    for name, reason in [*result.failed.items()][:_MOST_LINES]:
        print_line(console, f"failed: {name}: {reason}", "red")
    failed = len(result.failed)
    if failed > _MOST_LINES:
        more = failed - _MOST_LINES
        print_line(console, f"failed: {more} more, see dataset.json", "red")
    counts = [
        f"{result.made} of {len(request)} sequences made",
        f"{result.replaced} of them again" if result.replaced else "",
        f"{result.kept} existed" if result.kept else "",
        f"{failed} failed" if failed else "",
    ]
    print_line(console, f"{', '.join(filter(None, counts))}: {out}")
    if request.layout == "native" and len(request) <= _MOST_LINES:
        for sequence in request:
            if sequence.name not in result.failed:
                print_line(console, f"{out.rstrip('/')}/{sequence.name}")
