"""Preconditioned conjugate gradient, which can go on from an earlier problem."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

__all__ = ["Direction", "LinearProblem", "Vector", "conjugate_gradient"]

Vector = Sequence[NDArray[Any]]
"""Several arrays that are one vector."""


@dataclass(frozen=True)
class LinearProblem:
    """Equations ``apply(x) = right`` with a symmetric positive definite matrix.

    Attributes
    ----------
    apply : function from Vector to Vector
        Product of the matrix with a vector.
    right : Vector
    inner : function from two Vectors to float
        Inner product for which the matrix is symmetric.
    precondition : function from Vector to Vector
        Product with an approximate inverse.
    """

    apply: Callable[[Vector], Vector]
    right: Vector
    inner: Callable[[Vector, Vector], float]
    precondition: Callable[[Vector], Vector]


@dataclass(frozen=True)
class Direction:
    """The last step: its direction, the residual before it, and that one's size."""

    direction: Vector
    residual: Vector
    size: float


def conjugate_gradient(
    problem: LinearProblem,
    start: Vector,
    iterations: int,
    last: Direction | None = None,
) -> tuple[Vector, Direction | None]:
    """Return a solution after some iterations, and the last direction.

    Parameters
    ----------
    problem : LinearProblem
    start : Vector
    iterations : int
    last : Direction, optional
        Of an earlier, similar problem: the first direction is conjugated with it, as
        momentum.

    References
    ----------
    Shewchuk, "An introduction to the conjugate gradient method without the agonizing
    pain", 1994, algorithms B3 and B5: with the formula of Polak and Ribiere, as in
    the code of ECO's authors. Steps go to the minimum along their direction,
    which momentum leaves as it is.
    """
    solution = start
    residual = _plus(problem.right, -1.0, problem.apply(start))
    for _ in range(iterations):
        steepest = problem.precondition(residual)
        size = problem.inner(residual, steepest)
        if not size > 0.0:
            break
        direction = steepest
        if last is not None:
            change = size - problem.inner(last.residual, steepest)
            direction = _plus(steepest, max(change / last.size, 0.0), last.direction)
        product = problem.apply(direction)
        curvature = problem.inner(direction, product)
        if not curvature > 0.0:
            break
        step = problem.inner(direction, residual) / curvature
        last = Direction(direction, residual, size)
        solution = _plus(solution, step, direction)
        residual = _plus(residual, -step, product)
    return solution, last


def _plus(first: Vector, factor: float, second: Vector) -> Vector:
    """Return ``first + factor * second``."""
    return [one + factor * other for one, other in zip(first, second, strict=True)]
