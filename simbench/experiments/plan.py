"""The tasks of an experiment: sequences to generate or to read, and tracker runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, Literal, TypeAlias

from simbench.core.errors import DatasetError
from simbench.evaluation.isolated_track import Limits
from simbench.evaluation.protocols.starts import Protocol, find_protocol
from simbench.evaluation.score_track import score_missing
from simbench.evaluation.scores import Scores
from simbench.experiments.clips import Clip
from simbench.experiments.experiment import Experiment
from simbench.experiments.request import Request, path_safe, spec_text
from simbench.experiments.run_folder import RunFolder
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.scenarios.schema import Scenario
from simbench.trackers.find_tracker import TrackerSpec

__all__ = [
    "SequenceTask",
    "Source",
    "TrackTask",
    "generation_code",
    "plan",
    "sequence_stem",
]

_GENERATION: Final = "simbench.generation.generate"
_GENERATION_COST: Final = 10.0  # as tracking: about ten frames for one generated
_READING: Final = "simbench.experiments.clips"
RECORDED: Final = "recorded"
"""In names of folders, in place of the seed."""

Source: TypeAlias = Scenario | Clip
"""What a sequence comes from."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackTask:
    """One run of one tracker over one sequence.

    Attributes
    ----------
    source : Scenario or Clip
    seed : int or None
        Of the sequence; None for recorded data.
    sequence : Path
        Folder of the sequence in the run folder.
    tracker : TrackerSpec
    repetition : int
    limits : Limits
    part : Path
        Folder for its scores.
    output : Path
        File for what the tracker prints; of several segments, in the last.
    protocol : Protocol
    """

    source: Source
    seed: int | None
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
    def work(self) -> float:
        """Size of the work, in frames tracked."""
        return float(self.source.frames)

    @property
    def title(self) -> str:
        """One line for the progress display."""
        return f"{self.tracker.label}: {_title(self.source, self.seed)}"

    def missing(
        self, status: Literal["failed", "skipped", "unreachable"], reason: str
    ) -> Scores:
        """Return the row of a run without measurement that is no tracker's fault."""
        return score_missing(
            scenario=self.source.name,
            seed=self.seed,
            tracker=self.tracker.label,
            reason=reason,
            status=status,
            repetition=self.repetition,
            variant=self.source.variant,
        )


@dataclass(frozen=True, slots=True, eq=False)
class SequenceTask:
    """One sequence to generate, or to read, and the tracker runs that need it.

    Attributes
    ----------
    source : Scenario or Clip
    seed : int or None
        None for recorded data.
    sequence : Path
        Folder for it in the run folder; of a clip without the pictures, which stay
        where they are.
    is_first : bool
        Whether it has the first seed, which the report shows.
    track_tasks : tuple of TrackTask
    renderer : str
        The OpenGL that must render it, see `plan`.
    """

    source: Source
    seed: int | None
    sequence: Path
    is_first: bool
    track_tasks: tuple[TrackTask, ...]
    renderer: str

    @property
    def work(self) -> float:
        """Size of the work, in frames tracked."""
        is_clip = isinstance(self.source, Clip)
        return (1.0 if is_clip else _GENERATION_COST) * self.source.frames

    @property
    def title(self) -> str:
        """One line for the progress display."""
        doing = "reading" if isinstance(self.source, Clip) else "generating"
        return f"{doing}: {_title(self.source, self.seed)}"


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
    sources: list[Source] = [*experiment.scenarios, *experiment.clips]
    places = [one.full_name for one in sources]
    labels = [one.label for one in experiment.trackers]
    found: dict[tuple[str, int | None], dict[tuple[str, int], TrackTask]] = {}
    for request in experiment.requests:
        limits = Limits(request.timeout_s, request.memory_mb)
        protocol = find_protocol(request.protocol)
        for source, seed, key in _keyed_sources(request, renderer):
            sequence = folder.sequences / f"{sequence_stem(source, seed)}-{key[:8]}"
            runs = found.setdefault((source.full_name, seed), {})
            for tracker in request.trackers:
                for repetition in range(request.repetitions):
                    runs[tracker.label, repetition] = _track_task(
                        folder,
                        codes[tracker.label],
                        source,
                        seed,
                        sequence,
                        tracker,
                        repetition,
                        limits,
                        protocol,
                    )
    tasks: list[SequenceTask] = []
    shown: set[str] = set()
    for _, runs in sorted(found.items(), key=lambda item: places.index(item[0][0])):
        keys = sorted(runs, key=lambda key: (labels.index(key[0]), key[1]))
        track = runs[keys[0]]
        if isinstance(track.source, Clip):
            is_first = track.source.full_name not in shown
        else:
            is_first = track.seed == experiment.first_seed(track.source)
        shown.add(track.source.full_name)
        tasks.append(
            SequenceTask(
                track.source,
                track.seed,
                track.sequence,
                is_first,
                tuple(runs[key] for key in keys),
                renderer,
            )
        )
    return tasks


def _keyed_sources(
    request: Request, renderer: str
) -> Iterator[tuple[Source, int | None, str]]:
    """Yield each sequence of a request: its source, seed, and key of its content."""
    if request.scenarios:
        code = generation_code()
        for scenario in request.scenarios:
            for seed in request.seeds:
                yield scenario, seed, digest_of(code, renderer, scenario.digest, seed)
    if request.clips:
        code = code_digest(_READING)
        for clip in request.clips:
            yield clip, clip.seed, digest_of(code, clip.digest, clip.problem)


def generation_code() -> str:
    """Return the digest of the code that generates; takes a moment the first time."""
    return code_digest(_GENERATION)


def sequence_stem(source: Source, seed: int | None) -> str:
    """Return the first part of the folder names of a sequence."""
    number = RECORDED if seed is None else f"{seed:04d}"
    return f"{path_safe(source.full_name)}-{number}"


def _title(source: Source, seed: int | None) -> str:
    return source.full_name + ("" if seed is None else f", seed {seed}")


def _track_task(
    folder: RunFolder,
    code: str,
    source: Source,
    seed: int | None,
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
        source,
        seed,
        sequence,
        tracker,
        repetition,
        limits,
        folder.parts / key[:16],
        folder.output(source.full_name, seed, tracker.label, repetition),
        protocol,
    )
