"""Comparisons of trackers and versions: verdicts, and which trackers are the best."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest

from simbench.evaluation.statistics.comparison import (
    compare_runs,
    compare_trackers,
    contest,
    contest_in,
    instance_table,
)


def runs(
    scores: Mapping[str, list[float]], scenario: str = "poles", seeds: int = 10
) -> pd.DataFrame:
    """Return runs whose success is given by tracker, the same on each seed and more."""
    return pd.DataFrame(
        {
            "scenario": scenario,
            "variant": "",
            "seed": pd.array([seed], dtype="Int64")[0],
            "tracker": tracker,
            "repetition": repetition,
            "success_50": score + 0.001 * seed * (len(tracker) - 3),
        }
        for tracker, values in scores.items()
        for seed in range(seeds)
        for repetition, score in enumerate(values)
    )


def test_instances_are_scenario_variant_and_seed_with_repetitions_averaged() -> None:
    table = instance_table(runs({"abc": [0.2, 0.4]}, seeds=2), "success_50")
    assert table["abc"].tolist() == pytest.approx([0.3, 0.3])
    assert list(table.index) == [("poles", "", 0), ("poles", "", 1)]


def test_recorded_data_are_one_instance_a_scenario() -> None:
    both = [
        runs({"abc": [0.2]}, scenario=name, seeds=1).assign(
            seed=pd.array([None], dtype="Int64")
        )
        for name in ("one", "two")
    ]
    table = instance_table(pd.concat(both), "success_50")
    assert len(table) == 2


def test_better_tracker_is_shown_to_be_better_pooled_and_by_scenario() -> None:
    both = [
        runs({"good": [0.9], "bad": [0.5]}, scenario=name) for name in ("one", "two")
    ]
    pooled, one, two = compare_trackers(pd.concat(both), "success_50")
    assert (pooled.scenario, one.scenario, two.scenario) == ("", "one", "two")
    assert pooled.difference.count == 20
    assert {c.verdict for c in (pooled, one, two)} == {"better"}
    assert pooled.needed is not None


def test_difference_that_is_shown_but_does_not_matter_is_not_better() -> None:
    (found,) = compare_trackers(runs({"good": [0.51], "bad": [0.5]}), "success_50")
    assert found.p == pytest.approx(2 / 2**10)
    assert found.verdict == "equal"
    (small,) = compare_trackers(
        runs({"good": [0.51], "bad": [0.5]}), "success_50", practical=0.005
    )
    assert small.verdict == "better"


def test_five_instances_are_too_few() -> None:
    (found,) = compare_trackers(
        runs({"good": [0.9], "bad": [0.5]}, seeds=5), "success_50"
    )
    assert found.verdict == "n too small"


def test_more_comparisons_need_more_instances_before_anything_is_said() -> None:
    three = {"good": [0.9], "bad": [0.5], "still": [0.1]}
    six = runs(three, seeds=6)  # 3 x 2 / 2^6 is above 0.05
    assert {c.verdict for c in compare_trackers(six, "success_50")} == {"n too small"}
    found = contest(instance_table(six, "success_50"), 1)
    assert (found.best, found.is_small, found.is_flat) == (frozenset(), True, False)
    seven = runs(three, seeds=7)
    assert {c.verdict for c in compare_trackers(seven, "success_50")} == {"better"}
    assert contest(instance_table(seven, "success_50"), 1).best == {"good"}


def test_versions_are_paired_by_instance_and_label() -> None:
    before = runs({"one": [0.9], "two": [0.5], "old": [0.1]}, seeds=8)
    after = runs({"one": [0.5], "two": [0.5], "new": [0.1]}, seeds=9)
    one, two = compare_runs(before, after, "success_50")
    assert (one.first, one.verdict) == ("one", "worse")
    assert (two.first, two.verdict, two.difference.count) == ("two", "equal", 8)


def table_of(**values: list[float]) -> pd.DataFrame:
    return pd.DataFrame(values)


UP = [0.01 * n for n in range(8)]


def test_those_that_no_other_is_shown_to_be_better_than_are_the_best() -> None:
    noisy = [0.9, 0.95, 0.9, 0.97, 0.93, 0.94, 0.9, 0.96]
    near = [0.95, 0.9, 0.93, 0.94, 0.97, 0.9, 0.96, 0.9]
    table = table_of(a=noisy, b=near, c=UP)
    assert contest(table, 1).best == {"a", "b"}
    assert contest(table, -1).best == {"c"}
    assert contest(table, 0).best == frozenset()


def test_column_of_one_tracker_has_no_best() -> None:
    assert contest(table_of(a=UP), 1).best == frozenset()


@pytest.mark.parametrize(
    ("seeds", "other", "flat"),
    [(8, 0.9, False), (8, 0.0, True), (3, 0.9, False), (3, 0.0, True)],
)
def test_column_in_which_still_ties_the_best_is_flat(
    seeds: int, other: float, flat: bool
) -> None:
    still = UP[:seeds]
    found = contest(table_of(still=still, a=[other + one for one in still]), 1)
    assert (found.is_flat, found.is_small) == (flat, seeds < 6)


def test_tracker_without_scores_is_no_part_of_the_contest() -> None:
    table = table_of(a=[0.9] * 8, b=UP, c=[np.nan] * 8)
    assert contest(table, 1).best == {"a"}


@pytest.mark.parametrize("better", [1, 0, -1])
@pytest.mark.parametrize("trackers", [("still",), ("still", "a")])
def test_contest_in_runs_is_that_of_their_table(
    trackers: tuple[str, ...], better: int
) -> None:
    shown = runs({name: [0.9 - 0.3 * n] for n, name in enumerate(trackers)})
    found = contest_in(shown, "success_50", better)
    assert found == contest(instance_table(shown, "success_50"), better)
    assert bool(found.best) == (better != 0 and len(trackers) > 1)


def test_no_table_is_made_where_there_is_no_contest() -> None:
    alone, both = runs({"a": [0.9]}), runs({"a": [0.9], "b": [0.1]})
    for shown, better in ((alone, 1), (both, 0)):
        without = shown.drop(columns="success_50")  # a table of it cannot be made
        assert contest_in(without, "success_50", better).best == frozenset()
