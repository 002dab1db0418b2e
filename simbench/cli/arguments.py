"""Arguments that several commands share, and the reading of their values."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from simbench.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.scenarios.schema import Scenario
    from simbench.trackers.finding import TrackerSpec

__all__ = ["Frames", "Jobs", "Names", "Seeds", "scenarios_from", "trackers_from"]

Names = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENARIO...", help="Names from 'simbench list', or YAML files."
    ),
]
Seeds = Annotated[
    str, typer.Option(help="Half-open range 0:5, or numbers 0,3,7, or both.")
]
Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs", "-j", min=1, max=256, help="Processes at a time; default: all cores."
    ),
]
Frames = Annotated[
    int | None, typer.Option(min=2, help="Cut each scenario to this many frames.")
]


def scenarios_from(names: list[str], frames: int | None) -> tuple[Scenario, ...]:
    """Read scenarios, cut to ``frames`` where given."""
    from simbench.scenarios.loading import load_scenario

    found = [load_scenario(name) for name in names]
    return tuple(s if frames is None else s.shortened(frames) for s in found)


def trackers_from(text: str) -> tuple[TrackerSpec, ...]:
    """Find the trackers of a comma-separated list."""
    from simbench.trackers.finding import find_tracker

    specs = [spec.strip() for spec in text.split(",")]
    if not all(specs):
        raise SimbenchError(f"--trackers must be names between commas, got {text!r}")
    return tuple(find_tracker(spec) for spec in specs)
