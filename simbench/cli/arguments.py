"""Arguments that several commands share, and the parsing of their values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.scenarios.files.recipe import Recipe
    from simbench.scenarios.schema import Scenario
    from simbench.trackers.find_tracker import TrackerSpec

__all__ = [
    "Cluster",
    "Frames",
    "Jobs",
    "Memory",
    "Names",
    "Out",
    "Repetitions",
    "Replace",
    "Seeds",
    "Timeout",
    "Trackers",
    "recipes_from",
    "scenarios_from",
    "tracker_specs",
    "trackers_from",
]

Names = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENARIO...",
        help="Names from 'simbench list', NAME@VARIANT, NAME@all, or YAML files.",
    ),
]
Seeds = Annotated[
    str, typer.Option(help="Half-open range 0:5, or numbers 0,3,7, or both.")
]
Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        "-j",
        min=0,
        max=256,
        help="Worker processes; default: one a core; 0: this process (for pdb).",
    ),
]
Cluster = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS",
        help="Dask scheduler such as tcp://host:8786, whose workers run the jobs.",
    ),
]
Trackers = Annotated[
    str, typer.Option(help="Comma-separated names; in full LABEL=NAME@PARAM=VALUE.")
]
Repetitions = Annotated[
    int, typer.Option(min=1, help="Runs of each tracker on the same sequence.")
]
Out = Annotated[
    Path | None,
    typer.Option(help="Run folder; default: one in results/runs for this request."),
]
Timeout = Annotated[
    float, typer.Option(help="Time limit of one tracker on one sequence, s.")
]
Memory = Annotated[
    int,
    typer.Option("--memory-mb", help="Memory limit of a tracker's process, MiB."),
]
Replace = Annotated[
    bool,
    typer.Option(
        "--replace",
        help="Run finished parts again, and replace results of the same names.",
    ),
]
Frames = Annotated[
    int | None,
    typer.Option(min=2, help="Shorten scenarios to this many frames, then set dials."),
]


def recipes_from(names: list[str], frames: int | None) -> list[Recipe]:
    """Read scenarios whose values may be sampled, shortened to ``frames`` if given."""
    from simbench.scenarios.files.recipe import load_recipes

    return [recipe.shortened(frames) for name in names for recipe in load_recipes(name)]


def scenarios_from(names: list[str], frames: int | None) -> tuple[Scenario, ...]:
    """Read scenarios with fixed values, shortened to ``frames`` if given."""
    from simbench.scenarios.files.loading import load_variants

    found = [scenario for name in names for scenario in load_variants(name)]
    return tuple(s if frames is None else s.shortened(frames) for s in found)


def trackers_from(text: str) -> tuple[TrackerSpec, ...]:
    """Find the trackers of a comma-separated list."""
    from simbench.trackers.find_tracker import find_tracker

    return tuple(find_tracker(spec) for spec in tracker_specs(text))


def tracker_specs(text: str) -> list[str]:
    """Split a comma-separated list into arguments of `find_tracker`."""
    specs = [spec.strip() for spec in text.split(",")]
    if not all(specs):
        raise SimbenchError(f"--trackers must be names between commas, got {text!r}")
    return specs
