"""Which trackers are shown to be better than others, by paired tests over instances."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import pandas as pd

from simbench.evaluation.statistics.instance_statistics import seed_means
from simbench.evaluation.statistics.paired import (
    PairedDifference,
    count_to_detect,
    holm,
    least_pairs,
    paired_difference,
)

__all__ = [
    "LEVEL",
    "Comparison",
    "Contest",
    "compare_runs",
    "compare_trackers",
    "contest",
    "contest_in",
    "instance_table",
]

LEVEL: Final = 0.05
"""Largest corrected p value that counts as shown."""

Verdict = Literal["better", "worse", "equal", "open", "n too small"]
_INSTANCE: Final = ["scenario", "variant", "seed"]
_RECORDED: Final = -1  # stands for the seed of recorded data


@dataclass(frozen=True, slots=True)
class Comparison:
    """Paired comparison of two trackers, or of two versions of one.

    Attributes
    ----------
    scenario, variant : str
        Empty where all instances are pooled.
    first, second : str
        The difference is first minus second.
    difference : PairedDifference
    p : float, in (0, 1]
        Corrected by Holm's method for all comparisons of the same scenario.
    verdict : str
        Whether the first is shown to be ``better`` or ``worse`` by at least what
        matters in practice; ``equal`` if the interval of the difference is within what
        does not matter, ``open`` if neither is shown; ``n too small`` for fewer pairs
        than `simbench.evaluation.statistics.paired.least_pairs` of all comparisons of
        the scenario.
    needed : int or None
        Instances needed to see the least difference that matters, with a power of 0.8.
    """

    scenario: str
    variant: str
    first: str
    second: str
    difference: PairedDifference
    p: float
    verdict: Verdict
    needed: int | None


@dataclass(frozen=True, slots=True)
class Contest:
    """Which trackers of a column are the best, as far as that is shown.

    Attributes
    ----------
    best : frozenset of str
        Trackers that no other is shown to be better than; empty if there is one tracker
        only, or ``is_small``.
    is_small : bool
        Whether there are too few instances to show anything.
    is_flat : bool
        Whether the column does not discriminate: ``still``, which never moves, ties
        the best.
    """

    best: frozenset[str]
    is_small: bool
    is_flat: bool


def instance_table(runs: pd.DataFrame, measure: str) -> pd.DataFrame:
    """Return a measure by scenario instance and tracker, repetitions averaged.

    Returns
    -------
    DataFrame
        Index ``scenario, variant, seed`` in order of appearance, the seed of recorded
        data -1; a column for each tracker. NaN where a tracker did not run.
    """
    means = seed_means(runs, [measure])
    means["seed"] = means["seed"].fillna(_RECORDED).astype("int64")
    trackers = means["tracker"].drop_duplicates()
    table = means.set_index([*_INSTANCE, "tracker"])[measure].unstack(sort=False)
    return table.reindex(columns=list(trackers))


def contest(table: pd.DataFrame, better: int, decimals: int = 3) -> Contest:
    """Return which trackers are the best.

    Parameters
    ----------
    table : DataFrame
        See `instance_table`.
    better : {1, -1, 0}
        Whether higher values are better, lower ones, or neither.
    decimals : int
        Of the means as printed: those that read the same tie.
    """
    known = table.loc[:, table.notna().any()] * better
    means = known.mean()
    if better == 0 or len(means) < 2:
        return Contest(frozenset(), False, False)
    printed = means.round(decimals)
    pairs = list(itertools.combinations(means.index, 2))
    counts = known.notna().sum()
    if counts.max() < least_pairs(len(pairs), LEVEL):
        is_flat = "still" in means and bool(printed["still"] >= printed.max())
        return Contest(frozenset(), True, is_flat)
    values = {name: known[name].to_numpy(np.float64) for name in means.index}
    found = [paired_difference(values[a] - values[b]) for a, b in pairs]
    shown = holm([one.p for one in found]) <= LEVEL
    beaten = {
        pair[1] if one.mean > 0.0 else pair[0]
        for pair, one, is_shown in zip(pairs, found, shown, strict=True)
        if is_shown
    }
    best = frozenset(str(name) for name in means.index if name not in beaten)
    return Contest(best, False, "still" in best)


def contest_in(
    runs: pd.DataFrame, measure: str, better: int, decimals: int = 3
) -> Contest:
    """Return which trackers of some runs are the best in a measure, see `contest`.

    The table of instances is made only where there is a contest, with two trackers
    and a measure of which higher or lower values are better: making it takes longer
    than all else about a cell of a table of scores.
    """
    if better == 0 or runs["tracker"].nunique() < 2:
        return Contest(frozenset(), False, False)
    return contest(instance_table(runs, measure), better, decimals)


def compare_trackers(
    runs: pd.DataFrame, measure: str, *, practical: float = 0.02
) -> list[Comparison]:
    """Compare the trackers of one run with each other.

    Parameters
    ----------
    runs : DataFrame
        `simbench.evaluation.scores.Scores.runs`.
    measure : str
        Higher is better.
    practical : float
        Least difference that matters.

    Returns
    -------
    list of Comparison
        Of each pair of trackers: first over all instances, then by scenario.
    """
    table = instance_table(runs, measure)
    pairs = list(itertools.combinations(table.columns, 2))
    differences = {(a, b): table[a] - table[b] for a, b in pairs}
    return _comparisons(differences, practical)


def compare_runs(
    before: pd.DataFrame, after: pd.DataFrame, measure: str, *, practical: float = 0.02
) -> list[Comparison]:
    """Compare two versions of the same trackers, instance by instance.

    Parameters
    ----------
    before, after : DataFrame
        Runs of the same trackers on the same scenarios and seeds; what only one has
        is left out.
    measure, practical
        See `compare_trackers`.

    Returns
    -------
    list of Comparison
        Of each tracker, after minus before: first over all instances, then by scenario.
    """
    old, new = instance_table(before, measure), instance_table(after, measure)
    labels = [label for label in new.columns if label in old.columns]
    shared = new.index.intersection(old.index, sort=False)
    differences = {
        (label, label): new.loc[shared, label] - old.loc[shared, label]
        for label in labels
    }
    return _comparisons(differences, practical)


def _comparisons(
    differences: dict[tuple[str, str], pd.Series[float]], practical: float
) -> list[Comparison]:
    if not differences:
        return []
    table = pd.DataFrame(differences)
    places: list[tuple[list[str], pd.DataFrame]] = [(["", ""], table)]
    for key, part in table.groupby(level=[0, 1], sort=False):
        places.append(([*map(str, key)], part))
    if len(places) == 2:  # the pooled one is that of the only scenario
        places = places[:1]
    found = []
    for (scenario, variant), part in places:
        paired = [paired_difference(part[pair]) for pair in differences]
        least = least_pairs(len(paired), LEVEL)
        corrected = holm([one.p for one in paired])
        for (first, second), one, p in zip(differences, paired, corrected, strict=True):
            found.append(
                Comparison(
                    scenario,
                    variant,
                    first,
                    second,
                    one,
                    float(p),
                    _verdict(one, float(p), practical, least),
                    count_to_detect(practical, one.sd),
                )
            )
    return found


def _verdict(one: PairedDifference, p: float, practical: float, least: int) -> Verdict:
    if one.count < least:
        return "n too small"
    if p <= LEVEL and abs(one.mean) >= practical:
        return "better" if one.mean > 0.0 else "worse"
    is_within = bool(np.abs([one.low, one.high]).max() < practical)
    return "equal" if is_within else "open"
