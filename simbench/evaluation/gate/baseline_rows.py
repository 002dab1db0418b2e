"""Rows of a baseline: scores of one tracker on one scenario, by seed and repetition."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Final

import numpy as np
import pydantic
from numpy.typing import NDArray

from simbench.evaluation.gate.track_digests import track_digests
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.instance_statistics import GROUP

__all__ = [
    "MEASURES",
    "MOST_REPETITIONS",
    "MOST_SEEDS",
    "USAGE",
    "BaselineRow",
    "Name",
    "Seed",
    "baseline_rows",
    "row_fault",
]

USAGE: Final = "particles_mean"
MEASURES: Final = ("precision_20", "success_50", "success_auc", USAGE)

MOST_SEEDS: Final = 1000
"""Most seeds of a row."""
MOST_REPETITIONS: Final = 1000
"""Most runs of a row on one seed."""
_LARGEST_SEED: Final = 999_999_999  # as on the command line
_MOST_PARTICLES: Final = 1e9
_ROUND_OFF: Final = 1e-9


Name = Annotated[str, pydantic.Field(max_length=1000)]
Seed = Annotated[int, pydantic.Field(strict=True, ge=0, le=_LARGEST_SEED)]
Digest = Annotated[str, pydantic.Field(min_length=1, max_length=200)]
Value = Annotated[float, pydantic.Field(strict=True, ge=0, le=_MOST_PARTICLES)]
Runs = Annotated[list[Value], pydantic.Field(max_length=MOST_REPETITIONS)]
Tracks = Annotated[list[Digest], pydantic.Field(max_length=MOST_REPETITIONS)]


@dataclass(frozen=True, slots=True)
class BaselineRow:
    """Scores of one tracker on one scenario when the baseline was made.

    Attributes
    ----------
    scenario, variant, tracker : str
    seeds : list of int
        In ascending order.
    digests : list of str
        Digest of the film of each seed.
    values : mapping from measure to list of list of float
        By seed and repetition, for each of `MEASURES`; as many repetitions on each
        seed.
    tracks : list of list of str
        Digest of each track, see `simbench.evaluation.gate.track_digests`.
    mean, sd : mapping from measure to float
        Over all runs, for readers of the file; checked against the values. The
        deviation (n - 1) of a single run is 0.
    code : str
        Digest of the tracker's code; empty where unknown.
    """

    scenario: Name
    variant: Name
    tracker: Name
    seeds: Annotated[list[Seed], pydantic.Field(max_length=MOST_SEEDS)]
    digests: Annotated[list[Digest], pydantic.Field(max_length=MOST_SEEDS)]
    values: dict[str, Annotated[list[Runs], pydantic.Field(max_length=MOST_SEEDS)]]
    tracks: Annotated[list[Tracks], pydantic.Field(max_length=MOST_SEEDS)]
    mean: dict[str, Value]
    sd: dict[str, Value]
    code: Name = ""

    @property
    def name(self) -> tuple[str, str, str]:
        """Scenario, variant and tracker."""
        return self.scenario, self.variant, self.tracker

    @property
    def repetitions(self) -> int:
        """Runs on each seed."""
        return len(self.tracks[0])

    def table(self, measure: str) -> NDArray[np.float64]:
        """Return the scores, (seeds, repetitions) float."""
        return np.array(self.values[measure], dtype=np.float64)


def baseline_rows(
    scores: Scores, codes: Mapping[str, str] | None = None
) -> list[BaselineRow]:
    """Return runs as rows of a baseline, by scenario, variant and tracker.

    Parameters
    ----------
    scores : Scores
    codes : mapping from label to str, optional
        Digests of the trackers' code.

    Returns
    -------
    list of BaselineRow
        In order of appearance. A measure without a value is NaN, the digest of a run
        without frames is empty.
    """
    runs = scores.runs.assign(track=track_digests(scores))
    rows = []
    for name, of_row in runs.groupby(list(GROUP), sort=False):
        by_seed = of_row.sort_values("repetition").groupby("seed")
        values = {
            measure: [group[measure].tolist() for _, group in by_seed]
            for measure in MEASURES
        }
        scenario, variant, tracker = map(str, name)
        digests = by_seed["digest"].max()
        row = BaselineRow(
            scenario,
            variant,
            tracker,
            seeds=digests.index.astype(int).tolist(),
            digests=digests.tolist(),
            values=values,
            tracks=[group["track"].tolist() for _, group in by_seed],
            mean={measure: _mean_and_sd(of)[0] for measure, of in values.items()},
            sd={measure: _mean_and_sd(of)[1] for measure, of in values.items()},
            code=(codes or {}).get(tracker, ""),
        )
        rows.append(row)
    return rows


def row_fault(row: BaselineRow) -> str:
    """Return what a row lacks, empty if it is consistent."""
    count = len(row.seeds)
    if not row.seeds:
        return "at least one seed, got none"
    if any(one >= other for one, other in pairwise(row.seeds)):
        return "seeds in ascending order, each once, got others"
    if len(row.digests) != count:
        return f"a digest for each of {count} seeds, got {len(row.digests)}"
    if not all(row.digests):
        return "a digest of each film, got none"
    if len(row.tracks) != count or not row.tracks[0]:
        return f"digests of tracks for each of {count} seeds, got {len(row.tracks)}"
    for name in MEASURES:
        if name not in row.values.keys() & row.mean.keys() & row.sd.keys():
            return f"{name}, got none"
        if fault := _fault_of_values(row, name):
            return fault
    if {len(runs) for runs in row.tracks} != {row.repetitions}:
        return "as many tracks as scores on each seed, got others"
    return ""


def _fault_of_values(row: BaselineRow, name: str) -> str:
    values = row.values[name]
    if len(values) != len(row.seeds):
        return f"{name} for each of {len(row.seeds)} seeds, got {len(values)}"
    lengths = {len(runs) for runs in values}
    if lengths != {row.repetitions}:
        return f"{name} of {row.repetitions} runs on each seed, got {sorted(lengths)}"
    known = row.table(name)
    if not np.isfinite(known).all():
        return f"{name} of every run, got none"
    if name != USAGE and known.max() > 1.0:
        return f"{name} of at most 1, got {known.max():g}"
    for part, found, right in zip(
        ("mean", "sd"), (row.mean, row.sd), _mean_and_sd(values), strict=True
    ):
        if not math.isclose(found[name], right, rel_tol=1e-6, abs_tol=_ROUND_OFF):
            return f"the {part} {right:.6g} of its {name}, got {found[name]:g}"
    return ""


def _mean_and_sd(values: list[list[float]]) -> tuple[float, float]:
    known = np.array([one for runs in values for one in runs], dtype=np.float64)
    sd = known.std(ddof=1) if len(known) > 1 else 0.0
    return float(known.mean()), float(sd)
