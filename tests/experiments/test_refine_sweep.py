"""Refined sweeps: where new values go, and folders that grow by them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import simbench
from simbench.core.errors import SimbenchError
from simbench.evaluation.sweep_axes import Axis, Sweep
from simbench.evaluation.sweep_scores import SweepScores
from simbench.experiments.refine_sweep import new_values

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


@pytest.mark.sumo
@pytest.mark.gl
def test_sweep_is_refined_in_its_folder_and_the_same_call_makes_nothing_again(
    tmp_path: Path,
) -> None:
    def call(vary: str = "frame_rate_hz=5,25", refine: int = 1) -> SweepScores:
        return simbench.sweep(
            "smoke", vary, "still", [0], frames=8, out=tmp_path, jobs=0, refine=refine
        )

    found = call()
    (row,) = found.breaking.to_dict("records")
    assert row["state"] == "within"  # slower films: the car leaves its first box
    assert found.sweep.axes[0].values == (5.0, 15.0, 25.0)
    assert found.points["requested.frame_rate_hz"].tolist() == [5.0, 15.0, 25.0]
    parts = {path: path.stat().st_mtime_ns for path in tmp_path.glob("parts/*/*")}
    again = call()
    assert again.sweep == found.sweep
    assert {p: p.stat().st_mtime_ns for p in tmp_path.glob("parts/*/*")} == parts
    with pytest.raises(SimbenchError, match="another sweep"):
        call("noise=0,0.1")
