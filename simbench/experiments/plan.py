"""From a request to its tasks: what to film, what to follow, where results go."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from simbench.core.errors import DatasetError
from simbench.datasets.native import read_sequence
from simbench.evaluation.scores import Scores, score_failure, score_missing
from simbench.experiments.request import (
    Request,
    full_name,
    path_safe,
    spec_text,
    track_seed,
)
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
        That of the sequence.
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
        """Return what was reached, or None where that is not known yet."""
        try:
            return Scores.read(self.part)
        except (DatasetError, TypeError, ValueError):  # missing, cut off or scrambled
            return None

    @property
    def track_seed(self) -> int:
        """Seed of the track."""
        return track_seed(self.seed, self.tracker.label, self.repetition)

    @property
    def title(self) -> str:
        """What it does, for a person."""
        return f"{self.tracker.label}: {full_name(self.scenario)}, seed {self.seed}"

    def failure(self, reason: str) -> Scores:
        """Return the row of a run that left no track."""
        return score_failure(
            scenario=self.scenario.name,
            seed=self.seed,
            tracker=self.tracker.label,
            reason=reason,
            frame_count=self._frame_count,
            repetition=self.repetition,
            variant=self.scenario.variant,
        )

    @property
    def _frame_count(self) -> int:
        """Frames of the sequence; dials may have given it others than the scenario."""
        try:
            return len(read_sequence(self.sequence))
        except DatasetError:
            return self.scenario.frames

    def unmade(self, status: Literal["failed", "unreachable"], reason: str) -> Scores:
        """Return the row of a run that no tracker is to blame for: nothing measured."""
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
    """One sequence to film, and the tracker runs that need it.

    Attributes
    ----------
    scenario : Scenario
    seed : int
    sequence : Path
        Folder for it.
    is_first : bool
        Whether it is of the first seed, which the report shows.
    chases : tuple of TrackTask
    """

    scenario: Scenario
    seed: int
    sequence: Path
    is_first: bool
    chases: tuple[TrackTask, ...]

    @property
    def title(self) -> str:
        """What it does, for a person."""
        return f"filming: {full_name(self.scenario)}, seed {self.seed}"


def plan(request: Request, folder: RunFolder) -> list[SequenceTask]:
    """Return the sequences of a request in order, each with its tracker runs.

    Names on disk hold a digest of everything that makes the result, code included:
    what is there under its name need not be made again.
    """
    codes = [
        code_digest(*_TRACKING, t.module, type(t.make()).__module__)
        for t in request.trackers
    ]
    shoots = []
    for scenario in request.scenarios:
        for seed in request.seeds:
            key = digest_of(code_digest(_GENERATION), scenario.digest, seed)[:8]
            sequence = folder.sequences / f"{sequence_stem(scenario, seed)}-{key}"
            chases = tuple(_chases(request, codes, folder, scenario, seed, sequence))
            first = seed == request.seeds[0]
            shoots.append(SequenceTask(scenario, seed, sequence, first, chases))
    return shoots


def sequence_stem(scenario: Scenario, seed: int) -> str:
    """Return how the names of the folders of a scenario and seed begin."""
    return f"{path_safe(full_name(scenario))}-{seed:04d}"


def _chases(
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
