"""The command ``show``: a picture or video of a scenario, or what a tracker is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Frames, recipes_from
from simbench.cli.display import interruptible, print_line, progress_bar
from simbench.cli.names import (
    complete_scenario_or_tracker,
    scenario_names,
    tracker_names,
)
from simbench.core.errors import SimbenchError
from simbench.core.text import did_you_mean

__all__ = ["show"]


def show(
    name: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO|TRACKER",
            help="Name from 'simbench list', YAML file, or a tracker as for run.",
            autocompletion=complete_scenario_or_tracker,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(dir_okay=False, help="PNG to write; default: SCENARIO.png here."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sequence.")] = 0,
    frame: Annotated[
        int | None, typer.Option(min=0, help="Which frame, from 0; default: the first.")
    ] = None,
    plain: Annotated[
        bool, typer.Option("--plain", help="Leave out the ground truth.")
    ] = False,
    video: Annotated[
        Path | None,
        typer.Option(
            dir_okay=False, help="Write all frames to this .mp4 or .avi instead."
        ),
    ] = None,
    frames: Frames = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Overwrite the video.")
    ] = False,
    is_tracker: Annotated[
        bool, typer.Option("--tracker", help="Take the name for a tracker's.")
    ] = False,
) -> None:
    """Render a frame of a scenario with the truth drawn in, or describe a tracker.

    With --video all frames are written. Of a tracker its parameters, its paper and an
    example are printed; a name of both is taken for the scenario's.
    """
    if is_tracker or _is_tracker(name):
        if out or video or frame is not None or frames or plain:
            raise SimbenchError(f"{name} is a tracker: expected no option for pictures")
        from simbench.cli.tracker_page import print_tracker

        print_tracker(Console(), name)
        return
    if video is not None and (out is not None or frame is not None):
        raise SimbenchError("--video writes all frames: leave --out and --frame out")
    if video is None and (frames is not None or replace):
        raise SimbenchError("--frames and --replace go with --video")

    # before the heavy imports: a mistake in the file is reported at once
    recipe, *others = recipes_from([name], frames)
    if others:
        raise SimbenchError(f"{name}: show takes one variant, got {1 + len(others)}")
    scenario = recipe.scenario(seed)

    from simbench.experiments.request import path_safe
    from simbench.generation.preview import write_preview, write_video

    if video is not None:
        units = scenario.frames
        console = Console()
        with progress_bar(console, "nothing was written", "show", units) as progress:
            path = write_video(
                scenario, seed, video, plain=plain, replace=replace, progress=progress
            )
    else:
        path = out or Path(f"{path_safe(scenario.full_name)}.png")
        with interruptible("nothing was written"):
            write_preview(scenario, seed, frame or 0, path, plain=plain)
    print_line(Console(), str(path))


def _is_tracker(name: str) -> bool:
    """Whether a name is a tracker's and no scenario's.

    Raises
    ------
    SimbenchError
        If it is neither.
    """
    head = name.partition("@")[0]
    tracker = head.rpartition("=")[2]
    trackers = tracker_names()
    if head in scenario_names():
        if head in trackers:
            note = f"simbench: note: for the tracker {head} pass --tracker"
            print_line(Console(stderr=True), note)
        return False
    if head.endswith((".yaml", ".yml")) or "/" in head:
        return False
    if tracker in trackers or ":" in tracker:
        return True

    from simbench.trackers.parts.opencv_build import opencv_tracker_names

    if tracker in opencv_tracker_names():
        return True
    known = [*scenario_names(), *trackers, *opencv_tracker_names()]
    hint = did_you_mean(tracker, known) or "; 'simbench list' prints them"
    raise SimbenchError(f"expected a scenario or a tracker, got {name!r}{hint}")
