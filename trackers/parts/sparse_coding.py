"""Sparse coding of patches by templates and single pixels, by accelerated gradients."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["SparseCode", "sparse_code"]


@dataclass(frozen=True, slots=True)
class SparseCode:
    """Coefficients of M patches.

    Attributes
    ----------
    templates : (M, T) float, of the precision of the patches
        At least 0.
    pixels : (M, D) float
        Of the trivial templates: one for each pixel, of either sign.
    """

    templates: NDArray[np.floating]
    pixels: NDArray[np.floating]


def sparse_code(
    patches: NDArray[np.floating],
    templates: NDArray[np.floating],
    *,
    template_penalty: float,
    pixel_penalty: float,
    pixel_ridge: float,
    iterations: int,
) -> SparseCode:
    """Return the sparse codes of patches, all at once.

    Each minimises ``|y - T a - e|^2 / 2 + template_penalty |a|_1 + pixel_penalty
    |e|_1 + pixel_ridge |e|^2 / 2`` over a >= 0 and e.

    Parameters
    ----------
    patches : (M, D) float
        y, one a row.
    templates : (T, D) float
        The columns of T, one a row here.
    template_penalty, pixel_penalty, pixel_ridge : float
    iterations : int
        Steps; the error falls with their square.

    References
    ----------
    Bao, Wu, Ling, Ji, "Real time robust L1 tracker using accelerated proximal gradient
    approach", CVPR 2012, section 3: the model with the ridge on trivial coefficients,
    and its solution by accelerated proximal gradient.

    Notes
    -----
    The step is the inverse of the exact Lipschitz constant of the smooth part, the
    largest eigenvalue of ``[T I]^T [T I]`` plus the ridge; the authors' code has a
    fixed 8. The identity is never formed.
    """
    gram = templates @ templates.T
    largest = float(np.linalg.eigvalsh(gram)[-1]) if len(gram) else 0.0
    step = 1.0 / (largest + 1.0 + pixel_ridge)
    dtype = patches.dtype
    a = last_a = np.zeros((len(patches), len(templates)), dtype)
    e = last_e = np.zeros(patches.shape, dtype)
    pace = last_pace = 1.0
    for _ in range(iterations):
        ahead = (last_pace - 1.0) / pace
        at_a, at_e = a + ahead * (a - last_a), e + ahead * (e - last_e)
        misfit = at_a @ templates + at_e - patches
        last_a, last_e = a, e
        a = at_a - step * (misfit @ templates.T + template_penalty)
        a = np.maximum(a, 0.0)
        e = at_e - step * (misfit + pixel_ridge * at_e)
        e = e - np.clip(e, -step * pixel_penalty, step * pixel_penalty)
        last_pace, pace = pace, (1.0 + math.sqrt(1.0 + 4.0 * pace * pace)) / 2.0
    return SparseCode(a, e)
