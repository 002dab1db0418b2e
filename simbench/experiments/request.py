"""The request of a run: scenarios, seeds or clips, trackers, repetitions, limits."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from simbench.core.errors import SimbenchError
from simbench.evaluation.protocols.starts import find_protocol
from simbench.evaluation.statistics.sweep_axes import Sweep, parse_axis
from simbench.experiments.clips import Clip
from simbench.runtime.code_digest import digest_of
from simbench.scenarios.schema import Scenario
from simbench.trackers.find_tracker import TrackerSpec

__all__ = [
    "Request",
    "parse_seeds",
    "path_safe",
    "spec_text",
    "sweep_request",
]

MAX_SEEDS = 100_000
_LEAST_MEMORY_MB, _MOST_MEMORY_MB = 16, 2**22


@dataclass(frozen=True, slots=True)
class Request:
    """The grid of a run: every tracker on every scenario and seed, and every clip.

    Attributes
    ----------
    scenarios : tuple of Scenario
        Names with variants differ.
    trackers : tuple of TrackerSpec
        Labels differ.
    seeds : tuple of int
        Non-negative and distinct; one sequence a scenario and seed. Empty where there
        are only clips.
    repetitions : int
        Runs of each tracker on the same sequence, each with a seed of its own.
    timeout_s : float, s
        Wall time one tracker may take over one sequence.
    memory_mb : int, MiB
        Memory that a process of a tracker may allocate.
    sweep : Sweep or None
        The swept dials, where the variants are those of a sweep.
    protocol : str
        One of `simbench.evaluation.protocols.starts.PROTOCOLS`.
    clips : tuple of Clip
        Sequences on disk; their labels differ.

    Raises
    ------
    SimbenchError
        If anything is empty, repeated or out of range.
    """

    scenarios: tuple[Scenario, ...]
    trackers: tuple[TrackerSpec, ...]
    seeds: tuple[int, ...]
    repetitions: int = 1
    timeout_s: float = 300.0
    memory_mb: int = 4096
    sweep: Sweep | None = None
    protocol: str = "ope"
    clips: tuple[Clip, ...] = ()

    def __post_init__(self) -> None:
        """Check values that come from the user."""
        find_protocol(self.protocol)
        if self.scenarios or not self.clips:
            _check_distinct("scenario names", (s.full_name for s in self.scenarios))
            _check_distinct("seeds", self.seeds)
        if self.clips:
            _check_distinct("clip names", (c.label for c in self.clips))
        _check_distinct("tracker labels", (t.label for t in self.trackers))
        if self.repetitions < 1:
            raise SimbenchError(
                f"repetitions must be at least 1, got {self.repetitions}"
            )
        if not 0.0 < self.timeout_s < math.inf:
            raise SimbenchError(f"timeout must be above 0 s, got {self.timeout_s:g}")
        if not _LEAST_MEMORY_MB <= self.memory_mb <= _MOST_MEMORY_MB:
            raise SimbenchError(
                f"memory must be {_LEAST_MEMORY_MB} to {_MOST_MEMORY_MB} MiB, "
                f"got {self.memory_mb}"
            )

    @property
    def digest(self) -> str:
        """SHA-256 over the whole request, as hex."""
        return digest_of(
            [scenario.digest for scenario in self.scenarios],
            [spec_text(tracker) for tracker in self.trackers],
            self.seeds,
            self.repetitions,
            self.timeout_s,
            self.memory_mb,
            self.sweep and self.sweep.facts(),
            *([] if self.protocol == "ope" else [self.protocol]),
            *([[c.label, c.digest, c.problem] for c in self.clips]),
        )

    @property
    def folder_name(self) -> str:
        """Default name of the run folder: the same for the same request."""
        if self.sweep is not None:
            names = [self.scenarios[0].name, *self.sweep.dials]
            return f"sweep-{path_safe('-'.join(names))}-{self.digest[:8]}"
        every: list[Scenario | Clip] = [*self.scenarios, *self.clips]
        names = [path_safe(one.full_name) for one in every]
        shown = "-".join(names[:2]) + ("-and-more" if len(names) > 2 else "")
        return f"{shown}-{self.digest[:8]}"


def sweep_request(
    scenarios: Sequence[Scenario],
    vary: Iterable[str],
    trackers: tuple[TrackerSpec, ...],
    seeds: tuple[int, ...],
    repetitions: int = 1,
    timeout_s: float = 300.0,
    memory_mb: int = 4096,
) -> Request:
    """Return the request of a sweep over dials of one scenario.

    Parameters
    ----------
    scenarios : sequence of Scenario
        One.
    vary : iterable of str
        Dials and values, see `simbench.evaluation.statistics.sweep_axes.parse_axis`.
    trackers, seeds, repetitions, timeout_s, memory_mb
        See `Request`.

    Raises
    ------
    SimbenchError
        If there are several scenarios, or a dial or its values are wrong.
    """
    base, *others = scenarios
    if others:
        raise SimbenchError(
            f"{base.name}: a sweep takes one variant, got {1 + len(others)}"
        )
    sweep = Sweep(base.name, base.variant, tuple(map(parse_axis, vary)))
    variants = tuple(sweep.variants(base))
    limits = timeout_s, memory_mb
    return Request(variants, trackers, seeds, repetitions, *limits, sweep)


def path_safe(name: str) -> str:
    """Return a name in a form that is safe in file names, at most 80 characters.

    Examples
    --------
    >>> path_safe("poles@occlusion.hidden=0.5,noise=0")
    'poles@occlusion.hidden=0.5,noise=0'
    >>> path_safe("../tunnel@lit from/above")
    '_tunnel@lit_from_above'
    """
    return re.sub(r"[^\w@.,=-]+", "_", name, flags=re.ASCII).lstrip(".")[:80]


def spec_text(tracker: TrackerSpec) -> str:
    """Return the command line spelling of a tracker, with its label."""
    settings = "".join(
        f"@{name}={json.dumps(value)}" for name, value in tracker.parameters.items()
    )
    plain = f"{tracker.name}{settings}"
    return plain if tracker.label == plain else f"{tracker.label}={plain}"


def parse_seeds(text: str) -> tuple[int, ...]:
    """Read seeds: numbers and half-open ranges, separated by commas.

    Raises
    ------
    SimbenchError
        If it is something else, or a range is empty.

    Examples
    --------
    >>> parse_seeds("0:3")
    (0, 1, 2)
    >>> parse_seeds("7,10:12")
    (7, 10, 11)
    """
    seeds: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"(\d{1,9})(?::(\d{1,9}))?", part.strip())
        if found is None:
            raise SimbenchError(
                f"seeds must be like 0:5 (0 to 4) or 0,3,7, got {text!r}"
            )
        first = int(found[1])
        end = first + 1 if found[2] is None else int(found[2])
        if not first < end <= first + MAX_SEEDS:
            raise SimbenchError(
                f"seeds must be a range of 1 to {MAX_SEEDS} numbers, got {part!r}"
            )
        seeds.extend(range(first, end))
    return tuple(seeds)


def _check_distinct(what: str, values: Iterable[object]) -> None:
    counts = Counter(values)
    if not counts:
        raise SimbenchError(f"{what}: expected at least one, got none")
    twice = [value for value, count in counts.items() if count > 1]
    if twice:
        raise SimbenchError(f"{what} must differ, got {twice[0]!r} more than once")
