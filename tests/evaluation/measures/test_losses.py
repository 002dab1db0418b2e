"""Losses, recoveries and the survival curve."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import CensoredData, ecdf

from simbench.evaluation.measures.losses import Loss, find_losses, occlusions, survival


def found(*overlaps: tuple[float, int], skip: tuple[int, ...] = ()) -> list[Loss]:
    values = np.repeat([v for v, _ in overlaps], [n for _, n in overlaps])
    scored = ~np.isin(np.arange(len(values)), skip)
    return list(find_losses(values, scored))


def test_target_that_is_held_is_not_lost() -> None:
    assert found((0.9, 20)) == []


def test_four_frames_without_overlap_are_no_loss_and_five_are() -> None:
    assert found((0.9, 5), (0.0, 4), (0.9, 5)) == []
    assert found((0.9, 5), (0.0, 5), (0.9, 5)) == [Loss(5, 10, 10)]


def test_loss_lasts_until_the_overlap_is_above_a_half() -> None:
    assert found((0.9, 3), (0.0, 6), (0.4, 10), (0.0, 6), (0.6, 1)) == [Loss(3, 25, 25)]


def test_loss_that_never_ends_reaches_the_last_frame() -> None:
    assert found((0.9, 3), (0.1, 9)) == [Loss(3, None, 12)]


def test_second_loss_is_counted_after_recovery() -> None:
    losses = found((0.9, 3), (0.0, 5), (0.8, 2), (0.0, 7))
    assert losses == [Loss(3, 8, 8), Loss(10, None, 17)]


def test_frames_that_do_not_count_neither_make_nor_break_a_loss() -> None:
    # frames 4 to 6 are absent: four frames without overlap remain
    assert found((0.9, 3), (0.0, 7), (0.9, 2), skip=(4, 5, 6)) == []
    assert found((0.9, 3), (0.0, 8), (0.9, 2), skip=(4, 5, 6)) == [Loss(3, 11, 11)]


def test_occlusions_are_runs_with_less_than_half_visible() -> None:
    visible = np.array([1, 0.4, 0.2, 0.5, 0, 0, 1])
    absent = np.array([False] * 4 + [True] + [False] * 2)
    assert occlusions(visible, absent) == ((1, 2), (5, 5))
    assert occlusions(np.full(3, np.nan), np.zeros(3, np.bool_)) is None


def test_survival_curve_is_that_of_the_textbook() -> None:
    # Freireich et al. (1963), 6-mercaptopurine: weeks of remission, + is censored
    events = [6, 6, 6, 7, 10, 13, 16, 22, 23]
    ends = [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35]
    curve = survival(events + ends, [True] * len(events) + [False] * len(ends))
    at = dict(zip(curve.time_s.tolist(), curve.share.tolist(), strict=True))
    expected = {0: 1, 6: 0.857, 7: 0.807, 10: 0.753, 13: 0.690, 16: 0.627, 22: 0.538}
    for week, share in (expected | {23: 0.448, 35: 0.448}).items():
        assert at[week] == pytest.approx(share, abs=5e-4), week
    # log-log interval at 10 weeks, as R's survfit(conf.type = "log-log") gives it
    place = curve.time_s.tolist().index(10.0)
    assert_allclose([curve.low[place], curve.high[place]], [0.503, 0.889], atol=1e-3)


def test_survival_of_runs_without_a_loss_stays_one() -> None:
    assert survival([3.0, 4.0], [False, False]).share.tolist() == [1, 1, 1]


def test_survival_of_no_run_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one run"):
        survival([], [])


def test_survival_curve_and_its_interval_are_those_of_scipy() -> None:
    rng = np.random.default_rng(5)
    times = rng.integers(1, 12, 60) / 4.0
    lost = rng.random(60) < 0.6
    curve = survival(times, lost)
    expected = ecdf(CensoredData(uncensored=times[lost], right=times[~lost])).sf
    bounds = expected.confidence_interval(method="log-log")
    assert_allclose(curve.time_s[1:], expected.quantiles)
    assert_allclose(curve.share[1:], expected.probabilities, atol=1e-12)
    assert_allclose(curve.low[1:], bounds.low.probabilities, atol=1e-12)
    assert_allclose(curve.high[1:], bounds.high.probabilities, atol=1e-12)
