"""Incremental principal components with a moving mean and forgetting."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Subspace"]

LEAST_SHARE = 1e-7  # of the largest singular value: smaller components are round-off


class Subspace:
    """Mean and principal components of samples that come in batches.

    Parameters
    ----------
    components : int
        Maximum number of components kept.
    forgetting : float, in (0, 1]
        Factor f on the weight of all earlier samples, at each batch. With 1, and
        components enough, the result is that of all samples at once.

    Attributes
    ----------
    mean : (D,) float
    basis : (D, k) float
        Orthonormal components, the strongest first; none after one sample.
    values : (k,) float
        Their singular values: the square roots of the sums of squared coordinates.

    References
    ----------
    Ross, Lim, Lin, Yang, "Incremental learning for robust visual tracking", Int. J.
    Computer Vision 77, 2008 (IVT), sections 3.1.1 and 3.1.2: sequential Karhunen-Loeve
    algorithm of Levy and Lindenbaum with an update of the mean.
    """

    def __init__(self, *, components: int, forgetting: float) -> None:
        self._components = components
        self._forgetting = forgetting
        self._count = 0.0  # effective number of samples
        self.mean = np.zeros(0)
        self.basis = np.zeros((0, 0))
        self.values = np.zeros(0)

    def learn(self, samples: NDArray[np.floating]) -> None:
        """Add a batch of (M, D) samples."""
        batch = np.asarray(samples, np.float64)
        size = len(batch)
        batch_mean = batch.mean(axis=0)
        centred = batch - batch_mean
        if self._count == 0.0:
            self.mean, self._count = batch_mean, float(size)
            self.basis = np.zeros((batch.shape[1], 0))
        else:
            kept = self._forgetting * self._count
            total = kept + size
            # The difference of the two means counts as one more sample.
            shift = np.sqrt(kept * size / total) * (batch_mean - self.mean)
            centred = np.vstack([centred, shift])
            self.mean = (kept * self.mean + size * batch_mean) / total
            self._count = total
        self._add(centred.T)

    def _add(self, columns: NDArray[np.float64]) -> None:
        """Update basis and singular values by (D, M) columns without mean."""
        inside = self.basis.T @ columns
        outside = columns - self.basis @ inside
        new, remainder = np.linalg.qr(outside)
        old = len(self.values)
        joint = np.zeros((old + len(remainder), old + columns.shape[1]))
        joint[:old, :old] = self._forgetting * np.diag(self.values)
        joint[:old, old:], joint[old:, old:] = inside, remainder
        turn, values, _ = np.linalg.svd(joint, full_matrices=False)
        strong = values > LEAST_SHARE * max(float(values[0]), 1.0)
        kept = min(int(strong.sum()), self._components)
        self.basis = (np.hstack([self.basis, new]) @ turn)[:, :kept]
        self.values = values[:kept]
