"""The command ``probe``: what the seeds of a scenario show, without their pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs, Seeds, scenarios_from
from simbench.cli.display import print_line, print_table, progress_bar

if TYPE_CHECKING:
    from collections.abc import Sequence

    from simbench.generation.instances.probe import Instance

__all__ = ["probe"]

_HEADINGS = ("scenario", "seeds", "refused", "beside the point", "overlap", "still")


def probe(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENARIO...]",
            help="Names, NAME@VARIANT, NAME@all or YAML files; default: the library.",
        ),
    ] = None,
    seeds: Seeds = "0:20",
    sheet: Annotated[
        Path | None,
        typer.Option(
            dir_okay=False, help="PNG to write: first frames with the targets' tracks."
        ),
    ] = None,
    jobs: Jobs = None,
) -> None:
    """Check that seeds of scenarios are taken and show what the scenario is about.

    Only the first frame is rendered, and of every third frame what hides the target.
    Prints how far the seeds differ (median overlap of any two tracks) and what a box
    that stays in place would score. Exit status 1 if a seed is refused or beside the
    point.
    """
    names = scenarios
    if not names:
        from simbench.scenarios.files.library import list_scenarios

        names = list_scenarios()
    found = scenarios_from(names, None)

    from simbench.experiments.request import parse_seeds
    from simbench.generation.instances.probe import probe_instances
    from simbench.generation.instances.sheet import write_sheet
    from simbench.runtime.versions import core_count

    console, numbers = Console(), parse_seeds(seeds)
    total = len(found) * len(numbers)
    with progress_bar(console, "nothing was written", "probe", total) as progress:
        instances = probe_instances(
            found, numbers, jobs=jobs or core_count(), progress=progress
        )
    _print(console, [one.full_name for one in found], instances)
    if sheet is not None:
        write_sheet(instances, sheet)
        print_line(console, str(sheet))
    is_good = not any(one.refusal or one.misses for one in instances)
    raise typer.Exit(0 if is_good else 1)


def _print(
    console: Console, names: Sequence[str], instances: Sequence[Instance]
) -> None:
    from simbench.generation.instances.probe import mean_still, median_overlap

    rows = []
    for name in names:
        own = [one for one in instances if one.scenario == name]
        taken = [one for one in own if not one.refusal]
        refused, missed = len(own) - len(taken), sum(bool(one.misses) for one in own)
        shares = median_overlap([one.boxes for one in taken]), mean_still(taken)
        texts = ["-" if share != share else f"{share:.2f}" for share in shares]
        rows.append([name, str(len(own)), str(refused), str(missed), *texts])
    print_table(console, _HEADINGS, rows)
    for one in instances:
        for line in (one.refusal, *one.misses):
            if line:
                print_line(console, f"{one.scenario}, seed {one.seed}: {line}", "red")
