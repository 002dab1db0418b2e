"""The filters before, now, and by the papers: ``python -m tests.filters BASE``.

``make filters BASE=COMMIT`` runs it, with ``FILTERS_OPTIONS="--clips FOLDER"``. It
films the library with the present commit, runs the trackers of both commits over the
same films and clips, and writes ``results/papers/filters.md``. Called again it goes on
where it stopped; films and rows are in the work folder.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from rich.console import Console

from simbench.cli.display import progress_bar
from simbench.cli.time_left import duration
from simbench.datasets.formats.readers.annotation import Place, ReadOptions
from simbench.experiments.clips import Clip, find_clips
from simbench.experiments.request import parse_seeds
from simbench.runtime.versions import core_count, host, versions
from simbench.scenarios.files.loading import load_variants
from tests.beside.checkout import (
    ROOT,
    checked_out,
    full_commit,
    is_changed,
    require_dependencies,
)
from tests.filters.page import Origin, page
from tests.filters.plan import Commit, Plan, read_tuned, seconds
from tests.filters.run_films import accepted_codes, run_films
from tests.filters.tables import table_of
from tests.filters.trackers import FILTERS, MENDS
from tests.measured_page import write_page

PAGE: Final = ROOT / "results" / "papers" / "filters.md"
WORK: Final = ROOT / "results" / "runs" / "filters"
NOTES: Final = Path(__file__).with_name("notes.md")
SCENARIOS: Final = (
    "free-flow,poles,bridge,cut-in,convoy,night,trees-dusk,"
    "car-rear-moving@all,car-front-moving@all"
)
_FRAME_BYTES: Final = 6e5
_HINT: Final = "the same command resumes it"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the page."""
    given = _arguments(arguments)
    commit = full_commit(given.base)

    def make() -> str:
        plan = _plan(given)
        with checked_out(commit) as folder:
            require_dependencies(folder)
            return make_page(given, plan, commit, folder)

    write_page(given.page, make)


def make_page(given: argparse.Namespace, plan: Plan, commit: str, base: Path) -> str:
    """Return the page; ``base`` is the checkout of the earlier commit."""
    sources: dict[Commit, Path] = {"before": base, "now": ROOT}
    codes = accepted_codes(plan.specs(), sources)
    clips = find_clips([given.clips], ReadOptions()) if given.clips else ()
    plan.require_clips(clips)
    _say_how_long(given, plan, clips)
    films = _films(given) if given.scenarios else ()
    runs = plan.runs(films, clips)
    with progress_bar(Console(stderr=True), _HINT, "filters") as progress:
        rows = run_films(
            runs, codes, sources, given.work / "rows", given.jobs, progress
        )
    of_film = [run.clip in films for run in runs]
    command = f"make filters BASE={given.base}"
    if given.options:
        command += f' FILTERS_OPTIONS="{given.options}"'
    now = full_commit("HEAD") + (" with changes" if is_changed() else "")
    made = Origin(
        command, commit, now, _versions(), str(host()["processor"]), given.jobs
    )
    notes = given.notes.read_text(encoding="utf-8") if given.notes.exists() else ""
    return page(
        plan,
        table_of(row for row, is_film in zip(rows, of_film, strict=True) if is_film),
        table_of(
            row for row, is_film in zip(rows, of_film, strict=True) if not is_film
        ),
        made,
        notes,
    )


def _films(given: argparse.Namespace) -> tuple[Clip, ...]:
    """Return the films, generated where they are missing or of other code."""
    folder = given.work / "films"
    names = given.scenarios.split(",")
    longest = max(one.frames for name in names for one in load_variants(name))
    shorter = ["--frames", str(given.frames)] if given.frames < longest else []
    found = subprocess.run(
        [sys.executable, "-m", "simbench", "generate", *names, "--seeds", given.seeds]
        + [*shorter, "--jobs", str(given.jobs), "--replace", "--out", str(folder)],
        cwd=ROOT,
    )
    if found.returncode:
        raise SystemExit(found.returncode)
    wanted = {one.full_name for name in names for one in load_variants(name)}
    seeds = set(parse_seeds(given.seeds))
    every = find_clips([folder], ReadOptions())
    return tuple(one for one in every if one.full_name in wanted and one.seed in seeds)


def _say_how_long(given: argparse.Namespace, plan: Plan, clips: Sequence[Clip]) -> None:
    """Print about how long all of it takes, if nothing is there."""
    names = given.scenarios.split(",") if given.scenarios else []
    scenarios = [one for name in names for one in load_variants(name)]
    films = [
        Clip(Place("native", given.work, "", one.name), ReadOptions(), one.name)
        for one in scenarios
    ]
    films = [
        replace(
            film, variant=one.variant, seed=seed, frames=min(one.frames, given.frames)
        )
        for film, one in zip(films, scenarios, strict=True)
        for seed in parse_seeds(given.seeds)
    ]
    frames = sum(film.frames for film in films)
    whole = seconds(plan.runs(films, clips), frames) / given.jobs
    print(
        f"{len(films)} films, {len(clips)} clips: about {duration(whole)} and "
        f"{frames * _FRAME_BYTES / 1e9:.1f} GB in {given.work}, less what is there",
        file=sys.stderr,
    )


def _plan(given: argparse.Namespace) -> Plan:
    tuned = {}
    if given.tuned is not None:
        tuned = read_tuned(given.tuned)
    every = parse_seeds(given.seeds)
    return Plan(
        filters=tuple(one for one in FILTERS if one.name in given.filters),
        mends=tuple(one for one in MENDS if one.filter in given.filters),
        repetitions=given.repetitions,
        mended_seeds=frozenset(every[: given.mended_seeds]),
        tuned=tuned,
    )


def _versions() -> dict[str, str]:
    shown = "python", "simbench", "numpy", "numba", "opencv"
    return {name: of for name, of in versions().items() if name in shown}


def _arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser("tests.filters", description=__doc__)
    add = parser.add_argument
    names = [one.name for one in FILTERS]
    add("base", help="commit whose trackers are 'before'")
    add("--scenarios", default=SCENARIOS, help="of the library; empty for none")
    add("--seeds", default="0:8", help="of the films; default %(default)s")
    add("--frames", type=int, default=170, help="of a film, at most; %(default)s")
    add("--clips", type=Path, help="folder of real clips, in any layout")
    add("--repetitions", type=int, default=3, help="tracker seeds on a clip")
    add("--mended-seeds", type=int, default=4, help="of the seeds, for each mend")
    add("--filters", type=lambda text: text.split(","), default=names, help="of them")
    add("--tuned", type=Path, help="YAML: {clip: {filter: {parameter: value}}}")
    add("--notes", type=Path, default=NOTES, help="Markdown for the end of the page")
    add("--work", type=Path, default=WORK, help="folder for films and rows")
    add("--page", type=Path, default=PAGE, help="file to write")
    add("--jobs", type=int, default=core_count(), help="films at a time")
    given = parser.parse_args(arguments)
    if unknown := sorted(set(given.filters) - set(names)):
        parser.error(
            f"--filters: expected some of {', '.join(names)}, got {unknown[0]}"
        )
    listed = sys.argv[1:] if arguments is None else list(arguments)
    given.options = shlex.join(one for one in listed if one != given.base)
    given.work = given.work.absolute()
    return given


if __name__ == "__main__":
    main()
