from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simbench.evaluation.scores import Scores
from simbench.experiments.papers.instances import instance_measures

SIDE = 10.0


def scores_of(
    errors_px: list[float], hidden: tuple[int, ...] = (), particles: int = 100
) -> Scores:
    """Return one run whose estimate is so far right of a still target of 10 x 5 px."""
    count = len(errors_px)
    errors = np.array(errors_px)
    keys = {"scenario": "poles", "variant": "", "seed": 3, "tracker": "mine"}
    frames = pd.DataFrame(
        keys
        | {
            "repetition": 0,
            "frame": np.arange(count),
            "left": 50.0 + errors,
            "top": 40.0,
            "width": np.where(np.isnan(errors), np.nan, SIDE),
            "height": 5.0,
            "truth_left": 50.0,
            "truth_top": 40.0,
            "truth_width": SIDE,
            "truth_height": 5.0,
            "visible_fraction": np.where(np.isin(np.arange(count), hidden), 0.2, 1.0),
            "particles": np.where(np.arange(count) == 0, 0, particles),
        }
    )
    runs = pd.DataFrame(
        [
            keys
            | {
                "precision_20": 1.0,
                "success_50": 0.5,
                "average_overlap": 0.4,
                "fps": 10.0,
            }
        ]
    )
    return Scores(runs, frames)


def measured(*arguments: object, **named: object) -> pd.Series:
    return instance_measures(scores_of(*arguments, **named)).iloc[0]  # type: ignore[arg-type]


def test_target_is_kept_where_the_last_errors_are_below_its_size() -> None:
    kept = measured([90.0] * 8 + [5.9] * 12)
    assert (kept["keeps"], kept["keeps_20px"]) == (1.0, 1.0)
    lost = measured([0.0] * 8 + [6.1] * 12)
    assert (lost["keeps"], lost["keeps_20px"]) == (0.0, 1.0)
    assert lost["held"] == pytest.approx(8 / 20)
    assert lost["lasts"] == pytest.approx(8 / 20)


def test_frames_without_an_estimate_are_lost_and_far() -> None:
    found = measured([0.0] * 4 + [float("nan")] * 12)
    assert found["keeps"] == 0.0
    assert found["distance"] == pytest.approx(5.0 * 12 / 16)


def test_first_occlusion_is_survived_by_what_holds_the_target_after_it() -> None:
    errors = [0.0] * 5 + [30.0] * 3 + [0.0] * 12 + [90.0] * 20
    found = measured(errors, hidden=(5, 6, 7, 30, 31))
    assert (found["survives_first"], found["keeps"]) == (1.0, 0.0)
    assert np.isnan(measured(errors)["survives_first"])


def test_jitter_is_the_change_of_the_error_where_the_target_is_held() -> None:
    assert measured([1.0, 3.0, 1.0, 3.0, 90.0])["jitter_px"] == pytest.approx(2.0)
    assert np.isnan(measured([90.0, 90.0])["jitter_px"])


def test_usage_leaves_the_initialisation_out() -> None:
    assert measured([0.0] * 4, particles=30)["particles_min"] == 30.0
