"""Particle economy: the Pareto front, and particles needed for a precision."""

from __future__ import annotations

import math
from collections.abc import Mapping

import pandas as pd
import pytest

from simbench.evaluation.statistics.particle_economy import particle_economy
from simbench.report.economy import economy_figure, economy_rows
from simbench.report.palette import tracker_styles

SPECS = {
    "c10": "c10=condensation@particles=10",
    "c40": "c40=condensation@particles=40",
    "condensation": "condensation",
    "dsp": "dsp",
}


def runs(scores: Mapping[str, tuple[float, float]]) -> pd.DataFrame:
    """Return runs on two seeds: particles and precision by tracker."""
    return pd.DataFrame(
        {
            "scenario": "poles",
            "variant": "",
            "seed": seed,
            "tracker": tracker,
            "particles_mean": particles,
            "precision_20": precision,
            "success_50": precision / 2,
        }
        for tracker, (particles, precision) in scores.items()
        for seed in (0, 1)
    )


RUNS = runs(
    {
        "condensation": (100.0, 1.0),
        "c10": (10.0, 0.5),
        "c40": (40.0, 0.8),
        "dsp": (60.0, 0.7),
        "still": (0.0, 0.1),
    }
)


def test_trackers_that_no_cheaper_one_reaches_are_on_the_front() -> None:
    economy = particle_economy(RUNS, SPECS)
    assert {one.tracker: one.is_on_front for one in economy.costs} == {
        "c10": True,
        "c40": True,
        "dsp": False,
        "condensation": True,
    }


def test_particles_needed_are_between_those_of_one_family() -> None:
    needed = particle_economy(RUNS, SPECS).needed
    # half way from .8 to 1, on the logarithm
    assert needed["condensation"] == pytest.approx(math.sqrt(40.0 * 100.0))
    assert math.isnan(needed["dsp"])


def test_cheapest_tracker_that_is_precise_needs_its_own_particles() -> None:
    found = particle_economy(runs({"dsp": (60.0, 0.95)}), SPECS)
    assert found.needed == {"dsp": 60.0}


def test_table_and_figure_name_every_tracker() -> None:
    economy = particle_economy(RUNS, SPECS)
    rows = economy_rows(economy)
    assert [row[0] for row in rows] == ["c10", "c40", "dsp", "condensation"]
    assert [row[-1] for row in rows] == ["", "", "not reached", "63"]
    figure = economy_figure(economy, tracker_styles([row[0] for row in rows]))
    assert figure.startswith("<svg ") and figure.count("<circle") == 8
    assert all(f">{row[0]}</text>" in figure for row in rows)


def test_run_without_particles_has_no_figure() -> None:
    economy = particle_economy(runs({"still": (0.0, 0.1)}), {})
    assert (economy.costs, economy_figure(economy, {})) == ((), "")
