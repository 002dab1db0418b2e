"""Colour similarities: bin table, kernel against cv2.calcHist, evaluation count."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.colour_histogram import (
    BINS,
    bin_table,
    disc_samples,
    histogram,
    ring_samples,
    similarities,
)
from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from tests.trackers.clips import car, draw, road

ELLIPSE = np.array([100.0, 60.0, 24.0, 18.0])


@pytest.fixture
def image() -> NDArray[np.uint8]:
    rng = np.random.default_rng(5)
    image = road(200, 120, rng)
    box = np.concatenate([ELLIPSE[:2] - ELLIPSE[2:], 2.0 * ELLIPSE[2:]])
    draw(image, car((30, 90, 170), rng), box)
    return image


def calc_hist(
    image: NDArray[np.uint8], ellipse: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the histogram over every pixel whose centre is in the ellipse."""
    rows, columns = np.mgrid[: image.shape[0], : image.shape[1]] + 0.5
    squared = ((columns - ellipse[0]) / ellipse[2]) ** 2
    squared += ((rows - ellipse[1]) / ellipse[3]) ** 2
    mask = (squared <= 1.0).astype(np.uint8)
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    ranges = [0, 180, 0, 256, 0, 256]
    counts = cv2.calcHist([hsv], [0, 1, 2], mask, [8, 8, 4], ranges).ravel()
    return np.asarray(counts / counts.sum(), np.float64)


@pytest.mark.parametrize(
    ("colour", "bin_of"),
    [
        pytest.param((0, 0, 0), (0, 0, 0), id="black"),
        pytest.param((255, 255, 255), (0, 0, 3), id="white"),
        pytest.param((255, 0, 0), (0, 7, 3), id="red"),
        pytest.param((0, 255, 0), (2, 7, 3), id="green, hue 60"),
        pytest.param((0, 0, 255), (5, 7, 3), id="blue, hue 120"),
    ],
)
def test_table_maps_a_colour_to_its_bin(
    colour: tuple[int, int, int], bin_of: tuple[int, int, int]
) -> None:
    red, green, blue = colour
    hue, saturation, value = bin_of
    entry = bin_table()[red << 16 | green << 8 | blue]
    assert entry == (hue * 8 + saturation) * 4 + value


def test_table_agrees_with_opencv_on_random_colours(rng: np.random.Generator) -> None:
    image = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)
    counts = np.zeros(BINS, np.int64)
    packed = image.astype(np.int64) @ [1 << 16, 1 << 8, 1]
    counts += np.bincount(bin_table()[packed].ravel(), minlength=BINS)
    everything = np.array([32.0, 32.0, 1e6, 1e6])
    expected = calc_hist(image, everything) * image.shape[0] * image.shape[1]
    assert counts.tolist() == pytest.approx(expected.tolist())


def test_disc_samples_spread_evenly() -> None:
    samples = disc_samples(1000)
    radii = np.hypot(samples[:, 0], samples[:, 1])
    assert radii.max() < 1.0
    assert np.mean(radii < 0.5) == pytest.approx(0.25, abs=0.005)  # area goes as r^2
    assert samples.mean(axis=0) == pytest.approx([0.0, 0.0], abs=0.01)


def test_ring_samples_are_between_both_radii() -> None:
    radii = np.linalg.norm(ring_samples(500, 1.1, 1.5), axis=1)
    assert 1.1 < radii.min() < radii.max() < 1.5


def test_histogram_of_an_ellipse_agrees_with_opencv(image: NDArray[np.uint8]) -> None:
    counts = histogram(image, bin_table(), ELLIPSE, disc_samples(50_000))
    # 1357 pixels: the two outlines may share out some edge pixels differently.
    assert counts / 50_000 == pytest.approx(calc_hist(image, ELLIPSE), abs=0.01)


def test_similarities_agree_with_opencv_within_the_sampling_error(
    image: NDArray[np.uint8], rng: np.random.Generator
) -> None:
    reference = calc_hist(image, ELLIPSE)
    spread = np.array([8.0, 6.0, 2.0, 2.0])
    ellipses = ELLIPSE + rng.standard_normal((200, 4)) * spread
    exact = np.array(
        [np.sum(np.sqrt(reference * calc_hist(image, each))) for each in ellipses]
    )
    sampled = similarities(image, bin_table(), ellipses, disc_samples(128), reference)
    error = sampled - exact
    # Few samples lose about (bins in use - 1) / (8 K) of rho on average (the second
    # order of the square root), alike for all; the rest is of order 1 / (2 sqrt(K)).
    bins = np.count_nonzero(reference > 1e-3)
    assert -2.0 * bins / (8 * 128) < error.mean() < 0.005
    assert error.std() < 1.0 / (2.0 * math.sqrt(128))
    assert np.corrcoef(sampled, exact)[0, 1] > 0.97


def test_similarity_of_the_target_with_itself_is_one(image: NDArray[np.uint8]) -> None:
    samples = disc_samples(4096)
    counts = histogram(image, bin_table(), ELLIPSE, samples)
    rho = similarities(image, bin_table(), ELLIPSE[None], samples, counts / 4096)
    assert rho[0] == pytest.approx(1.0)


def test_similarity_of_an_ellipse_outside_the_image_is_zero(
    image: NDArray[np.uint8],
) -> None:
    likelihood = ColourLikelihood(
        image, ELLIPSE, samples=64, surround=0.0, background=0.0
    )
    outside = np.array([[-500.0, 60.0, 24.0, 18.0], [1e12, 60.0, 24.0, 18.0]])
    assert likelihood.similarities(image, outside).tolist() == [0.0, 0.0]


def test_similarity_without_surround_is_the_plain_coefficient(
    image: NDArray[np.uint8],
) -> None:
    likelihood = ColourLikelihood(
        image, ELLIPSE, samples=512, surround=0.0, background=0.0
    )
    shifted = ELLIPSE + [10.0, 0.0, 0.0, 0.0]
    expected = np.sum(np.sqrt(calc_hist(image, ELLIPSE) * calc_hist(image, shifted)))
    rho = likelihood.similarities(image, shifted[None])
    assert rho[0] == pytest.approx(expected, abs=0.03)


def test_surround_penalises_an_ellipse_that_is_too_small(
    image: NDArray[np.uint8],
) -> None:
    small = ELLIPSE * [1.0, 1.0, 0.75, 0.75]
    places = np.array([ELLIPSE, small])
    losses = []
    for surround in (0.0, 1.0):
        likelihood = ColourLikelihood(
            image, ELLIPSE, samples=512, surround=surround, background=0.0
        )
        right, wrong = likelihood.similarities(image, places)
        losses.append(right - wrong)
    assert losses[0] < 0.1 < 0.2 < losses[1]


def test_every_ellipse_evaluated_is_counted(image: NDArray[np.uint8]) -> None:
    likelihood = ColourLikelihood(
        image, ELLIPSE, samples=64, surround=1.0, background=0.0
    )
    assert likelihood.evaluations == 0
    likelihood.similarities(image, np.tile(ELLIPSE, (7, 1)))
    likelihood.similarities(image, np.tile(ELLIPSE, (5, 1)))
    assert likelihood.evaluations == 12


def test_background_colours_are_reduced_in_the_reference(
    image: NDArray[np.uint8],
) -> None:
    around = ELLIPSE * [1.0, 1.0, 1.5, 1.5]  # the first box cut too wide
    beside = ELLIPSE + [70.0, 0.0, 0.0, 0.0]
    road_similarities = []
    for background in (0.0, 8.0):
        likelihood = ColourLikelihood(
            image, around, samples=512, surround=0.0, background=background
        )
        assert likelihood.reference.sum() == pytest.approx(1.0)
        road_similarities.append(likelihood.similarities(image, beside[None])[0])
    assert road_similarities[1] < 0.5 * road_similarities[0]
