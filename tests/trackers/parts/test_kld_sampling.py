"""KLD sampling: the number of particles against Fox's equation and their spread."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.filter_step import FilterStep
from simbench.trackers.parts.kld_sampling import (
    EMPTY,
    KldSampling,
    claim,
    particles_needed,
)
from tests.trackers.clips import road

MOST = 600
BINS = KldSampling(least=25, epsilon=0.15, delta=0.01, bin_boxes=0.1, bin_growth=0.1)


def make_step(kld: KldSampling | None) -> tuple[FilterStep, NDArray[np.uint8]]:
    image = road(320, 200, np.random.default_rng(0))
    target = np.array([160.0, 100.0, 20.0, 15.0])
    likelihood = ColourLikelihood(image, target, samples=64, surround=0.0)
    step = FilterStep(
        image,
        target,
        particles=MOST,
        likelihood=likelihood,
        sigma=0.1,
        structure=0.0,
        scale_range=(0.1, 10.0),
        min_half_axis=1.5,
        resampling="multinomial",
        kld=kld,
    )
    return step, image


@pytest.mark.parametrize("bins", [2, 5, 20, 100])
@pytest.mark.parametrize("delta", [0.05, 0.01])
def test_particles_follow_the_chi_squared_quantile(bins: int, delta: float) -> None:
    kld = KldSampling(least=1, epsilon=0.05, delta=delta, bin_boxes=0.1, bin_growth=0.1)
    needed = particles_needed(bins, kld.epsilon, kld.quantile)
    exact = chi2.ppf(1.0 - delta, bins - 1) / (2.0 * kld.epsilon)
    assert needed == pytest.approx(exact, rel=0.03)  # the approximation at one degree


def test_one_bin_needs_one_particle() -> None:
    assert particles_needed(1, 0.05, 2.3) == 1.0


def test_bin_is_empty_once_whatever_else_is_occupied(rng: np.random.Generator) -> None:
    occupied = np.zeros((1024, 3), np.int64)
    occupied[:, 0] = EMPTY
    bins = [(c, r, s) for c, r, s in rng.integers(-6, 7, (500, 3)).tolist()]
    found = [bool(claim(c, r, s, occupied)) for c, r, s in bins]
    firsts = [each not in bins[:index] for index, each in enumerate(bins)]
    assert found == firsts
    assert not all(firsts)


def test_particles_rise_with_the_spread_between_least_and_most() -> None:
    used = []
    for boxes in (0.0, 0.03, 0.06, 0.12, 1.0):
        step, image = make_step(BINS)
        step.motion.update(spread_x=40.0 * boxes, spread_y=30.0 * boxes)
        used.append(step.advance(image, np.random.default_rng(3)))
        assert len(step.cloud) == len(step.weights) == used[-1]
        assert step.weights.sum() == pytest.approx(1.0)
    assert used == sorted(used)
    assert used[0] == 25
    assert used[0] + 20 < used[1] + 20 < used[2] < used[3] - 50
    assert used[-1] == MOST


def test_half_of_epsilon_takes_twice_the_particles_or_more() -> None:
    used = []
    for epsilon in (0.4, 0.2):
        kld = KldSampling(
            least=10, epsilon=epsilon, delta=0.01, bin_boxes=0.1, bin_growth=0.1
        )
        step, image = make_step(kld)
        step.motion.update(spread_x=3.0, spread_y=2.0)
        counts = [step.advance(image, np.random.default_rng(s)) for s in range(20)]
        used.append(np.mean(counts))
    assert 1.9 < used[1] / used[0] < 3.5  # more particles find more bins, too


def test_next_frame_is_drawn_from_all_of_the_adapted_cloud() -> None:
    step, image = make_step(BINS)
    step.motion.update(spread_x=2.0, spread_y=2.0)
    step.advance(image, np.random.default_rng(0))
    before = step.cloud.copy()
    step.motion.update(spread_x=0.0, spread_y=0.0)
    step.advance(image, np.random.default_rng(1))
    places = {tuple(each) for each in before[:, :2].tolist()}
    drawn = {tuple(each) for each in step.cloud[:, :2].tolist()}
    assert drawn <= places
    # Of independent draws with weights, about a half of the ancestors occur.
    assert len(drawn) > 0.2 * len(step.cloud)
