"""The tasks of a request: sequences to generate, tracker runs, and their folders."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from simbench.core.errors import DatasetError
from simbench.datasets.native import read_sequence
from simbench.evaluation.scores import Scores, score_failure, score_missing
from simbench.experiments.request import Request, path_safe, spec_text
from simbench.experiments.run_folder import RunFolder
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.scenarios.schema import Scenario
from simbench.trackers.find_tracker import TrackerSpec

__all__ = ["SequenceTask", "TrackTask", "plan", "sequence_stem"]

_GENERATION = "simbench.generation.generate"
_TRACKING = ("simbench.evaluation.run_tracker", "simbench.evaluation.scores")


@dataclass(frozen=True, slots=True, eq=False)
class TrackTask:
    """One run of one tracker over one sequence.

    Attributes
    ----------
    scenario : Scenario
    seed : int
        Of the sequence.
    sequence : Path
        Folder of the sequence.
    tracker : TrackerSpec
    repetition : int
    part : Path
        Folder for its scores.
    """

    scenario: Scenario
    seed: int
    sequence: Path
    tracker: TrackerSpec
    repetition: int
    part: Path

    def scores(self) -> Scores | None:
        """Return the stored scores, None where they are missing or unreadable."""
        try:
            return Scores.read(self.part)
        except (DatasetError, TypeError, ValueError):
            return None

    @property
    def title(self) -> str:
        """One line for the progress display."""
        return f"{self.tracker.label}: {self.scenario.full_name}, seed {self.seed}"

    def failure(self, reason: str) -> Scores:
        """Return the row of a run in which the tracker failed before any track."""
        try:  # dials may give a sequence another length than its scenario says
            frame_count = len(read_sequence(self.sequence))
        except DatasetError:
            frame_count = self.scenario.frames
        return score_failure(
            scenario=self.scenario.name,
            seed=self.seed,
            tracker=self.tracker.label,
            reason=reason,
            frame_count=frame_count,
            repetition=self.repetition,
            variant=self.scenario.variant,
        )

    def missing(self, status: Literal["failed", "unreachable"], reason: str) -> Scores:
        """Return the row of a run without measurement that is no tracker's fault."""
        return score_missing(
            scenario=self.scenario.name,
            seed=self.seed,
            tracker=self.tracker.label,
            reason=reason,
            status=status,
            repetition=self.repetition,
            variant=self.scenario.variant,
        )


@dataclass(frozen=True, slots=True, eq=False)
class SequenceTask:
    """One sequence to generate, and the tracker runs that need it.

    Attributes
    ----------
    scenario : Scenario
    seed : int
    sequence : Path
        Folder for it.
    is_first : bool
        Whether it has the first seed, which the report shows.
    track_tasks : tuple of TrackTask
    """

    scenario: Scenario
    seed: int
    sequence: Path
    is_first: bool
    track_tasks: tuple[TrackTask, ...]

    @property
    def title(self) -> str:
        """One line for the progress display."""
        return f"generating: {self.scenario.full_name}, seed {self.seed}"


def plan(request: Request, folder: RunFolder) -> list[SequenceTask]:
    """Return the sequences of a request in order, each with its tracker runs.

    Folder names contain a digest of everything that decides the result, code included:
    a result that exists under its name is valid.
    """
    codes = [
        code_digest(*_TRACKING, t.module, type(t.make()).__module__)
        for t in request.trackers
    ]
    tasks = []
    for scenario in request.scenarios:
        for seed in request.seeds:
            key = digest_of(code_digest(_GENERATION), scenario.digest, seed)[:8]
            sequence = folder.sequences / f"{sequence_stem(scenario, seed)}-{key}"
            tracks = tuple(_tracks(request, codes, folder, scenario, seed, sequence))
            is_first = seed == request.seeds[0]
            tasks.append(SequenceTask(scenario, seed, sequence, is_first, tracks))
    return tasks


def sequence_stem(scenario: Scenario, seed: int) -> str:
    """Return the first part of the folder names of a scenario and seed."""
    return f"{path_safe(scenario.full_name)}-{seed:04d}"


def _tracks(
    request: Request,
    codes: list[str],
    folder: RunFolder,
    scenario: Scenario,
    seed: int,
    sequence: Path,
) -> Iterator[TrackTask]:
    for tracker, code in zip(request.trackers, codes, strict=True):
        for repetition in range(request.repetitions):
            key = digest_of(
                code, sequence.name, spec_text(tracker), repetition, request.timeout_s
            )
            part = folder.parts / key[:16]
            yield TrackTask(scenario, seed, sequence, tracker, repetition, part)
