"""Scores of many runs of unchanged and of damaged trackers, kept between calls."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.datasets.native import is_finished, read_sequence
from simbench.evaluation.gate.baseline_rows import MEASURES
from simbench.evaluation.measures import frame_errors, track_measures
from simbench.evaluation.run_tracker import track
from simbench.experiments.regression_suite import DEFAULT_SUITE
from simbench.generation.generate import generate
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.scenarios.schema import Scenario
from simbench.trackers.find_tracker import find_tracker

__all__ = ["DAMAGED", "UNCHANGED", "Draws", "draws"]

Floats = NDArray[np.float64]
Draws = dict[tuple[str, str, int], Floats]  # label, scenario, seed: (runs, measures)

UNCHANGED: Final = {"condensation": 120, "directional-45": 60, "dsp": 40}
"""Runs of each tracker on each film."""
DAMAGED: Final = {
    "half": "condensation@particles=50",
    "sigma": "condensation@sigma=0.12",
    "noise": "condensation@position_noise=0.18@error_noise=3.0",
}
_DAMAGED_RUNS: Final = 60


@dataclass(frozen=True, slots=True)
class _Task:
    """Runs of one tracker on one film; ``label`` names the random numbers."""

    label: str
    spec: str
    scenario: Scenario
    seed: int
    runs: int
    folder: Path

    @property
    def film(self) -> Path:
        code = code_digest("simbench.generation.generate")
        key = digest_of(self.scenario.digest, self.seed, code)[:16]
        return self.folder / f"film-{self.scenario.name}-{self.seed}-{key}"

    @property
    def path(self) -> Path:
        spec = find_tracker(self.spec)
        code = code_digest("simbench.evaluation.run_tracker", spec.module)
        key = digest_of(self.film.name, self.spec, self.label, self.runs, code)[:16]
        return self.folder / f"draws-{self.label}-{key}.npy"


def draws(folder: Path, jobs: int = 2) -> Draws:
    """Return the scores of all runs, those of earlier calls from disk.

    Parameters
    ----------
    folder : Path
        For films and scores.
    jobs : int
        Worker processes.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tasks = list(_tasks(folder))
    films = {task.film: task for task in tasks}
    open_films = [task for film, task in films.items() if not is_finished(film)]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        list(pool.map(_make_film, open_films))
        missing = [task for task in tasks if not task.path.exists()]
        for number, task in enumerate(pool.map(_run, missing), 1):
            print(f"draws: {number} of {len(missing)}: {task.path.name}", flush=True)
    return {(t.label, t.scenario.name, t.seed): np.load(t.path) for t in tasks}


def _tasks(folder: Path) -> Iterator[_Task]:
    for scenario in DEFAULT_SUITE.experiment().scenarios:
        for seed in DEFAULT_SUITE.seeds:
            for label, runs in UNCHANGED.items():
                yield _Task(label, label, scenario, seed, runs, folder)
            for label, spec in DAMAGED.items():
                yield _Task(label, spec, scenario, seed, _DAMAGED_RUNS, folder)


def _make_film(task: _Task) -> None:
    generate(task.scenario, task.seed, task.film)


@cache
def _film(folder: Path) -> Sequence:
    """Return a film with its images in memory."""
    sequence = read_sequence(folder)
    return replace(sequence, frames=list(sequence.frames))


def _run(task: _Task) -> _Task:
    film, spec = _film(task.film), find_tracker(task.spec)
    # labels decide the random numbers: others than in the gate's own runs
    first = zlib.crc32(task.label.encode()) % 10**6
    scores = [
        _scores(
            track(spec.make(), film, label=task.label, repetition=first + one), film
        )
        for one in range(task.runs)
    ]
    partial = task.path.with_suffix(".partial.npy")
    np.save(partial, np.array(scores))
    partial.rename(task.path)
    return task


def _scores(found: Track, film: Sequence) -> list[float]:
    truth = film.truth
    scored = frame_errors.scored_frames(truth.absent)
    errors = frame_errors.center_error(found.boxes, truth.boxes)[scored]
    overlaps = frame_errors.frame_overlap(found.boxes, truth.boxes)[scored]
    has_box = np.isfinite(found.boxes[:, 0])
    by_name = {
        "precision_20": track_measures.precision(errors),
        "success_50": track_measures.success(overlaps),
        "success_auc": track_measures.success_area(overlaps),
        "particles_mean": track_measures.particle_usage(found.particles, has_box)[1],
    }
    return [float(by_name[name]) for name in MEASURES]
