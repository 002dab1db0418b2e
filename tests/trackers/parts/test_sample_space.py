"""The mixture that stands for all samples."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.fourier_series import FourierSeries
from simbench.trackers.parts.sample_space import SampleSpace

SERIES = FourierSeries(1, 8.0)
FREQUENCIES = len(SERIES.weights)


def sample(*values: float) -> NDArray[np.complex64]:
    """Return a sample of constant functions, one a channel."""
    found = np.zeros((FREQUENCIES, len(values)), np.complex64)
    found[0] = values
    return found


def samples(count: int, rng: np.random.Generator) -> list[NDArray[np.complex64]]:
    values = rng.standard_normal((count, 8, 8, 3)).astype(np.float32)
    return [SERIES.from_grid(each) for each in values]


def test_weights_fall_with_age_and_sum_to_one() -> None:
    space = SampleSpace(SERIES, 5, 0.1)
    for value in (1.0, 2.0, 3.0):
        space.add(sample(value))
    assert space.weights == pytest.approx([0.81, 0.09, 0.1])


def test_closest_two_merge_at_their_weighted_mean() -> None:
    space = SampleSpace(SERIES, 3, 0.2)
    for value in (1.0, 5.0, 9.0):
        space.add(sample(value))
    space.add(sample(6.0))  # 5 has a weight of 0.128 then, 6 of 0.2
    merged = (0.128 * 5.0 + 0.2 * 6.0) / 0.328
    assert space.means[0, :, 0] == pytest.approx([1.0, merged, 9.0])
    assert space.weights == pytest.approx([0.512, 0.328, 0.16])
    space.add(sample(30.0))  # the two old ones that are closest now are 5.6 and 9
    assert sorted(space.means[0, :, 0].real)[2] == pytest.approx(30.0)


def test_merges_keep_the_weighted_mean_of_all_samples(rng: np.random.Generator) -> None:
    # No weight falls below the least in so few: nothing is dropped.
    space = SampleSpace(SERIES, 4, 0.1)
    expected = sample(0.0, 0.0, 0.0)
    for number, each in enumerate(samples(9, rng)):
        space.add(each)
        share = 1.0 if number == 0 else 0.1
        expected = expected + np.float32(share) * (each - expected)
    found = np.einsum("l,klc->kc", space.weights, space.means)
    assert found == pytest.approx(expected, abs=1e-5)
    assert len(space.weights) == 4


def test_distances_stay_those_of_the_means_after_merges(
    rng: np.random.Generator,
) -> None:
    space = SampleSpace(SERIES, 4, 0.1)
    for each in samples(12, rng):
        space.add(each)
    means = space.means.transpose(1, 0, 2)
    expected = [[SERIES.inner(one, other) for other in means] for one in means]
    assert space._products[:4, :4] == pytest.approx(np.array(expected), abs=1e-4)


def test_component_of_little_weight_is_dropped_first() -> None:
    space = SampleSpace(SERIES, 2, 0.5)  # the least weight is 0.5 ** 5
    space.add(sample(0.0))
    space.add(sample(50.0))
    for _ in range(4):
        space.add(sample(50.0))
    assert space.means[0, :, 0].real.min() == pytest.approx(0.0)
    space.add(sample(90.0))
    assert space.means[0, :, 0].real.min() == pytest.approx(50.0)
    assert space.weights.sum() == pytest.approx(1.0)
