"""Factorised convolution: fewer channels and their filters, learnt together (ECO)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.conjugate_gradient import (
    LinearProblem,
    Vector,
    conjugate_gradient,
)
from simbench.trackers.parts.continuous_filter import FilterLoss, inverse_diagonal

__all__ = ["FactorisedFilter", "principal_axes"]

PENALTY: Final = 2e-7
"""Lambda of equation 7, on the squares of the projection."""


@dataclass(frozen=True)
class FactorisedFilter:
    """Projections of feature maps to fewer channels, and filters of these.

    Attributes
    ----------
    projections : sequence of (D, C) float32
        One for each kind of feature, D channels to C.
    filters : (K, sum of C) complex64
        Coefficients.

    References
    ----------
    Danelljan, Bhat, Khan, Felsberg, "ECO: Efficient convolution operators for
    tracking", CVPR 2017, section 3.1.
    """

    projections: Sequence[NDArray[np.float32]]
    filters: NDArray[np.complex64]

    def projected(
        self, sample: Sequence[NDArray[np.complex64]]
    ) -> NDArray[np.complex64]:
        """Return feature maps (K, D), projected, (K, sum of C) (equation 6)."""
        pairs = zip(sample, self.projections, strict=True)
        return np.concatenate([maps @ each for maps, each in pairs], axis=1)

    def loss(self, sample: Sequence[NDArray[np.complex64]], loss: FilterLoss) -> float:
        """Return the loss of a sample, its feature maps (K, D) (equation 7)."""
        score = np.einsum("kc,kc->k", self.projected(sample), self.filters)
        error = (score - loss.label)[:, None]
        inner = loss.series.inner
        squares = sum(float((each**2).sum()) for each in self.projections)
        penalty = inner(self.filters, loss.penalty(self.filters))
        return inner(error, error) + penalty + PENALTY * squares

    def improved(
        self,
        sample: Sequence[NDArray[np.complex64]],
        loss: FilterLoss,
        steps: int,
        iterations: int,
    ) -> FactorisedFilter:
        """Return filters and projections that suit a sample, by Gauss-Newton steps.

        Parameters
        ----------
        sample : sequence of (K, D) complex64
            Feature maps.
        loss : FilterLoss
        steps : int
            Gauss-Newton steps. Where the filters are 0 the score does not depend on
            the projections, so that the first step finds filters only.
        iterations : int
            Of conjugate gradient in each step.

        Notes
        -----
        A step that raises the loss, as a truncated one may, is not made. The paper has
        no such check.
        """
        best, value = self, self.loss(sample, loss)
        for _ in range(steps):
            problem = _Linearised(best, sample, loss).problem()
            still = [np.zeros_like(each) for each in best.projections]
            start: Vector = [best.filters, *still]
            (filters, *changes), _ = conjugate_gradient(problem, start, iterations)
            projections = [
                (one + change).astype(np.float32)
                for one, change in zip(best.projections, changes, strict=True)
            ]
            found = FactorisedFilter(projections, filters.astype(np.complex64))
            found_value = found.loss(sample, loss)
            if not found_value < value:
                break
            best, value = found, found_value
        return best


def principal_axes(cells: NDArray[np.float32], channels: int) -> NDArray[np.float32]:
    """Return the directions of most variance, (D, channels), to start with.

    Parameters
    ----------
    cells : (..., D) float32
        A feature map.
    channels : int
        At most D.
    """
    flat = cells.reshape(-1, cells.shape[-1]).astype(np.float64)
    flat = flat - flat.mean(axis=0)
    _, vectors = np.linalg.eigh(flat.T @ flat)
    axes = vectors[:, ::-1][:, :channels]
    signs = np.where(axes.sum(axis=0) < 0.0, -1.0, 1.0)
    return np.asarray(axes * signs, np.float32)


class _Linearised:
    """A Gauss-Newton step: the score is linear in filters and changes of projections.

    Vectors are the new filters (K, C), and the change (D, C) of each projection.

    Parameters
    ----------
    now : FactorisedFilter
        What the score is linearised at.
    sample : sequence of (K, D) complex64
    loss : FilterLoss

    References
    ----------
    ECO, equations 8 and 9, and its supplement for their normal equations.
    """

    def __init__(
        self,
        now: FactorisedFilter,
        sample: Sequence[NDArray[np.complex64]],
        loss: FilterLoss,
    ) -> None:
        self._now, self._sample, self._loss = now, sample, loss
        self._low = now.projected(sample)
        bounds = np.cumsum([each.shape[1] for each in now.projections])[:-1]
        self._parts = np.split(now.filters, bounds, axis=1)
        self._weights = loss.series.weights

    def problem(self) -> LinearProblem:
        """Return the normal equations of equation 9."""
        right: list[NDArray[Any]] = self._transposed(self._loss.label)
        for number, each in enumerate(self._now.projections, 1):
            # With filters of 0 only the penalty is left of a projection's equations.
            pull = PENALTY * each
            right[number] = (
                right[number] - pull if self._now.filters.any() else 0 * pull
            )
        inverses: list[NDArray[Any]] = [
            inverse_diagonal(np.abs(self._low) ** 2, self._loss.penalty)
        ]
        for maps, part in zip(self._sample, self._parts, strict=True):
            energy = (np.abs(maps) ** 2 * self._weights[:, None]).T
            inverses.append(1.0 / (energy @ np.abs(part) ** 2 + PENALTY))

        def precondition(vector: Vector) -> Vector:
            return [one * other for one, other in zip(vector, inverses, strict=True)]

        return LinearProblem(self._apply, right, self._inner, precondition)

    def _score(self, vector: Vector) -> NDArray[Any]:
        """Return the linearised score, (K,)."""
        filters, *changes = vector
        total = np.einsum("kc,kc->k", self._low, filters)
        for maps, part, change in zip(self._sample, self._parts, changes, strict=True):
            total = total + np.einsum("kc,kc->k", maps @ change, part)
        return np.asarray(total)

    def _transposed(self, error: NDArray[Any]) -> list[NDArray[Any]]:
        """Return the adjoint of `_score`, of an error (K,)."""
        found: list[NDArray[Any]] = [self._low.conj() * error[:, None]]
        for maps, part in zip(self._sample, self._parts, strict=True):
            factor = part.conj() * (error * self._weights)[:, None]
            found.append((maps.conj().T @ factor).real)
        return found

    def _apply(self, vector: Vector) -> Vector:
        filters, *changes = vector
        first, *others = self._transposed(self._score(vector))
        pairs = zip(others, changes, strict=True)
        penalty = self._loss.penalty(filters)
        return [first + penalty, *(one + PENALTY * other for one, other in pairs)]

    def _inner(self, first: Vector, second: Vector) -> float:
        total = self._loss.series.inner(first[0], second[0])
        for one, other in zip(first[1:], second[1:], strict=True):
            total += float((one * other).sum())
        return total
