"""Run the experiments of a paper and write its page."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import SimbenchError
from simbench.core.sequence import Sequence
from simbench.core.text import did_you_mean
from simbench.evaluation.scores import Scores
from simbench.experiments.papers.dpf import DPF
from simbench.experiments.papers.dsp import DSP
from simbench.experiments.papers.instances import instance_measures, place_name
from simbench.experiments.papers.judging import ClaimResult
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.nbrf import NBRF
from simbench.experiments.papers.page import page
from simbench.experiments.papers.published_figures import PublishedPaper, published
from simbench.experiments.papers.settings import found_specs
from simbench.experiments.papers.study import FilmOf, Grid, Study
from simbench.experiments.plan import sequence_stem
from simbench.experiments.request import Request
from simbench.experiments.run import RunResult, run_experiment
from simbench.generation.generate import finished_sequence, generate
from simbench.runtime.run_jobs import Progress
from simbench.runtime.scratch import scratch_folder
from simbench.runtime.versions import versions
from simbench.scenarios.files.loading import load_variants
from simbench.scenarios.schema import Scenario

__all__ = ["STUDIES", "Reproduction", "reproduce"]

STUDIES: Final = {one.key: one for one in (DPF, DSP, NBRF)}
_SHOWN: Final = ("simbench", "python", "numpy", "numba", "opencv")
_TIMEOUT_S: Final = 600.0
_MEMORY_MB: Final = 4096


@dataclass(frozen=True, slots=True)
class Reproduction:
    """What came out.

    Attributes
    ----------
    stated : PublishedPaper
    claims : list of ClaimResult
        Each claim in each setting.
    page : Path
        Markdown; figures are in the folder beside it that has the paper's key.
    result : RunResult
        Of the last grid, in the run folder.
    """

    stated: PublishedPaper
    claims: list[ClaimResult]
    page: Path
    result: RunResult


def reproduce(
    key: str,
    seeds: tuple[int, ...],
    path: Path,
    *,
    command: str = "",
    jobs: int = 1,
    quick: bool = False,
    only: Collection[str] = (),
    keep_sequences: bool = False,
    notes: str = "",
    progress: Progress | None = None,
    notice: Callable[[str], None] = lambda line: None,
) -> Reproduction:
    """Run the experiments of a paper in a run folder, and write its page there.

    Each film is rendered once for all trackers. What the folder has is not run again.

    Parameters
    ----------
    key : str
        One of `STUDIES`.
    seeds : tuple of int
    path : Path
        Run folder.
    command : str
        For the page and the run folder.
    jobs : int
        Worker processes; 0 for none.
    quick : bool
        Run the quick grid of the study, on shortened scenarios.
    only : collection of str
        Names of the grids to run; empty for all.
    keep_sequences : bool
        Keep the films in the folder.
    notes : str
        Markdown for the end of the page.
    progress, notice
        See `simbench.experiments.run.run_experiment`.

    Raises
    ------
    SimbenchError
        If there is no such paper, or the folder cannot be used.
    """
    stated = published(key)
    study = STUDIES[key]
    grids = (study.quick,) if quick else _chosen(study, only)
    frames = study.quick_frames if quick else None
    for grid in grids:
        result = run_experiment(
            _request(grid, seeds, frames),
            path,
            command=command,
            jobs=jobs,
            keep_sequences=keep_sequences,
            progress=progress,
            notice=notice,
        )
    measured = _measured(study, grids, seeds, result.scores)
    claims = study.judge(measured)
    with _films(path, frames) as film_of:
        drawings = study.draw(measured, film_of)
    shown = {name: of for name, of in versions().items() if name in _SHOWN}
    text = page(study, stated, measured, claims, drawings, command, shown, notes)
    folder = path / "paper"
    (folder / key).mkdir(parents=True, exist_ok=True)
    for old in (folder / key).glob("*.svg"):
        old.unlink()
    for one in drawings:
        one.write(folder / key)
    with atomic_write(folder / f"{key}.md") as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Reproduction(stated, claims, folder / f"{key}.md", result)


def _chosen(study: Study, only: Collection[str]) -> tuple[Grid, ...]:
    known = [one.name for one in study.grids]
    for name in only:
        if name not in known:
            raise SimbenchError(
                f"--only: expected some of {', '.join(known)}, got {name!r}"
                f"{did_you_mean(name, known)}"
            )
    return tuple(one for one in study.grids if not only or one.name in only)


def _request(grid: Grid, seeds: tuple[int, ...], frames: int | None) -> Request:
    scenarios = tuple(_scenario(place, frames) for place in grid.places)
    trackers = found_specs(grid.entries)
    return Request(scenarios, trackers, seeds, 1, _TIMEOUT_S, _MEMORY_MB)


def _scenario(place: str, frames: int | None) -> Scenario:
    (scenario,) = load_variants(place)
    return scenario if frames is None else scenario.shortened(frames)


def _measured(
    study: Study, grids: tuple[Grid, ...], seeds: tuple[int, ...], scores: Scores
) -> Measured:
    """Return the measures of the study, without others that are in the folder."""
    specs = {one.spec for grid in grids for one in grid.entries}
    places = {place for grid in grids for place in grid.places}
    tables = []
    for table in (scores.runs, scores.frames):
        is_asked = table["tracker"].isin(specs) & table["seed"].isin(seeds)
        names = map(place_name, table["scenario"], table["variant"])
        is_asked &= np.array([name in places for name in names], dtype=np.bool_)
        tables.append(table[is_asked].reset_index(drop=True))
    asked = Scores(*tables)
    return Measured(study.entries, instance_measures(asked), asked, seeds)


@contextmanager
def _films(path: Path, frames: int | None) -> Iterator[FilmOf]:
    """Yield a function that returns films; those not in the folder are generated."""
    with scratch_folder("films-") as made:

        def film_of(place: str, seed: int) -> Sequence:
            scenario = _scenario(place, frames)
            stem = sequence_stem(scenario, seed)
            for folder in sorted((path / "sequences").glob(f"{stem}-*")):
                found = finished_sequence(folder, scenario, seed)
                if found is not None:
                    return found
            folder = Path(made) / stem
            found = finished_sequence(folder, scenario, seed)
            return found or generate(scenario, seed, folder)

        yield film_of
