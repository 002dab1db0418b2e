"""Conjugate gradient against dense solutions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.conjugate_gradient import (
    LinearProblem,
    Vector,
    conjugate_gradient,
)


def dense(
    size: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a positive definite matrix of uneven scales, and a right side."""
    root = rng.standard_normal((size, size)) * np.geomspace(1.0, 30.0, size)
    return root.T @ root + np.eye(size), rng.standard_normal(size)


def problem(
    matrix: NDArray[np.float64], right: NDArray[np.float64], split: int
) -> LinearProblem:
    """Return the equations, their vectors split in two arrays."""
    diagonal = np.diag(matrix)

    def parts(vector: NDArray[np.float64]) -> Vector:
        return [vector[:split], vector[split:]]

    def inner(first: Vector, second: Vector) -> float:
        return float(np.concatenate(first) @ np.concatenate(second))

    return LinearProblem(
        lambda vector: parts(matrix @ np.concatenate(vector)),
        parts(right),
        inner,
        lambda vector: parts(np.concatenate(vector) / diagonal),
    )


def test_as_many_iterations_as_unknowns_solve_exactly(rng: np.random.Generator) -> None:
    matrix, right = dense(8, rng)
    start: Vector = [np.ones(3), np.zeros(5)]
    found, _ = conjugate_gradient(problem(matrix, right, 3), start, 9)
    assert np.concatenate(found) == pytest.approx(
        np.linalg.solve(matrix, right), rel=1e-5, abs=1e-8
    )


def test_preconditioner_brings_few_iterations_closer(rng: np.random.Generator) -> None:
    matrix, right = dense(12, rng)
    one = problem(matrix, right, 4)
    plain = LinearProblem(one.apply, one.right, one.inner, lambda vector: vector)
    exact = np.linalg.solve(matrix, right)

    def distance(each: LinearProblem) -> float:
        found, _ = conjugate_gradient(each, [np.zeros(4), np.zeros(8)], 4)
        error = np.concatenate(found) - exact
        return float(error @ matrix @ error)

    assert distance(one) < 0.5 * distance(plain)


def test_going_on_from_the_last_direction_equals_one_longer_run(
    rng: np.random.Generator,
) -> None:
    one = problem(*dense(12, rng), 4)
    start: Vector = [np.zeros(4), np.zeros(8)]
    whole, _ = conjugate_gradient(one, start, 6)
    half, last = conjugate_gradient(one, start, 3)
    rest, _ = conjugate_gradient(one, half, 3, last)
    anew, _ = conjugate_gradient(one, half, 3)
    assert np.concatenate(rest) == pytest.approx(np.concatenate(whole), rel=1e-6)
    assert np.concatenate(anew) != pytest.approx(np.concatenate(whole), rel=1e-3)
