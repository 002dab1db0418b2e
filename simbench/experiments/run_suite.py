"""Run a regression suite, and show the worst frames of what it found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import SimbenchError
from simbench.core.sequence import Sequence
from simbench.datasets.native import is_finished, read_sequence
from simbench.evaluation.gate.baseline import Baseline
from simbench.evaluation.gate.regression import Check
from simbench.evaluation.scores import Scores
from simbench.experiments.film_store import mark_used
from simbench.experiments.grid import run_grid
from simbench.experiments.plan import SequenceTask, plan
from simbench.experiments.regression_suite import Suite
from simbench.experiments.request import path_safe
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tracker_codes import tracker_codes
from simbench.generation.preview import draw_truth, save_video
from simbench.runtime.code_digest import digest_of
from simbench.runtime.opengl_renderer import opengl_renderer
from simbench.runtime.run_jobs import Progress
from simbench.runtime.scratch import scratch_folder
from simbench.runtime.versions import versions

__all__ = ["SuiteResult", "run_suite", "write_worst_frames"]

_SHOWN: Final = 60  # frames of a video
_ESTIMATE: Final = (255, 255, 0)


@dataclass(frozen=True, slots=True)
class SuiteResult:
    """Scores of a suite, and what made them.

    Attributes
    ----------
    scores : Scores
    environment : mapping from str to str
        Versions, instructions and OpenGL.
    codes : mapping from label to str
        Digests of the trackers' code and parameters.
    films : mapping from (scenario, variant, seed) to Path
        Folders of the sequences, as long as the store of films is there.
    """

    scores: Scores
    environment: Mapping[str, str]
    codes: Mapping[str, str]
    films: Mapping[tuple[str, str, int], Path]


def run_suite(
    suite: Suite, films: Path, *, jobs: int, progress: Progress | None = None
) -> SuiteResult:
    """Run all trackers of a suite; films that are there are not made again.

    Parameters
    ----------
    suite : Suite
    films : Path
        See `simbench.experiments.film_store.film_store`.
    jobs : int
        Worker processes at a time; 0 for this process.
    progress : callable, optional

    Raises
    ------
    SimbenchError
        If a scenario or tracker cannot be found, or no film could be made.
    """
    experiment = suite.experiment()
    codes = tracker_codes(
        experiment.trackers, timeout_s=suite.timeout_s, isolated=jobs > 0
    )
    renderer = opengl_renderer()
    with scratch_folder("check-") as temporary:
        folder = RunFolder(Path(temporary).absolute())
        folder.sequences = films
        tasks = plan(experiment, folder, codes, renderer)
        scores, found = run_grid(
            tasks, folder, jobs=jobs, keep_sequences=True, progress=progress
        )
    if not found:  # no tracker ran, so no tracker got worse
        raise SimbenchError(str(scores.runs["reason"].iloc[0]))
    settings = {
        spec.label: digest_of(codes[spec.label], spec.name, dict(spec.parameters))
        for spec in experiment.trackers
    }
    environment = versions() | {"opengl": renderer}
    return SuiteResult(scores, environment, settings, _films(tasks))


def write_worst_frames(
    baseline: Baseline, result: SuiteResult, checks: Iterable[Check], folder: Path
) -> dict[str, Path]:
    """Write a video of the worst frames of each tracker that failed.

    Parameters
    ----------
    baseline : Baseline
    result : SuiteResult
        Its films must still be there.
    checks : iterable of Check
    folder : Path
        Made if it is missing.

    Returns
    -------
    dict from tracker to Path
        The run whose success area fell most, around the frames with the least overlap.
        The estimate is yellow, the truth red. Trackers without a film have none.
    """
    places: dict[str, str] = {}
    for check in checks:
        if not check.passed:
            places[check.tracker] = places.get(check.tracker) or check.scenario
    written = {}
    for tracker, scenario in places.items():
        chosen = _worst_run(baseline, result, tracker, scenario)
        if chosen is None:
            continue
        name, seed, repetition = chosen
        film = result.films[(*name, seed)]
        frames = result.scores.frames
        of_run = frames[
            (frames["scenario"] == name[0])
            & (frames["variant"] == name[1])
            & (frames["seed"] == seed)
            & (frames["tracker"] == tracker)
            & (frames["repetition"] == repetition)
        ].sort_values("frame")
        stem = path_safe(f"{tracker}-{'-'.join(filter(None, name))}-{seed}")
        path = folder / f"{stem}-{repetition}.mp4"
        boxes = of_run[["left", "top", "width", "height"]].to_numpy(np.float64)
        sequence = read_sequence(film)
        images = _images(sequence, boxes, _window(of_run["overlap"].to_numpy()))
        rate_hz = 1.0 / max(float(of_run["time_s"].diff().median()), 1e-3)
        written[tracker] = save_video(path, images, min(rate_hz, 25.0))
    return written


def _films(tasks: Iterable[SequenceTask]) -> dict[tuple[str, str, int], Path]:
    films = {}
    for task in tasks:
        if is_finished(task.sequence):
            mark_used(task.sequence)
            source, seed = task.source, task.seed or 0
            films[source.name, source.variant, seed] = task.sequence
    return films


def _worst_run(
    baseline: Baseline, result: SuiteResult, tracker: str, scenario: str
) -> tuple[tuple[str, str], int, int] | None:
    """Return scenario and variant, seed and repetition whose area fell most."""
    runs = result.scores.runs
    before = {
        (row.scenario, row.variant, seed): sum(areas) / len(areas)
        for row in baseline.rows
        if row.tracker == tracker
        for seed, areas in zip(row.seeds, row.values["success_auc"], strict=True)
    }
    worst, least = None, np.inf
    run: Any
    for run in runs[runs["tracker"] == tracker].itertuples():
        key = (str(run.scenario), str(run.variant), int(run.seed))
        if key not in result.films or (scenario and run.scenario != scenario):
            continue
        fall = float(run.success_auc) - before.get(key, 0.0)
        if fall < least and run.frames:
            worst, least = (key[:2], key[2], int(run.repetition)), fall
    return worst


def _window(overlap: NDArray[np.float64]) -> range:
    """Return the frames around the stretch with the least mean overlap."""
    count = min(_SHOWN, len(overlap))
    known = np.nan_to_num(overlap, nan=0.0)
    known[:1] = 1.0  # the first box is given
    sums = np.convolve(known, np.ones(count), mode="valid")
    first = int(sums.argmin())
    return range(first, first + count)


def _images(
    sequence: Sequence, boxes: NDArray[np.float64], shown: range
) -> Iterator[NDArray[np.uint8]]:
    for index in shown:
        image = draw_truth(sequence.frames[index].image, sequence.truth, index)
        if index < len(boxes) and np.isfinite(boxes[index]).all():
            left, top, width, height = boxes[index]
            corners = np.rint([left, top, left + width, top + height]) - [0, 0, 1, 1]
            a, b, c, d = np.clip(corners, -1e4, 1e4).astype(int).tolist()
            cv2.rectangle(image, (a, b), (c, d), _ESTIMATE, 1)
        yield image
