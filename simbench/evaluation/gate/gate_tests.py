"""Tests of the regression gate: whether scores of a tracker fell, anywhere or at all.

The runs of unchanged code are exchangeable: on one film, a run of the baseline and one
of now could as well be the other way round. So the sign of each paired difference is
flipped at random, jointly for all measures of a pair, and each sum over a scenario, and
over all scenarios, is compared with the largest of them in each flip. That holds the
level for all of them together, for any distribution and any dependence between them.

References
----------
Westfall and Young (1993), "Resampling-based multiple testing", section 2.3.2: the
single-step maxT method.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from simbench.evaluation.gate.baseline_rows import MEASURES, USAGE, BaselineRow
from simbench.evaluation.statistics.paired import holm, random_signs

__all__ = ["LEAST_TESTED", "PairTest", "RowPair", "paired_tests"]

Floats = NDArray[np.float64]
RowPair = tuple[BaselineRow, BaselineRow]  # of the baseline, and now

LEAST_TESTED: Final = 30
"""Pairs of runs of a tracker from which its falls are tested by sign flips."""
_FLIPS_PER_TRACKER: Final = 5_000
_LEAST_FLIPS: Final = 20_000
_ROUND_OFF: Final = 1e-9
_IS_USAGE: Final = np.array([name == USAGE for name in MEASURES])


@dataclass(frozen=True, slots=True)
class PairTest:
    """Test of one measure of one tracker, on one scenario or over all.

    Attributes
    ----------
    place : str
        Scenario and variant; empty for all scenarios together.
    measure : str
    before, now : float
        Means over the pairs; NaN where a run has no value.
    pairs : int
    fall, rise : float
        Corrected p values of a fall and of a rise; for usage both are that of a change.
    """

    place: str
    measure: str
    before: float
    now: float
    pairs: int
    fall: float
    rise: float


def paired_tests(
    rows: Mapping[str, Sequence[RowPair]], *, flips: int | None = None
) -> dict[str, list[PairTest]]:
    """Test the runs of each tracker against those of the baseline.

    Parameters
    ----------
    rows : mapping from tracker to sequence of (BaselineRow, BaselineRow)
        Rows of the baseline, and of now with at least as many repetitions.
    flips : int, optional
        Sign flips of each tracker; by default enough for p values far below the level
        of the gate.

    Returns
    -------
    dict from tracker to list of PairTest
        For each of `MEASURES` one over all scenarios, then one for each of several.
        The p values are corrected for measures and scenarios within the tracker, and
        for the trackers by Holm's method. Trackers with fewer than `LEAST_TESTED` pairs
        have tests over all scenarios only, by Student's t.
    """
    flips = flips or max(_LEAST_FLIPS, _FLIPS_PER_TRACKER * len(rows))
    found = {tracker: _tests(pairs, flips) for tracker, pairs in rows.items()}
    factors = {
        part: _holm_factors([[getattr(t, part) for t in of] for of in found.values()])
        for part in ("fall", "rise")
    }
    return {
        tracker: [
            PairTest(
                one.place,
                one.measure,
                one.before,
                one.now,
                one.pairs,
                min(1.0, one.fall * factors["fall"][index]),
                min(1.0, one.rise * factors["rise"][index]),
            )
            for one in tests
        ]
        for index, (tracker, tests) in enumerate(found.items())
    }


def _holm_factors(p_values: Sequence[Sequence[float]]) -> list[float]:
    """Return by what Holm's method multiplies the p values of each tracker."""
    least = [max(min(each), 1e-300) for each in p_values]
    return [
        float(corrected / raw) if corrected < 1.0 else float(len(least))
        for corrected, raw in zip(holm(least), least, strict=True)
    ]


def _tests(rows: Sequence[RowPair], flips: int) -> list[PairTest]:
    """Return the tests of one tracker, corrected within it."""
    old = [_table(row, row.repetitions) for row, _ in rows]
    new = [_table(now, row.repetitions) for row, now in rows]
    scaled = [_scaled(b - a) for a, b in zip(old, new, strict=True)]
    names = ["/".join(filter(None, row.name[:2])) for row, _ in rows]
    pairs = sum(map(len, old))
    if pairs < LEAST_TESTED:
        places = [("", range(len(rows)))]
        falls, rises = _t_tests(np.concatenate(scaled))
    else:
        places = [("", range(len(rows)))]
        if len(rows) > 1:
            places += [(name, range(i, i + 1)) for i, name in enumerate(names)]
        falls, rises = _max_tests(scaled, flips)
    tests = []
    for index, (place, parts) in enumerate(places):
        before = np.concatenate([old[i] for i in parts])
        after = np.concatenate([new[i] for i in parts])
        for column, measure in enumerate(MEASURES):
            tests.append(
                PairTest(
                    place,
                    measure,
                    float(before[:, column].mean()),
                    float(after[:, column].mean()),
                    len(before),
                    float(falls[index, column]),
                    float(rises[index, column]),
                )
            )
    return tests


def _table(row: BaselineRow, repetitions: int) -> Floats:
    """Return the scores, (seeds times repetitions, measures)."""
    columns = [
        np.array([runs[:repetitions] for runs in row.values[name]]).ravel()
        for name in MEASURES
    ]
    return np.stack(columns, axis=1)


def _scaled(differences: Floats) -> Floats:
    """Return differences in units of their root mean square by measure.

    Each scenario counts in units of its own noise, so that one on which a tracker is
    always right is not drowned by one on which half of its runs are lost. The unit is
    the same for any signs, so flips stay exact.
    """
    noise = np.sqrt((differences**2).mean(axis=0))
    return differences / np.where(noise > 0.0, noise, 1.0)


def _t_tests(scaled: Floats) -> tuple[Floats, Floats]:
    """Return p values of falls and rises of few pairs, (1, measures)."""
    count = len(scaled)
    mean = scaled.mean(axis=0)
    error = scaled.std(axis=0, ddof=1) / math.sqrt(count) if count > 1 else 0.0 * mean
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.nan_to_num(mean / error, nan=0.0, posinf=np.inf, neginf=-np.inf)
    p = stdtr(max(count - 1, 1), t) if count > 1 else np.full(len(t), 0.5)
    fall, rise = p, 1.0 - p
    fall = rise = np.where(_IS_USAGE, 2.0 * np.minimum(fall, rise), [fall, rise])
    fall, rise = np.minimum(len(MEASURES) * fall, 1.0)
    unknown = ~np.isfinite(mean)
    return np.where(unknown, 0.0, fall)[None], np.where(unknown, 1.0, rise)[None]


def _max_tests(scaled: Sequence[Floats], flips: int) -> tuple[Floats, Floats]:
    """Return p values of falls and rises, (1 + scenarios, measures), by maxT."""
    table = np.concatenate(scaled)
    unknown = ~np.isfinite(table).all(axis=0)
    table = np.where(unknown, 0.0, table)
    edges = np.cumsum([0, *map(len, scaled)]).tolist()
    found = _standardised(np.ones((1, len(table))), table, edges)[0]
    extreme = np.zeros((2, *found.shape))
    total = 0
    for signs in random_signs(len(table), flips):
        sums = _standardised(signs, table, edges)
        for index, direction in enumerate((-1.0, 1.0)):
            most = _directed(sums, direction).reshape(len(sums), -1).max(axis=1)
            bar = _directed(found[None], direction)[0] - _ROUND_OFF
            extreme[index] += (most[:, None, None] >= bar).sum(axis=0)
        total += len(sums)
    falls, rises = extreme / total
    return np.where(unknown, 0.0, falls), np.where(unknown, 1.0, rises)


def _standardised(signs: Floats, table: Floats, edges: Sequence[int]) -> Floats:
    """Return signed sums of unit variance, (flips, 1 + scenarios, measures).

    The first is over all scenarios; it is the only one where there is one scenario.
    """
    parts = [signs[:, a:b] @ table[a:b] for a, b in pairwise(edges)]
    sums = np.stack([sum(parts[1:], parts[0]), *parts], axis=1)
    sums /= np.sqrt([edges[-1], *np.diff(edges)])[:, None]
    return sums if len(parts) > 1 else sums[:, :1]


def _directed(sums: Floats, direction: float) -> Floats:
    """Return how far sums are in a direction; in either, for usage."""
    return np.where(_IS_USAGE, np.abs(sums), direction * sums)
