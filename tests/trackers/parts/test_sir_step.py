"""Sequential importance resampling: weights, effective number, resampling, cost."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.resampling import effective_sample_size
from simbench.trackers.parts.sir_step import SirStep, Spread

SIGMA = 0.2
ELLIPSE = np.array([80.0, 60.0, 10.0, 10.0])
LIMITS = np.array([160.0, 120.0, 1.5, 1.5, 100.0, 100.0])
NARROW = Spread(4.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def image() -> NDArray[np.uint8]:
    rows, columns = np.mgrid[:120, :160]
    picture = np.full((120, 160, 3), 90, np.uint8)
    picture[np.hypot(columns - 80, rows - 60) < 10] = (220, 40, 40)
    return picture


def made(
    image: NDArray[np.uint8], *, particles: int = 200, threshold: float = 0.5
) -> tuple[SirStep, ColourLikelihood]:
    likelihood = ColourLikelihood(image, ELLIPSE, samples=64, surround=0.0)
    state = SirStep(
        ELLIPSE,
        LIMITS,
        particles=particles,
        likelihood=likelihood,
        sigma=SIGMA,
        threshold=threshold,
        resampling="systematic",
    )
    return state, likelihood


def test_weights_are_those_before_times_the_likelihood(
    image: NDArray[np.uint8],
) -> None:
    state, _ = made(image, threshold=0.0)
    rng = np.random.default_rng(1)
    product = np.ones(200)
    for _ in range(3):
        state.advance(image, (0.0, 0.0), NARROW, rng)
        product *= np.exp(state.similarities / (2.0 * SIGMA**2))
    assert state.weights == pytest.approx(product / product.sum(), rel=1e-9)
    assert state.mean == pytest.approx(state.weights @ state.cloud)
    assert state.similarity == pytest.approx(state.weights @ state.similarities)


@pytest.mark.parametrize(("threshold", "is_resampled"), [(1.0, True), (0.01, False)])
def test_particles_are_resampled_only_below_the_threshold(
    threshold: float, is_resampled: bool, image: NDArray[np.uint8]
) -> None:
    state, _ = made(image, threshold=threshold)
    rng = np.random.default_rng(1)
    state.advance(image, (0.0, 0.0), NARROW, rng)
    effective = effective_sample_size(state.weights)
    places, weights = state.cloud.copy(), state.weights.copy()
    still = Spread(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    state.advance(image, (0.0, 0.0), still, rng)
    assert state.effective == pytest.approx(effective)
    assert 2.0 < effective < 200.0
    kept = len(np.unique(state.cloud[:, 0]))
    if is_resampled:
        heavy = places[weights > 1.0 / 200]
        assert np.isin(heavy[:, 0], state.cloud[:, 0]).all()
        assert kept < 200
    else:
        assert np.array_equal(state.cloud, places)


def test_mean_of_a_flat_likelihood_is_unbiased() -> None:
    flat = np.full((120, 160, 3), 90, np.uint8)
    means = []
    for seed in range(60):
        state, _ = made(flat, threshold=1.0)
        rng = np.random.default_rng(seed)
        for _ in range(3):
            state.advance(flat, (2.0, -1.0), NARROW, rng)
        means.append(state.mean[:2])
    error = np.mean(means, axis=0) - [86.0, 57.0]
    assert np.abs(error).max() < 4.0 * 4.0 * np.sqrt(3.0 / (60 * 200))


def test_share_of_far_particles_is_kept_in_every_frame_and_goes_round(
    image: NDArray[np.uint8],
) -> None:
    state, _ = made(image)
    rng = np.random.default_rng(1)
    far = Spread(0.0, 0.0, 0.0, 0.0, 0.3, 5.0, 5.0)
    chosen = []
    for _ in range(6):
        state.weights[:] = 1.0 / 200
        state.cloud[:] = ELLIPSE
        state.advance(image, (0.0, 0.0), far, rng)
        chosen.append(state.cloud[:, 0] != ELLIPSE[0])
    assert all(59 <= one.sum() <= 61 for one in chosen)
    assert np.any(chosen, axis=0).sum() > 100


@pytest.mark.parametrize("particles", [1, 100, 1000])
def test_each_particle_is_measured_once_a_frame(
    particles: int, image: NDArray[np.uint8]
) -> None:
    state, likelihood = made(image, particles=particles)
    for frame in range(1, 4):
        state.advance(image, (0.0, 0.0), NARROW, np.random.default_rng(0))
        assert likelihood.evaluations == frame * particles


def test_particles_stay_in_the_image_wherever_they_are_moved(
    image: NDArray[np.uint8],
) -> None:
    state, _ = made(image)
    state.move(np.array([500.0, -500.0]))
    assert state.cloud[:, 0].max() <= 160.0
    assert state.cloud[:, 1].min() >= 0.0
    state.advance(image, (1e6, 0.0), NARROW, np.random.default_rng(0))
    assert np.isfinite(state.weights).all()
    assert state.cloud[:, 0].max() <= 160.0
