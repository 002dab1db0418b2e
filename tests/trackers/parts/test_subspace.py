"""The incremental subspace against principal components of all samples at once."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.subspace import Subspace


def samples(count: int = 23, size: int = 40) -> NDArray[np.float64]:
    """Return samples around a mean, of seven strong directions and little noise."""
    rng = np.random.default_rng(8)
    directions = rng.standard_normal((7, size)) * np.geomspace(9.0, 1.0, 7)[:, None]
    return 5.0 + rng.standard_normal((count, 7)) @ directions


def learnt(batches: list[NDArray[np.float64]], forgetting: float = 1.0) -> Subspace:
    subspace = Subspace(components=16, forgetting=forgetting)
    for batch in batches:
        subspace.learn(batch)
    return subspace


@pytest.mark.parametrize("sizes", [(1, 5, 5, 5, 7), (23,), (10, 13), (1,) * 23])
def test_batches_without_forgetting_equal_all_samples_at_once(
    sizes: tuple[int, ...],
) -> None:
    everything = samples()
    batches = np.split(everything, np.cumsum(sizes)[:-1])
    subspace = learnt(batches)
    _, values, directions = np.linalg.svd(
        everything - everything.mean(axis=0), full_matrices=False
    )
    np.testing.assert_allclose(subspace.mean, everything.mean(axis=0))
    assert len(subspace.values) == 7
    np.testing.assert_allclose(subspace.values, values[:7], rtol=1e-9)
    cosines = np.abs(np.sum(subspace.basis * directions[:7].T, axis=0))
    np.testing.assert_allclose(cosines, 1.0, rtol=1e-9)


def test_basis_stays_orthonormal_over_many_batches_that_repeat() -> None:
    batch = samples(5)
    subspace = learnt([batch] * 60, forgetting=0.95)
    gram = subspace.basis.T @ subspace.basis
    np.testing.assert_allclose(gram, np.eye(len(gram)), atol=1e-9)
    assert len(gram) <= 5


def test_forgetting_equals_weights_on_earlier_samples() -> None:
    first, second = np.split(samples(20), 2)
    subspace = learnt([first, second], forgetting=0.5)
    # One update: earlier samples weigh f in the mean, and f^2 in the scatter.
    mean = (0.5 * first.sum(axis=0) + second.sum(axis=0)) / 15.0
    np.testing.assert_allclose(subspace.mean, mean)
    shift = np.sqrt(5.0 * 10.0 / 15.0) * (second.mean(axis=0) - first.mean(axis=0))
    scatter = [0.5 * (first - first.mean(0)), second - second.mean(0), shift[None]]
    values = np.linalg.svd(np.vstack(scatter), compute_uv=False)[: len(subspace.values)]
    np.testing.assert_allclose(subspace.values, values, rtol=1e-9)


def test_no_more_components_are_kept_than_asked() -> None:
    subspace = Subspace(components=3, forgetting=1.0)
    for batch in np.split(samples(20), 4):
        subspace.learn(batch)
    assert subspace.basis.shape == (40, 3)
    assert np.all(np.diff(subspace.values) <= 0.0)


def test_one_sample_has_a_mean_and_no_component() -> None:
    subspace = learnt([np.arange(4.0)[None]])
    assert subspace.mean.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert subspace.basis.shape == (4, 0)
