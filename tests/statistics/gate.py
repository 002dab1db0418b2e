"""False alarms, power, and damaged trackers of the regression gate, by resampling."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.evaluation.gate.baseline_rows import MEASURES, BaselineRow
from simbench.evaluation.gate.gate_tests import RowPair, paired_tests
from simbench.evaluation.gate.regression import check_tests
from simbench.experiments.regression_suite import DEFAULT_SUITE
from tests.statistics.gate_draws import DAMAGED, UNCHANGED, Draws

__all__ = ["GATES", "GateResult", "simulate"]

Floats = NDArray[np.float64]

GATES: Final = 2_000
_POWER_GATES: Final = 100
_FLIPS: Final = 4_000  # enough for the level, and fast
DROPS: Final = (0.05, 0.1)


@dataclass(frozen=True, slots=True)
class GateResult:
    """Shares of simulated gates that failed.

    Attributes
    ----------
    false_alarms : float
        Of unchanged code.
    power : mapping from (tracker, measure, drop) to float
        Where one measure of one tracker fell by the drop, on average over its runs.
    damaged : mapping from label to float
        Of damaged trackers in the place of condensation.
    """

    false_alarms: float
    power: Mapping[tuple[str, str, float], float]
    damaged: Mapping[str, float]


def simulate(draws: Draws, jobs: int = 2, gates: int = GATES) -> GateResult:
    """Simulate gates in an environment where every run takes another course."""
    power_gates = max(20, gates * _POWER_GATES // GATES)
    drops = [
        (tracker, measure, drop)
        for tracker in UNCHANGED
        for measure in ("success_50", "precision_20")
        for drop in DROPS
    ]
    work: list[tuple[str, str, float, int]] = [
        ("", "", 0.0, seed) for seed in range(gates)
    ]
    work += [(*one, seed) for one in drops for seed in range(power_gates)]
    work += [(label, "", 0.0, seed) for label in DAMAGED for seed in range(power_gates)]
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        failed = list(pool.map(partial(_is_failed, draws), work, chunksize=50))
    found = np.array(failed)
    starts = gates + power_gates * np.arange(len(drops) + len(DAMAGED) + 1)
    shares = [float(found[a : a + power_gates].mean()) for a in starts[:-1]]
    return GateResult(
        float(found[:gates].mean()),
        dict(zip(drops, shares, strict=False)),
        dict(zip(DAMAGED, shares[len(drops) :], strict=True)),
    )


def _is_failed(draws: Draws, work: tuple[str, str, float, int]) -> bool:
    """Simulate one gate; return whether it fails, for the tracker that is changed."""
    label, measure, drop, seed = work
    rng = np.random.default_rng([seed, len(label), int(1000 * drop)])
    rows: dict[str, list[RowPair]] = {}
    for tracker in UNCHANGED:
        damaged = label in DAMAGED and tracker == "condensation"
        now = label if damaged else tracker
        fallen = measure if tracker == label else ""
        rows[tracker] = list(_rows(draws, tracker, now, fallen, drop, rng))
    checks = check_tests(paired_tests(rows, flips=_FLIPS))
    changed = "condensation" if label in DAMAGED else label
    return any(not c.passed and c.tracker in (changed or c.tracker) for c in checks)


def _rows(
    draws: Draws,
    tracker: str,
    now: str,
    fallen: str,
    drop: float,
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
        if fallen:
            column = MEASURES.index(fallen)
            for scores in after:
                scores[:, column] = lowered(scores[:, column], drop, rng)
        yield _row(scenario.name, tracker, before), _row(scenario.name, tracker, after)


def lowered(scores: Floats, drop: float, rng: np.random.Generator) -> Floats:
    """Return shares that are lower by ``drop`` on average, and not below 0.

    Each run loses between nothing and twice the drop, as one that loses the target for
    a part of its frames does; what a run near 0 cannot lose is lost by no other.
    """
    lost = rng.uniform(0.0, 2.0 * drop, len(scores))
    return np.maximum(scores - lost, 0.0)


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
