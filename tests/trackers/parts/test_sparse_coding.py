"""Sparse codes by accelerated gradients against optimality and a slow solver."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from simbench.trackers.parts.sparse_coding import SparseCode, sparse_code

PENALTIES = {"template_penalty": 0.02, "pixel_penalty": 0.01}


def problem() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return three patches and four templates, of norm 1."""
    rng = np.random.default_rng(6)
    templates = rng.standard_normal((4, 12))
    templates /= np.linalg.norm(templates, axis=1, keepdims=True)
    patches = 0.7 * templates[:3] + 0.3 * templates[1:] + 0.1 * rng.normal(size=(3, 12))
    patches[:, 4] += 0.8  # one pixel that no template has
    patches[2] *= -1.0  # a negative of templates, which they must not code
    return patches / np.linalg.norm(patches, axis=1, keepdims=True), templates


def coded(ridge: float, iterations: int) -> SparseCode:
    patches, templates = problem()
    return sparse_code(
        patches, templates, **PENALTIES, pixel_ridge=ridge, iterations=iterations
    )


@pytest.mark.parametrize("ridge", [0.0, 1.0])
def test_code_satisfies_the_conditions_of_the_optimum(ridge: float) -> None:
    patches, templates = problem()
    code = coded(ridge, 3000)
    misfit = code.templates @ templates + code.pixels - patches
    slope = misfit @ templates.T + PENALTIES["template_penalty"]
    assert code.templates.min() >= 0.0
    assert slope.min() > -1e-6  # no template would lower the cost
    np.testing.assert_allclose(code.templates * slope, 0.0, atol=1e-6)
    slope = misfit + ridge * code.pixels
    used = code.pixels != 0.0
    expected = -PENALTIES["pixel_penalty"] * np.sign(code.pixels[used])
    np.testing.assert_allclose(slope[used], expected, atol=1e-6)
    assert np.abs(slope[~used]).max() <= PENALTIES["pixel_penalty"] + 1e-6
    assert used.any() and not used.all()


@pytest.mark.parametrize("ridge", [0.0, 1.0])
def test_code_equals_that_of_a_slow_solver(ridge: float) -> None:
    patches, templates = problem()
    code = coded(ridge, 3000)
    count, size = templates.shape
    penalties = np.concatenate(
        [np.full(count, PENALTIES["template_penalty"])]
        + 2 * [np.full(size, PENALTIES["pixel_penalty"])]
    )

    def cost(
        x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.float64]]:
        a, pixels = x[:count], x[count : count + size] - x[count + size :]
        misfit = a @ templates + pixels - y
        value = float(misfit @ misfit) / 2 + ridge * pixels @ pixels / 2 + penalties @ x
        along = misfit + ridge * pixels
        return float(value), np.concatenate(
            [templates @ misfit, along, -along]
        ) + penalties

    for patch, a, e in zip(patches, code.templates, code.pixels, strict=True):
        start = np.zeros(count + 2 * size)
        slow = minimize(
            cost,
            start,
            args=(patch,),
            jac=True,
            method="L-BFGS-B",
            bounds=[(0.0, None)] * len(start),
            options={"maxiter": 5000, "ftol": 1e-15, "gtol": 1e-10},
        )
        ours = np.concatenate([a, np.maximum(e, 0.0), np.maximum(-e, 0.0)])
        assert cost(ours, patch)[0] <= slow.fun + 1e-8
        np.testing.assert_allclose(a, slow.x[:count], atol=1e-3)


def test_few_steps_are_near_the_optimum() -> None:
    near, optimum = coded(1.0, 10), coded(1.0, 3000)
    np.testing.assert_allclose(near.templates, optimum.templates, atol=0.05)


def test_negative_of_a_template_is_not_coded_by_it() -> None:
    code = coded(1.0, 3000)
    assert code.templates[0, 0] > 0.2
    assert code.templates[2, 2] == 0.0
