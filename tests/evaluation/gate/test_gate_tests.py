"""Tests of the gate by simulation: false alarms, power, and a fall on one scenario."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.evaluation.gate.baseline_rows import MEASURES, BaselineRow
from simbench.evaluation.gate.gate_tests import RowPair, paired_tests
from simbench.evaluation.gate.regression import LEVEL, check_tests

Floats = NDArray[np.float64]


def row(scenario: str, table: Floats) -> BaselineRow:
    """Return a row of one seed, from (runs, measures) scores."""
    values = {name: [table[:, i].tolist()] for i, name in enumerate(MEASURES)}
    tracks = [["-"] * len(table)]
    return BaselineRow(scenario, "", "t", [0], ["-"], values, tracks, {}, {})


def scores(rng: np.random.Generator, runs: int, drop: float = 0.0) -> Floats:
    """Return skewed shares that depend on each other, and the usage of a gate."""
    success = rng.beta(4.0, 0.5, runs)
    area = 0.7 * success + rng.normal(0.1, 0.02, runs)
    usage = rng.normal(50.0, 2.0, runs)
    shares = np.stack([success, success, area], axis=1) - drop
    return np.column_stack([np.clip(shares, 0.0, 1.0), usage])


def pairs(
    rng: np.random.Generator, runs: int, drop: tuple[float, float] = (0.0, 0.0)
) -> list[RowPair]:
    """Return rows of two scenarios, with a drop on each."""
    names = ("one", "two")
    return [
        (row(name, scores(rng, runs)), row(name, scores(rng, runs, fall)))
        for name, fall in zip(names, drop, strict=True)
    ]


def test_unchanged_code_fails_about_as_often_as_the_level_allows() -> None:
    gates, failed = 300, 0
    for seed in range(gates):
        rng = np.random.default_rng(seed)
        rows = {"a": pairs(rng, 20), "b": pairs(rng, 40)}
        failed += any(not c.passed for c in check_tests(paired_tests(rows, flips=1500)))
    # the level, 2.25 of 300, and three standard errors
    assert failed <= gates * LEVEL + 3.0 * math.sqrt(gates * LEVEL)


def test_p_values_of_unchanged_code_are_below_a_level_that_often() -> None:
    gates, level = 300, 0.1
    found = [
        min(one.fall for one in paired_tests({"a": pairs(rng, 20)}, flips=1500)["a"])
        for rng in map(np.random.default_rng, range(gates))
    ]
    margin = 3.0 * math.sqrt(level * (1.0 - level) / gates)
    assert level - margin <= np.mean(np.array(found) <= level) <= level + margin


def test_drop_on_all_scenarios_is_found(rng: np.random.Generator) -> None:
    tests = paired_tests({"a": pairs(rng, 60, (0.1, 0.1))})["a"]
    assert {one.place for one in tests} == {"", "one", "two"}
    pooled = {one.measure: one for one in tests if not one.place}
    assert pooled["success_50"].fall < 0.001 < pooled["particles_mean"].fall
    assert pooled["success_50"].pairs == 120


def test_drop_on_one_scenario_is_found_there_and_nowhere_else(
    rng: np.random.Generator,
) -> None:
    tests = paired_tests({"a": pairs(rng, 60, (0.15, -0.15))})["a"]
    falls = {one.place: one.fall for one in tests if one.measure == "success_50"}
    assert falls["one"] < 0.001
    assert min(falls["two"], falls[""]) > 0.05


@pytest.mark.parametrize("count", [1, 4])
def test_more_trackers_make_each_test_stricter(count: int) -> None:
    rng = np.random.default_rng(3)
    fallen = pairs(rng, 60, (0.04, 0.04))
    rows = {"a": fallen} | {f"b{n}": pairs(rng, 60) for n in range(count - 1)}
    found = min(one.fall for one in paired_tests(rows)["a"])
    alone = min(one.fall for one in paired_tests({"a": fallen})["a"])
    assert found == pytest.approx(min(1.0, count * alone))


def test_few_runs_have_a_test_over_all_scenarios_only(
    rng: np.random.Generator,
) -> None:
    tests = paired_tests({"a": pairs(rng, 5)})["a"]
    assert [one.place for one in tests] == [""] * len(MEASURES)


def test_equal_runs_show_nothing(rng: np.random.Generator) -> None:
    same = row("one", scores(rng, 40))
    assert {one.fall for one in paired_tests({"a": [(same, same)]})["a"]} == {1.0}
    few = row("one", scores(rng, 4))
    assert min(one.fall for one in paired_tests({"a": [(few, few)]})["a"]) == 1.0
