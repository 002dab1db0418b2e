"""False alarms, power, and damaged trackers of the regression gate, by resampling."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.evaluation.gate.baseline_rows import MEASURES, USAGE, BaselineRow
from simbench.evaluation.gate.gate_tests import RowPair, paired_tests
from simbench.evaluation.gate.regression import check_tests
from simbench.experiments.regression_suite import DEFAULT_SUITE
from tests.statistics.gate_draws import DAMAGED, UNCHANGED, Draws

__all__ = ["FALLS", "GATES", "GateResult", "simulate"]

Floats = NDArray[np.float64]

GATES: Final = 2_000
_POWER_GATES: Final = 100
_FLIPS: Final = 4_000  # enough for the level, and fast
DROPS: Final = (0.05, 0.1)
Fall = Callable[[Floats, float, np.random.Generator], Floats]


@dataclass(frozen=True, slots=True)
class GateResult:
    """Shares of simulated gates that failed.

    Attributes
    ----------
    false_alarms : float
        Of unchanged code.
    power : mapping from (tracker, measure, drop, name of `FALLS`) to float
        Where one measure of one tracker fell by the drop, on average over its runs.
    damaged : mapping from label to (float, float)
        Of damaged trackers in the place of condensation; then by the scores alone,
        without the number of particles.
    """

    false_alarms: float
    power: Mapping[tuple[str, str, float, str], float]
    damaged: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True)
class _Work:
    """One gate: of unchanged code unless ``changed`` names a tracker or a damage."""

    seed: int
    changed: str = ""
    measure: str = ""
    drop: float = 0.0
    fall: str = ""


def simulate(draws: Draws, jobs: int = 2, gates: int = GATES) -> GateResult:
    """Simulate gates in an environment where every run takes another course."""
    power_gates = max(20, gates * _POWER_GATES // GATES)
    drops = [
        (tracker, measure, drop, fall)
        for tracker in UNCHANGED
        for measure in ("success_50", "precision_20")
        for drop in DROPS
        for fall in FALLS
    ]
    changes = [*drops, *((label, "", 0.0, "") for label in DAMAGED)]
    work = [_Work(seed) for seed in range(gates)]
    work += [_Work(seed, *one) for one in changes for seed in range(power_gates)]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        failed = list(pool.map(partial(_is_failed, draws), work, chunksize=50))
    found = np.array(failed)
    shares = found[gates:].reshape(len(changes), power_gates, 2).mean(axis=1)
    power, damaged = shares[: len(drops), 0].tolist(), shares[len(drops) :].tolist()
    return GateResult(
        float(found[:gates, 0].mean()),
        dict(zip(drops, power, strict=True)),
        dict(zip(DAMAGED, map(tuple, damaged), strict=True)),
    )


def _is_failed(draws: Draws, work: _Work) -> tuple[bool, bool]:
    """Simulate one gate; return whether it fails, and whether by scores.

    Where a tracker is changed, its checks alone count.
    """
    rng = np.random.default_rng(
        [work.seed, len(work.changed), int(1000 * work.drop), len(work.fall)]
    )
    is_damaged = work.changed in DAMAGED
    changed = "condensation" if is_damaged else work.changed
    rows: dict[str, list[RowPair]] = {}
    for tracker in UNCHANGED:
        now = work.changed if is_damaged and tracker == changed else tracker
        fallen = work if tracker == work.changed else None
        rows[tracker] = list(_rows(draws, tracker, now, fallen, rng))
    checks = check_tests(paired_tests(rows, flips=_FLIPS))
    failed = [c for c in checks if not c.passed and c.tracker in (changed or c.tracker)]
    return bool(failed), any(check.measure != USAGE for check in failed)


def _rows(
    draws: Draws,
    tracker: str,
    now: str,
    fallen: _Work | None,
    rng: np.random.Generator,
) -> Iterator[RowPair]:
    count = DEFAULT_SUITE.repetitions[tracker]
    for scenario in DEFAULT_SUITE.scenarios:
        before: list[Floats] = []
        after: list[Floats] = []
        for seed in DEFAULT_SUITE.seeds:
            for label, into in ((tracker, before), (now, after)):
                pool = draws[label, scenario.name, seed]
                into.append(pool[rng.integers(0, len(pool), count)])
        if fallen is not None:
            column, fall = MEASURES.index(fallen.measure), FALLS[fallen.fall]
            for scores in after:
                scores[:, column] = fall(scores[:, column], fallen.drop, rng)
        yield _row(scenario.name, tracker, before), _row(scenario.name, tracker, after)


def lowered(scores: Floats, drop: float, rng: np.random.Generator) -> Floats:
    """Return shares that are lower by ``drop`` on average, and not below 0.

    Each run loses between nothing and twice the drop, as one that loses the target for
    a part of its frames does; what a run near 0 cannot lose is lost by no other.
    """
    lost = rng.uniform(0.0, 2.0 * drop, len(scores))
    return np.maximum(scores - lost, 0.0)


def lost_as_a_whole(scores: Floats, drop: float, rng: np.random.Generator) -> Floats:
    """Return shares of which some are 0, so that the mean is lower by ``drop``.

    Each run is lost with the same probability, and keeps its score otherwise; where the
    mean is below the drop, all are lost.
    """
    share = drop / max(float(scores.mean()), drop)
    return np.where(rng.random(len(scores)) < share, 0.0, scores)


FALLS: Final[Mapping[str, Fall]] = {
    "in every run": lowered,
    "in few runs": lost_as_a_whole,
}
"""How a drop is spread over runs."""


def _row(scenario: str, tracker: str, tables: list[Floats]) -> BaselineRow:
    values = {
        name: [table[:, column].tolist() for table in tables]
        for column, name in enumerate(MEASURES)
    }
    tracks = [["-"] * len(table) for table in tables]
    seeds = DEFAULT_SUITE.seeds
    return BaselineRow(
        scenario, "", tracker, seeds, ["-"] * len(seeds), values, tracks, {}, {}
    )
