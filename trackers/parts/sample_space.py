"""Compact generative model of training samples: a mixture with merges, for ECO."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.fourier_series import FourierSeries

__all__ = ["SampleSpace"]


class SampleSpace:
    """Mixture of Gaussians with unit covariance, which stands for all samples so far.

    A sample enters as a component of its own. Beyond the limit a component of little
    weight is dropped, or else the two closest become one at their weighted mean.

    Parameters
    ----------
    series : FourierSeries
        In which samples are written.
    limit : int
        Greatest number of components.
    rate : float, in (0, 1)
        Weight of a new sample.

    References
    ----------
    Danelljan, Bhat, Khan, Felsberg, "ECO: Efficient convolution operators for
    tracking", CVPR 2017, section 3.2.

    Notes
    -----
    The paper names no least weight; it is that of the authors' code, which a sample has
    after twice as many others as there are components.
    """

    def __init__(self, series: FourierSeries, limit: int, rate: float) -> None:
        self._series = series
        self._limit = limit
        self._rate = rate
        self._least = rate * (1.0 - rate) ** (2 * limit)
        self._count = 0
        self._weights = np.zeros(limit, np.float64)
        self._products = np.zeros((limit + 1, limit + 1))  # the last is the new one

    @property
    def weights(self) -> NDArray[np.float32]:
        """Weights of the components, (L,); they sum to 1."""
        return self._weights[: self._count].astype(np.float32)

    @property
    def means(self) -> NDArray[np.complex64]:
        """Means of the components, (K, L, C): L samples of C channels."""
        return self._means[:, : self._count]

    def add(self, sample: NDArray[np.complex64]) -> None:
        """Add a sample, (K, C): coefficients of C channels."""
        if self._count == 0:
            self._means = np.zeros(
                (len(sample), self._limit, sample.shape[1]), np.complex64
            )
            self._place(sample, 0, 1.0)
            return
        self._weights *= 1.0 - self._rate
        self._measure(sample)
        if self._count < self._limit:
            self._place(sample, self._count, self._rate)
        elif self._weights.min() < self._least:
            self._place(sample, int(self._weights.argmin()), self._rate)
            self._weights /= self._weights.sum()
        else:
            self._merge(sample)

    def _measure(self, sample: NDArray[np.complex64]) -> None:
        """Compute the inner products of a new sample with all means and itself."""
        factors = sample.conj() * self._series.weights[:, None]
        products = np.matmul(self.means, factors[..., None])[..., 0].sum(axis=0).real
        self._products[-1, : self._count] = products
        self._products[: self._count, -1] = products
        self._products[-1, -1] = self._series.inner(sample, sample)

    def _place(self, sample: NDArray[np.complex64], index: int, weight: float) -> None:
        """Put a sample that was measured where a component was, or a new one."""
        if self._count == 0:
            self._products[-1, -1] = self._series.inner(sample, sample)
        self._count = max(self._count, index + 1)
        self._means[:, index] = sample
        self._weights[index] = weight
        self._products[index] = self._products[-1]
        self._products[:, index] = self._products[:, -1]
        self._products[index, index] = self._products[-1, -1]

    def _merge(self, sample: NDArray[np.complex64]) -> None:
        """Merge the closest two of all components and the sample."""
        squares = np.diag(self._products)
        distances = squares[:, None] + squares[None, :] - 2.0 * self._products
        np.fill_diagonal(distances, np.inf)
        first, second = sorted(divmod(int(distances.argmin()), len(distances)))
        is_new = second == self._limit
        weight = self._rate if is_new else self._weights[second]
        total = self._weights[first] + weight
        share = weight / total
        other = sample if is_new else self._means[:, second]
        self._means[:, first] += np.float32(share) * (other - self._means[:, first])
        products = self._products
        square = (
            (1.0 - share) ** 2 * products[first, first]
            + share**2 * products[second, second]
            + 2.0 * share * (1.0 - share) * products[first, second]
        )
        products[first] += share * (products[second] - products[first])
        products[:, first] = products[first]
        products[first, first] = square
        self._weights[first] = total
        if not is_new:
            self._place(sample, second, self._rate)
