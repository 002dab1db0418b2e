from __future__ import annotations

import numpy as np
import pytest

from simbench.experiments.papers.claim_parts import (
    LEVEL,
    Part,
    difference_part,
    range_part,
    share_part,
)
from simbench.experiments.papers.judging import judged


def _part(p_for: float = 0.5, p_against: float = 0.5, count: int = 20) -> Part:
    return Part("part", "", count, p_for, p_against, "")


@pytest.mark.parametrize(
    ("parts", "verdict"),
    [
        pytest.param([_part(0.01), _part(0.02)], "holds", id="all parts shown"),
        pytest.param([_part(0.01), _part(0.4)], "not decided", id="one is not"),
        pytest.param(
            [_part(0.01), _part(p_against=0.01)], "does not hold", id="against"
        ),
        pytest.param([_part(p_against=0.02)] * 2, "not decided", id="Holm corrects"),
        pytest.param([_part(0.001, count=8)], "holds", id="shown by few"),
        pytest.param([_part(0.01), _part(count=0)], "open", id="a tracker is missing"),
        pytest.param(
            [_part(p_against=0.01), _part(1.0, 1.0, 0)],
            "does not hold",
            id="a missing tracker cannot save a claim",
        ),
        pytest.param([], "open", id="nothing measured"),
    ],
)
def test_verdict_follows_from_the_tests_of_the_parts(
    parts: list[Part], verdict: str
) -> None:
    assert judged("a", "paper", "", parts, 20).verdict == verdict


@pytest.mark.parametrize(("seeds", "least"), [(20, 20), (5, 5)])
def test_claim_is_not_decided_only_by_enough_seeds(seeds: int, least: int) -> None:
    parts = [_part(0.4)]
    assert judged("a", "paper", "", parts, seeds, least).verdict == "not decided"
    assert judged("a", "paper", "", parts, seeds - 1, least).verdict == "too few seeds"


def test_share_is_tested_against_half_exactly() -> None:
    # of 6 fair coins all 6 are heads once in 64
    part = share_part("all", np.ones(6))
    assert part.p_for == pytest.approx(1 / 64)
    assert part.p_against == 1.0
    below = share_part("none", np.zeros(6), above=False)
    assert below.p_for == pytest.approx(1 / 64)
    assert share_part("half", [1.0, 0.0]).p_for == pytest.approx(0.75)


def test_power_of_a_share_is_that_of_the_binomial_test() -> None:
    # 15 of 20 is the least with p below 2.5 % (0.0207); 16 of 20 at a share of .8
    assert "shown with 80%" in share_part("", np.ones(20)).power
    assert "shown with 0%" in share_part("", np.ones(3)).power


def test_sign_of_a_difference_decides_its_side() -> None:
    above = difference_part("", np.full(8, 0.1))
    below = difference_part("", np.full(8, -0.1))
    assert above.p_for == below.p_against == pytest.approx(1 / 256)
    assert above.p_against > 1.0 - LEVEL


def test_unknown_values_are_no_instances() -> None:
    assert share_part("", [1.0, np.nan, 0.0]).count == 2
    assert difference_part("", [np.nan]).count == 0
    assert range_part("", [], 0.0, 1.0).count == 0


def test_mean_must_be_within_both_ends_of_a_range() -> None:
    values = 0.5 + 0.01 * np.tile([-1.0, 1.0], 10)
    assert range_part("", values, 0.4, 0.6).p_for < 1e-6
    outside = range_part("", values, 0.6, 0.7)
    assert outside.p_against < 1e-6 < 0.5 < outside.p_for
    at_the_end = range_part("", values, 0.5, 0.6)
    assert at_the_end.p_for == pytest.approx(0.5)
