"""Continuous convolution filters, learnt from weighed samples, for ECO."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.conjugate_gradient import (
    Direction,
    LinearProblem,
    Vector,
    conjugate_gradient,
)
from simbench.trackers.parts.fourier_series import FourierSeries
from simbench.trackers.parts.spatial_penalty import SpatialPenalty

__all__ = ["ContinuousFilter", "FilterLoss", "inverse_diagonal"]

PENALTY_SHARE: Final = 0.02
"""Of the penalty in the preconditioner, of the authors' code."""
MEAN_SHARE: Final = 0.3
"""Of the mean over channels in the preconditioner's energy, likewise."""


@dataclass(frozen=True)
class FilterLoss:
    """What filters are learnt for.

    Attributes
    ----------
    series : FourierSeries
        In which filters, samples and label are written.
    label : (K,) complex64
        Wanted score.
    penalty : SpatialPenalty
        On the filters.
    """

    series: FourierSeries
    label: NDArray[np.complex64]
    penalty: SpatialPenalty


class ContinuousFilter:
    """Filters of C channels, whose convolutions with a sample add up to its score.

    Parameters
    ----------
    loss : FilterLoss
    filters : (K, C) complex64
        Coefficients to start with.
    forgetting : float, in [0, 1]
        Trust in the last direction when learning goes on with other samples: 0 is none.

    References
    ----------
    Danelljan et al., "Beyond correlation filters", ECCV 2016 (C-COT), section
    3.2; Danelljan et al., "ECO", CVPR 2017, equations 2 to 5, section 3.2 for means
    in place of samples, section 3.3 for when to learn.
    """

    def __init__(
        self, loss: FilterLoss, filters: NDArray[np.complex64], forgetting: float
    ) -> None:
        self.filters = filters
        self._loss = loss
        self._forgetting = forgetting
        self._last: Direction | None = None

    def scores(self, samples: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """Return the scores, (K, S), of samples (S, K, C) (ECO, equation 2)."""
        return np.asarray(np.einsum("skc,kc->ks", samples, self.filters))

    def learn(
        self,
        samples: NDArray[np.complex64],
        weights: NDArray[np.float32],
        iterations: int,
    ) -> None:
        """Improve the filters for weighed samples by conjugate gradient.

        Parameters
        ----------
        samples : (K, L, C) complex64
        weights : (L,) float32
            Sum to 1.
        iterations : int
        """
        last = self._last
        if last is not None and self._forgetting > 0.0:
            last = replace(last, size=last.size / self._forgetting)
        problem = self._problem(samples, weights)
        usable = last if self._forgetting > 0.0 else None
        found, self._last = conjugate_gradient(
            problem, [self.filters], iterations, usable
        )
        self.filters = found[0].astype(np.complex64)

    def _problem(
        self, samples: NDArray[np.complex64], weights: NDArray[np.float32]
    ) -> LinearProblem:
        """Return the normal equations (ECO, equation 5)."""
        loss = self._loss
        by_channel = samples.transpose(0, 2, 1)

        def apply(vector: Vector) -> Vector:
            (filters,) = vector
            scores = np.matmul(samples, filters[..., None]) * weights[:, None]
            data = np.matmul(by_channel, scores.conj())[..., 0].conj()
            return [data + loss.penalty(filters)]

        def inner(first: Vector, second: Vector) -> float:
            return loss.series.inner(first[0], second[0])

        mean = np.matmul(by_channel, weights.astype(np.complex64)[:, None])[..., 0]
        right = mean.conj() * loss.label[:, None]
        inverse = inverse_diagonal(_energy(samples, weights), loss.penalty)
        return LinearProblem(
            apply, [right], inner, lambda vector: [vector[0] * inverse]
        )


def inverse_diagonal(
    energy: NDArray[np.float32], penalty: SpatialPenalty
) -> NDArray[np.float32]:
    """Return the preconditioner of filters, (K, C).

    Parameters
    ----------
    energy : (K, C) float32
        Squares of the samples' coefficients, weighed.
    penalty : SpatialPenalty

    References
    ----------
    C-COT takes the diagonal of the normal equations. The authors' code of ECO
    blends it with its mean over channels and gives the penalty less weight, as here.
    """
    mean = energy.mean(axis=1, keepdims=True)
    data = (1.0 - MEAN_SHARE) * energy + MEAN_SHARE * mean
    diagonal = (1.0 - PENALTY_SHARE) * data + PENALTY_SHARE * penalty.energy
    return np.asarray(1.0 / diagonal, np.float32)


def _energy(
    samples: NDArray[np.complex64], weights: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the weighed squares, (K, C), of samples' coefficients (K, L, C)."""
    parts = samples.view(np.float32)  # real and imaginary in turn
    squares = np.matmul(weights, parts * parts)
    return np.asarray(squares[:, ::2] + squares[:, 1::2])
