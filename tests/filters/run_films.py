"""Runs the trackers of both commits over films, in turn on the same core."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Final

from simbench.core.atomic_write import atomic_write
from simbench.experiments.clips import Clip
from simbench.runtime.code_digest import digest_of
from simbench.runtime.run_jobs import Progress
from tests.beside.side import Side
from tests.filters.plan import Commit, Run

__all__ = ["accepted_codes", "run_films"]

_ANSWERS: Final = Path(__file__).with_name("track_film.py")
Row = dict[str, Any]
Sides = dict[Commit, Side]
Kept = dict[Run, Path]


def accepted_codes(
    specs: Mapping[Commit, list[str]], sources: Mapping[Commit, Path]
) -> dict[tuple[Commit, str], str]:
    """Return a digest of the code of each specification.

    Raises
    ------
    SystemExit
        If a commit refuses some, with a line for each.
    """
    codes: dict[tuple[Commit, str], str] = {}
    problems = []
    for commit, listed in specs.items():
        side = Side(sources[commit], _ANSWERS, max(os.sched_getaffinity(0)))
        found = side.ask(specs=listed)
        side.close()
        codes |= {(commit, spec): code for spec, code in found["codes"].items()}
        problems += [
            f"{commit}: {spec}: {reason}" for spec, reason in found["refused"].items()
        ]
    if problems:
        raise SystemExit("\n".join(problems))
    return codes


def run_films(
    runs: Iterable[Run],
    codes: Mapping[tuple[Commit, str], str],
    sources: Mapping[Commit, Path],
    folder: Path,
    jobs: int,
    progress: Progress,
) -> list[Row]:
    """Return a row for each run; what the folder has is not run again.

    Parameters
    ----------
    runs : iterable of Run
        Those of one film behind each other.
    codes : mapping
        See `accepted_codes`.
    sources : mapping
        Checkouts of the two commits.
    folder : Path
        For the rows.
    jobs : int
        Films at a time, each on a core of its own.
    progress : callable
    """
    kept = {run: folder / f"{_key(run, codes)[:24]}.json" for run in runs}
    missing = [run for run in kept if not kept[run].exists()]
    films = [list(of) for _, of in itertools.groupby(missing, lambda run: run.clip)]
    if films:
        _run_missing(films, kept, sources, min(jobs, len(films)), progress)
    return [json.loads(path.read_text()) | _names(run) for run, path in kept.items()]


def _run_missing(
    films: list[list[Run]],
    kept: Kept,
    sources: Mapping[Commit, Path],
    jobs: int,
    progress: Progress,
) -> None:
    cores = sorted(os.sched_getaffinity(0))
    every: list[Sides] = [
        {
            commit: Side(of, _ANSWERS, cores[slot % len(cores)])
            for commit, of in sources.items()
        }
        for slot in range(jobs)
    ]
    free: SimpleQueue[Sides] = SimpleQueue()
    for sides in every:
        free.put(sides)
    whole = sum(map(len, films))
    done = 0
    with ThreadPoolExecutor(jobs) as threads:
        futures: dict[Future[None], list[Run]] = {
            threads.submit(_run_film, film, kept, free): film for film in films
        }
        try:
            for future in as_completed(futures):
                future.result()
                done += len(futures[future])
                progress(done, whole, futures[future][0].clip.label)
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
    for sides in every:
        for side in sides.values():
            side.close()


def _run_film(film: list[Run], kept: Kept, free: SimpleQueue[Sides]) -> None:
    sides = free.get()
    try:
        for commit, side in sides.items():
            runs = [run for run in film if run.commit == commit]
            if not runs:
                continue
            asked = [
                {"label": run.tracker, "spec": run.spec, "repetition": run.repetition}
                for run in runs
            ]
            answer = side.ask(film=_where(film[0].clip), runs=asked)
            for run, row in zip(runs, answer["rows"], strict=True):
                with atomic_write(kept[run]) as temporary:
                    temporary.write_text(json.dumps(row))
    finally:
        free.put(sides)


def _where(clip: Clip) -> dict[str, str]:
    place = clip.place
    path = (place.root / place.folder).absolute()
    return {"path": str(path), "layout": place.layout, "target": place.target}


def _names(run: Run) -> Row:
    return {"setting": run.setting, "name": run.clip.full_name}


def _key(run: Run, codes: Mapping[tuple[Commit, str], str]) -> str:
    code = codes[run.commit, run.spec], _ANSWERS.read_text()
    return digest_of(
        *code, run.clip.digest, run.commit, run.tracker, run.spec, run.repetition
    )
