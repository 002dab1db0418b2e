"""Probe of a scenario's instances: whether each seed is taken and has its point."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.box import overlap
from simbench.core.errors import SimbenchError
from simbench.generation.attempts import render_in_view
from simbench.generation.dials.probe import target_boxes
from simbench.generation.instances.measures import point_measures, still_overlap
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.pool import Job, ReportProgress
from simbench.runtime.run_jobs import Progress, run_all
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import build_stage

__all__ = [
    "Instance",
    "mean_still",
    "median_overlap",
    "probe_instance",
    "probe_instances",
]


@dataclass(frozen=True, slots=True)
class Instance:
    """What one seed of a scenario shows.

    Attributes
    ----------
    scenario : str
        Name with variant.
    seed : int
    first_frame : (H, W, 3) uint8, RGB
        As rendered; empty if the seed is refused.
    boxes : (T, 4) float, px
        The target's amodal boxes; NaN where it is absent.
    measures : mapping from str to float
        See `simbench.scenarios.schema.point.Point`, and ``still``: mean overlap of a
        box that does not move.
    attempts : int
        Samples of traffic and roadside until one was taken.
    refusal : str
        One line that says why the seed gives no sequence; else empty.
    misses : tuple of str
        One line for each measure that is not as the scenario's point states.
    """

    scenario: str
    seed: int
    first_frame: NDArray[np.uint8] = field(
        default_factory=lambda: np.zeros((0, 0, 3), np.uint8)
    )
    boxes: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4)))
    measures: Mapping[str, float] = field(default_factory=dict)
    attempts: int = 0
    refusal: str = ""
    misses: tuple[str, ...] = ()


def probe_instance(scenario: Scenario, seed: int) -> Instance:
    """Simulate one seed, and render its first frame and what its point needs.

    Parameters
    ----------
    scenario : Scenario
    seed : int
        At least 0.

    Returns
    -------
    Instance
        With a ``refusal`` if the seed gives no sequence.
    """
    frames: list[NDArray[np.uint8]] = []
    name = scenario.full_name
    try:
        first, _ = render_in_view(
            scenario, seed, lambda _, image: frames.append(image.copy()), frames=1
        )
        redraws = first.trajectories.traffic_redraws
        stage = build_stage(first.scenario, seed, skip=redraws)
        boxes = target_boxes(stage)
        measures = point_measures(stage, boxes) | {"still": still_overlap(boxes)}
    except SimbenchError as error:
        return Instance(name, seed, refusal=str(error))
    misses = tuple(
        f"{measure}: expected {expected}, got {measures[measure]:.3g}"
        for measure, expected in stage.scenario.point
        if expected is not None and not expected.holds(measures[measure])
    )
    absent = float(np.mean(np.isnan(boxes[:, 0])))
    if absent > 0.0:
        misses += (f"the target is out of the picture in {absent:.0%} of the frames",)
    return Instance(name, seed, frames[-1], boxes, measures, redraws + 1, misses=misses)


def probe_instances(
    scenarios: Sequence[Scenario],
    seeds: Sequence[int],
    *,
    jobs: int = 1,
    progress: Progress | None = None,
) -> list[Instance]:
    """Probe seeds of scenarios, several at a time.

    Parameters
    ----------
    scenarios : sequence of Scenario
    seeds : sequence of int
    jobs : int
        Processes at a time.
    progress : callable of (done, total, what), optional

    Returns
    -------
    list of Instance
        The seeds of the first scenario, then those of the next.
    """
    pairs = [(scenario, seed) for scenario in scenarios for seed in seeds]

    def make_jobs(_: Path) -> Iterator[Job]:
        for number, pair in enumerate(pairs):
            limit_s = generation_limit_s(pair[0].frames)
            yield Job(number, "generate", _probe_job, pair, limit_s)

    def report(ended: int, running: Mapping[int, float]) -> None:
        if progress is not None:
            title = next((pairs[number][0].full_name for number in running), "")
            progress(ended, len(pairs), f"probing {title}")

    events = run_all(make_jobs, jobs, report)
    return [
        events[number].value
        if events[number].kind == "done"
        else Instance(scenario.full_name, seed, refusal=str(events[number].value))
        for number, (scenario, seed) in enumerate(pairs)
    ]


def _probe_job(scenario: Scenario, seed: int, report: ReportProgress) -> Instance:
    cv2.setNumThreads(1)
    found = probe_instance(scenario, seed)
    report(1, 1)
    return found


def median_overlap(tracks: Sequence[NDArray[np.float64]]) -> float:
    """Return the median over pairs of tracks of their mean overlap frame by frame.

    Parameters
    ----------
    tracks : sequence of (T, 4) float, px
        Boxes; a pair is compared over the frames that both have.

    Returns
    -------
    float
        NaN for fewer than two tracks. A frame where one is absent counts as 0.

    Examples
    --------
    >>> median_overlap([np.array([[0.0, 0, 10, 10]]), np.array([[5.0, 0, 10, 10]])])
    0.3333333333333333
    """
    means = []
    for one, other in combinations(tracks, 2):
        count = min(len(one), len(other))
        means.append(np.mean(np.nan_to_num(overlap(one[:count], other[:count]))))
    return float(np.median(means)) if means else float("nan")


def mean_still(instances: Sequence[Instance]) -> float:
    """Return the mean score of a box that does not move; NaN without instances."""
    scores = [one.measures["still"] for one in instances]
    return float(np.mean(scores)) if scores else float("nan")
