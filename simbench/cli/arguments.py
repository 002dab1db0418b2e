"""Arguments that several commands share, and the parsing of their values."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.display import print_line
from simbench.cli.names import (
    PROTOCOLS,
    RULES,
    complete_protocol,
    complete_rules,
    complete_scenario,
    complete_trackers,
    scenario_names,
    tracker_names,
)
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
    "ProtocolName",
    "Repetitions",
    "Replace",
    "RulesName",
    "Seeds",
    "Timeout",
    "Trackers",
    "most_frames",
    "prepare_workers",
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
        autocompletion=complete_scenario,
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
    str,
    typer.Option(
        help="Comma-separated names; in full LABEL=NAME@PARAM=VALUE.",
        autocompletion=complete_trackers,
    ),
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
RulesName = Annotated[
    str,
    typer.Option(
        "--rules",
        metavar="|".join(RULES),
        help="By whose rules to score; no tracker runs again for others.",
        autocompletion=complete_rules,
    ),
]
ProtocolName = Annotated[
    str,
    typer.Option(
        "--protocol",
        metavar="|".join(PROTOCOLS),
        help="Where trackers start: once, at many frames, from wrong boxes, again "
        "after failures, forwards and backwards from anchors.",
        autocompletion=complete_protocol,
    ),
]
Frames = Annotated[
    int | None,
    typer.Option(min=2, help="Shorten scenarios to this many frames, then set dials."),
]


def recipes_from(names: list[str], frames: int | None) -> list[Recipe]:
    """Read scenarios whose values may be sampled, shortened to ``frames`` if given.

    Raises
    ------
    SimbenchError
        If one cannot be read, or none has so many frames.
    """
    from simbench.scenarios.files.loading import load_recipes

    _require_single_names(names)
    recipes = [recipe for name in names for recipe in load_recipes(name)]
    if frames is not None:
        _require_long(frames, {one.label: most_frames(one) for one in recipes})
    return [recipe.shortened(frames) for recipe in recipes]


def prepare_workers(jobs: int | None, cluster: str, *, renders: bool = True) -> None:
    """Let worker processes begin their imports while this process goes on with its own.

    Parameters
    ----------
    jobs : int, optional
        Number of worker processes; 0 for none.
    cluster : str
        Address of a cluster, whose workers are not started here; empty for none.
    renders : bool
        Whether the command makes films: what that needs is imported, and it is found
        out which OpenGL renders.
    """
    if jobs != 0 and not cluster:
        from simbench.runtime.forked_process import start_fork_server
        from simbench.runtime.opengl_renderer import look_for_opengl

        start_fork_server(renders=renders)
        if renders:
            look_for_opengl()


def most_frames(recipe: Recipe) -> int:
    """Return the largest number of frames that a scenario of the recipe has."""
    value = recipe.content.get("frames")
    if isinstance(value, Mapping):
        value = max(value.get("range") or value.get("choice") or (0,))
    return min(int(value or 0), recipe.most_frames or sys.maxsize)


def scenarios_from(names: list[str], frames: int | None) -> tuple[Scenario, ...]:
    """Read scenarios with fixed values, shortened to ``frames`` if given.

    Raises
    ------
    SimbenchError
        As `recipes_from`.
    """
    from simbench.scenarios.files.loading import load_variants

    _require_single_names(names)
    found = [scenario for name in names for scenario in load_variants(name)]
    if frames is None:
        return tuple(found)
    _require_long(frames, {one.full_name: one.frames for one in found})
    return tuple(scenario.shortened(frames) for scenario in found)


def _require_single_names(names: list[str]) -> None:
    """Name two common slips: commas between scenarios, blanks between trackers."""
    known = scenario_names()
    for name in names:
        parts = [part.strip() for part in name.split(",")]
        if len(parts) > 1 and all(part.partition("@")[0] in known for part in parts):
            spaced = " ".join(parts)
            raise SimbenchError(
                f"scenarios: expected blanks between names, {spaced!r}, got {name!r}"
            )
        if name not in known and name in tracker_names():
            raise SimbenchError(
                f"scenarios: {name} is a tracker: expected --trackers with commas "
                "between names, and no blanks"
            )


def _require_long(frames: int, lengths: dict[str, int]) -> None:
    """Refuse more frames than any scenario has, and name those that have fewer."""
    longest = max(lengths, key=lambda name: lengths[name])
    if frames > lengths[longest]:
        raise SimbenchError(
            f"--frames: expected at most {lengths[longest]}, the length of {longest}, "
            f"got {frames}"
        )
    short = [f"{name} ({n})" for name, n in lengths.items() if n < frames]
    if short:
        more = f" and {len(short) - 3} more" if len(short) > 3 else ""
        print_line(
            Console(stderr=True),
            f"simbench: note: --frames {frames} leaves shorter scenarios whole: "
            f"{', '.join(short[:3])}{more}",
        )


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
