"""The tasks of an experiment: sequences to generate and tracker runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from simbench.core.errors import DatasetError
from simbench.evaluation.isolated_track import Limits
from simbench.evaluation.protocols import Protocol, find_protocol
from simbench.evaluation.scores import Scores, score_missing
from simbench.experiments.experiment import Experiment
from simbench.experiments.request import path_safe, spec_text
from simbench.experiments.run_folder import RunFolder
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.scenarios.schema import Scenario
from simbench.trackers.find_tracker import TrackerSpec

__all__ = ["SequenceTask", "TrackTask", "plan", "sequence_stem"]

_GENERATION = "simbench.generation.generate"


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
    limits : Limits
    part : Path
        Folder for its scores.
    output : Path
        File for what the tracker prints; of several segments, in the last.
    protocol : Protocol
    """

    scenario: Scenario
    seed: int
    sequence: Path
    tracker: TrackerSpec
    repetition: int
    limits: Limits
    part: Path
    output: Path
    protocol: Protocol = "ope"

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
    renderer : str
        The OpenGL that must render it, see `plan`.
    """

    scenario: Scenario
    seed: int
    sequence: Path
    is_first: bool
    track_tasks: tuple[TrackTask, ...]
    renderer: str

    @property
    def title(self) -> str:
        """One line for the progress display."""
        return f"generating: {self.scenario.full_name}, seed {self.seed}"


def plan(
    experiment: Experiment,
    folder: RunFolder,
    codes: Mapping[str, str],
    renderer: str,
) -> list[SequenceTask]:
    """Return the sequences of an experiment in order, each with its tracker runs.

    Folder names contain a digest of everything that decides the result, code and
    library versions included: a result that exists under its name is valid.

    Parameters
    ----------
    experiment : Experiment
        Of several requests for the same run, the limits of the last one hold.
    folder : RunFolder
    codes : mapping from str to str
        See `simbench.experiments.tracker_codes.tracker_codes`.
    renderer : str
        Vendor, renderer and version of the OpenGL in use.
    """
    code = code_digest(_GENERATION)
    places = [one.full_name for one in experiment.scenarios]
    labels = [one.label for one in experiment.trackers]
    found: dict[tuple[str, int], dict[tuple[str, int], TrackTask]] = {}
    for request in experiment.requests:
        limits = Limits(request.timeout_s, request.memory_mb)
        for scenario in request.scenarios:
            for seed in request.seeds:
                key = digest_of(code, renderer, scenario.digest, seed)[:8]
                sequence = folder.sequences / f"{sequence_stem(scenario, seed)}-{key}"
                runs = found.setdefault((scenario.full_name, seed), {})
                for tracker in request.trackers:
                    for repetition in range(request.repetitions):
                        runs[tracker.label, repetition] = _track_task(
                            folder,
                            codes[tracker.label],
                            scenario,
                            seed,
                            sequence,
                            tracker,
                            repetition,
                            limits,
                            find_protocol(request.protocol),
                        )
    tasks = []
    for _, runs in sorted(found.items(), key=lambda item: places.index(item[0][0])):
        keys = sorted(runs, key=lambda key: (labels.index(key[0]), key[1]))
        track = runs[keys[0]]
        is_first = track.seed == experiment.first_seed(track.scenario)
        tasks.append(
            SequenceTask(
                track.scenario,
                track.seed,
                track.sequence,
                is_first,
                tuple(runs[key] for key in keys),
                renderer,
            )
        )
    return tasks


def sequence_stem(scenario: Scenario, seed: int) -> str:
    """Return the first part of the folder names of a scenario and seed."""
    return f"{path_safe(scenario.full_name)}-{seed:04d}"


def _track_task(
    folder: RunFolder,
    code: str,
    scenario: Scenario,
    seed: int,
    sequence: Path,
    tracker: TrackerSpec,
    repetition: int,
    limits: Limits,
    protocol: Protocol,
) -> TrackTask:
    decisive = [sequence.name, spec_text(tracker), repetition, asdict(limits)]
    decisive += [] if protocol == "ope" else [protocol]
    key = digest_of(code, *decisive)
    return TrackTask(
        scenario,
        seed,
        sequence,
        tracker,
        repetition,
        limits,
        folder.parts / key[:16],
        folder.output(scenario.full_name, seed, tracker.label, repetition),
        protocol,
    )
