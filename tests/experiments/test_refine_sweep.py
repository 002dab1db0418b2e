"""Refined sweeps: where new values go, and folders that grow by them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simbench.core.errors import SimbenchError
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.sweep_axes import Axis, Sweep
from simbench.evaluation.statistics.sweep_scores import SweepScores
from simbench.experiments.experiment import Experiment
from simbench.experiments.refine_sweep import new_values, refined_run
from simbench.experiments.request import Request, sweep_request
from simbench.experiments.run import RunResult
from simbench.experiments.run_folder import RunFolder
from simbench.scenarios.files.loading import load_scenario
from simbench.trackers.find_tracker import find_tracker

COARSE = Axis("noise", (0.0, 0.1, 0.2, 0.4))


def swept(values: tuple[float, ...], crossings: dict[str, float]) -> SweepScores:
    """Return a sweep in which each tracker breaks at a value; NaN for nowhere."""
    points = pd.DataFrame(
        {
            "tracker": tracker,
            "variant": f"noise={value}",
            "requested.noise": value,
            "achieved.noise": value,
        }
        for tracker in crossings
        for value in values
    )
    breaking = pd.DataFrame(
        {
            "tracker": tracker,
            "state": "beyond" if np.isnan(at) else "within",
            "value": at,
        }
        for tracker, at in crossings.items()
    )
    return SweepScores(Sweep("poles", "", (Axis("noise", values),)), points, breaking)


def test_new_values_are_in_the_middle_of_the_steps_in_which_trackers_fall() -> None:
    found = swept(COARSE.values, {"a": 0.13, "b": 0.3, "c": np.nan, "d": 0.12})
    assert new_values(found, COARSE, rounds=2) == (0.15, 0.3)


def test_steps_are_halved_so_often_and_no_more() -> None:
    once = swept((0.0, 0.1, 0.15, 0.2, 0.4), {"a": 0.13})
    assert new_values(once, COARSE, rounds=1) == ()
    assert new_values(once, COARSE, rounds=2) == (0.125,)
    twice = swept((0.0, 0.1, 0.125, 0.15, 0.2, 0.4), {"a": 0.13})
    assert new_values(twice, COARSE, rounds=2) == ()


def test_no_more_than_four_values_are_new_in_a_round() -> None:
    axis = Axis("noise", tuple(np.linspace(0.0, 1.0, 11).round(1).tolist()))
    crossings = {f"t{n}": 0.05 + 0.1 * n for n in range(10)}
    assert len(new_values(swept(axis.values, crossings), axis, rounds=1)) == 4


def test_sweeps_of_one_dial_are_merged_and_others_are_not() -> None:
    one = Sweep("poles", "", (COARSE,))
    finer = Sweep("poles", "", (Axis("noise", (0.15,)),))
    merged = one.merged(finer)
    assert merged is not None
    assert merged.axes[0].values == (0.0, 0.1, 0.15, 0.2, 0.4)
    assert one.merged(Sweep("fog", "", (COARSE,))) is None
    assert one.merged(Sweep("poles", "", (Axis("blur_px", (1.0,)),))) is None
    two = Sweep("poles", "", (COARSE, Axis("blur_px", (1.0, 2.0))))
    assert two.merged(two) == two
    other = Sweep("poles", "", (Axis("noise", (0.3,)), two.axes[1]))
    assert two.merged(other) is None


def asked(values: str, base: str = "smoke") -> Request:
    scenario = load_scenario(base).shortened(4)
    return sweep_request(
        [scenario], [f"noise={values}"], (find_tracker("still"),), (0,)
    )


def test_folder_of_a_sweep_grows_by_values_of_its_dial() -> None:
    coarse, finer = asked("0,0.1,0.2"), asked("0.15,0.175")
    grown = Experiment((coarse,)).grown(finer)
    assert grown.sweep is not None
    assert grown.sweep.axes[0].values == (0.0, 0.1, 0.15, 0.175, 0.2)
    assert Experiment.from_facts(json.loads(json.dumps(grown.facts()))) == grown
    assert grown.grown(coarse) == grown  # the same command finds what it made
    with pytest.raises(SimbenchError, match="another sweep or none"):
        grown.grown(replace(coarse, sweep=None))


def test_refined_run_asks_for_new_values_until_the_step_is_halved_so_often(
    tmp_path: Path,
) -> None:
    base, request = load_scenario("smoke").shortened(4), asked("0,0.1,0.2,0.4")
    values: set[float] = set()
    variants: list[tuple[str, ...]] = []

    def run(part: Request) -> RunResult:
        assert part.sweep is not None
        values.update(part.sweep.axes[0].values)
        variants.append(tuple(one.variant for one in part.scenarios))
        found = swept(tuple(sorted(values)), {"still": 0.13})
        return RunResult(Scores(pd.DataFrame(), pd.DataFrame()), folder, found)

    folder = RunFolder(tmp_path)
    refined_run(base, request, run, rounds=2)
    assert variants[1:] == [("noise=0.15",), ("noise=0.125",)]
    refined_run(base, request, run, rounds=2)  # again: nothing is new
    assert len(variants) == 4
    refined_run(base, request, run, rounds=0)
    assert len(variants) == 5
