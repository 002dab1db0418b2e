"""The command ``evaluate``: trackers on data that exist, recorded or generated."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import (
    Cluster,
    Jobs,
    Memory,
    Out,
    ProtocolName,
    Repetitions,
    Replace,
    RulesName,
    Timeout,
    Trackers,
    prepare_workers,
    trackers_from,
)
from simbench.cli.display import progress_bar
from simbench.cli.json_output import Json
from simbench.cli.names import (
    LAYOUTS,
    PROTOCOLS,
    RULES,
    complete_layout,
    require_name,
)
from simbench.cli.run import DEFAULT_TRACKERS, execute_request, show_result
from simbench.core.errors import SimbenchError

__all__ = ["evaluate"]

_BOX = "left,top,width,height"


def evaluate(
    datasets: Annotated[
        list[Path],
        typer.Argument(
            metavar="DATASET...",
            help="Sequences, folders of sequences, or a video or pictures with --box.",
        ),
    ],
    trackers: Trackers = DEFAULT_TRACKERS,
    repetitions: Repetitions = 1,
    layout: Annotated[
        str,
        typer.Option(
            help="Layout, where the files do not tell it: otb, vot, ...",
            autocompletion=complete_layout,
        ),
    ] = "",
    origin: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=1,
            help="Number of the first pixel in boxes; default: usual in the layout.",
        ),
    ] = None,
    box: Annotated[
        str,
        typer.Option(
            metavar="X,Y,W,H",
            help="Target in the first frame of a video or of pictures, px from 0.",
        ),
    ] = "",
    target: Annotated[
        str, typer.Option(metavar="ID", help="Which of several annotated objects.")
    ] = "",
    skip_broken: Annotated[
        bool,
        typer.Option("--skip-broken", help="Leave out sequences that are damaged."),
    ] = False,
    out: Out = None,
    jobs: Jobs = None,
    timeout: Timeout = 300.0,
    memory_mb: Memory = 4096,
    replace: Replace = False,
    cluster: Cluster = "",
    rules: RulesName = "simbench",
    protocol: ProtocolName = "ope",
    as_json: Json = False,
) -> None:
    """Run trackers on data sets, score and report; the same command resumes.

    Layouts: simbench's own, OTB, TLP, GOT-10k, LaSOT, VOT, UAV123, NfS, MOT17, DAVIS,
    COCO and YouTube-VIS, told apart by their files. Results go to a run folder as
    those of 'simbench run', and may share one with them.
    """
    require_name("--rules", rules, RULES)
    require_name("--protocol", protocol, PROTOCOLS)
    if layout:
        require_name("--layout", layout, LAYOUTS)
    first_box = _box_from(box) if box else None
    prepare_workers(jobs, cluster, renders=False)

    from simbench.datasets.formats.readers.annotation import ReadOptions
    from simbench.experiments.clips import find_clips
    from simbench.experiments.request import Request

    console = Console()
    specs = trackers_from(trackers)
    options = ReadOptions(layout, origin, first_box, target)
    with progress_bar(console, "nothing was changed", "evaluate") as progress:
        clips = find_clips(
            datasets, options, skip_broken=skip_broken, progress=progress
        )
    limits = timeout, memory_mb
    request = Request(
        (), specs, (), repetitions, *limits, clips=clips, protocol=protocol
    )
    result = execute_request(
        console,
        request,
        out,
        jobs=jobs,
        cluster=cluster,
        replace=replace,
        rules=rules,
    )
    show_result(console, result, "evaluate", as_json=as_json)


def _box_from(text: str) -> tuple[float, float, float, float]:
    """Read the box of the first frame."""
    try:
        left, top, width, height = (float(part) for part in text.split(","))
    except ValueError:
        raise SimbenchError(f"--box: expected {_BOX}, got {text!r}") from None
    numbers = left, top, width, height
    if not all(map(math.isfinite, numbers)) or width <= 0.0 or height <= 0.0:
        raise SimbenchError(
            f"--box: expected {_BOX} with width and height above 0, got {text!r}"
        )
    return numbers
