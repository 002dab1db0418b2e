"""Commands that make pictures: ``generate`` and ``show``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Frames, Names, Seeds, scenarios_from
from simbench.cli.display import interruptible, progress_bar

__all__ = ["generate", "show"]


def generate(
    scenarios: Names,
    out: Annotated[Path, typer.Option(help="Folder for the sequences.")],
    seeds: Seeds = "0:1",
    frames: Frames = None,
) -> None:
    """Film scenarios into folders OUT/SCENARIO-SEED; finished ones are left alone."""
    from simbench import generation
    from simbench.running.request import parse_seeds

    wanted = [
        (scenario, seed, out / f"{scenario.name}-{seed:04d}")
        for scenario in scenarios_from(scenarios, frames)
        for seed in parse_seeds(seeds)
    ]
    console = Console()
    all_frames = sum(scenario.frames for scenario, _, _ in wanted)
    before = 0
    with (
        interruptible("the same command goes on from here"),
        progress_bar(console) as tell,
    ):
        for scenario, seed, folder in wanted:
            title = f"filming: {scenario.name}, seed {seed}"

            def step(
                done: int, _: int, before: int = before, what: str = title
            ) -> None:
                tell(before + done, all_frames, what)

            if generation.finished_sequence(folder, scenario, seed) is None:
                generation.generate(scenario, seed, folder, progress=step)
            before += scenario.frames
    for _, _, folder in wanted:
        console.print(str(folder), highlight=False, soft_wrap=True)


def show(
    name: Annotated[str, typer.Argument(metavar="SCENARIO", help="Name or YAML file.")],
    out: Annotated[
        Path | None, typer.Option(help="PNG to write; default: SCENARIO.png here.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sequence.")] = 0,
    frame: Annotated[int, typer.Option(min=0, help="Which frame, from 0.")] = 0,
) -> None:
    """Film a scenario's first frame, draw the truth into it, and write a PNG."""
    from simbench.showing import write_picture

    (scenario,) = scenarios_from([name], None)
    path = out or Path(f"{scenario.name}.png")
    with interruptible("nothing was written"):
        write_picture(scenario, seed, frame, path)
    Console().print(str(path), highlight=False, soft_wrap=True)
