"""The affine group of the plane and its Lie algebra, for arrays of elements.

A group element is the upper two rows ``[B | t]`` of the 3 x 3 matrix that acts on
homogeneous points, ``p -> B p + t`` with det B > 0. An algebra element is given by its
six coordinates in the basis ``E1`` uniform scale, ``E2`` aspect, ``E3`` rotation,
``E4`` shear, ``E5`` and ``E6`` translation in x and y:

==== ================= ==== ================ ==== =================
E1   [[1, 0], [0, 1]]  E2   [[1, 0], [0, -1]] E3   [[0, -1], [1, 0]]
E4   [[0, 1], [1, 0]]  E5   t = (1, 0)        E6   t = (0, 1)
==== ================= ==== ================ ==== =================

References
----------
Jati, Gunawan et al., "Dynamic swarm particle for fast motion vehicle tracking", ETRI
Journal 2020 (DSP), section 3; Kwon and Park, "Visual tracking via particle filtering
on the affine group", Int. J. Robotics Research 29 (2010), for the basis.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["compose", "exp", "inverse", "log", "log_between", "moved"]


def compose(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the products ``first second``, which act as second, then first.

    Parameters
    ----------
    first, second : (..., 2, 3) float
        Group elements; shapes must broadcast.

    Returns
    -------
    (..., 2, 3) float
    """
    product = first[..., :2] @ second
    product[..., 2] += first[..., 2]
    return product


def inverse(elements: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverses of group elements, (..., 2, 3)."""
    a, b = elements[..., 0, 0], elements[..., 0, 1]
    c, d = elements[..., 1, 0], elements[..., 1, 1]
    x, y = elements[..., 0, 2], elements[..., 1, 2]
    determinant = a * d - b * c
    result = np.empty_like(elements)
    result[..., 0, 0], result[..., 0, 1] = d / determinant, -b / determinant
    result[..., 1, 0], result[..., 1, 1] = -c / determinant, a / determinant
    result[..., 0, 2] = (b * y - d * x) / determinant
    result[..., 1, 2] = (c * x - a * y) / determinant
    return result


def exp(velocities: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the group elements of algebra elements.

    Parameters
    ----------
    velocities : (..., 6) float
        Coordinates in E1 to E6.

    Returns
    -------
    (..., 2, 3) float

    Notes
    -----
    The linear part is ``m I + C`` with C traceless, so that ``C^2 = delta I`` and
    ``exp = e^m (cosh r I + sinh r / r C)``, r = sqrt(delta); cos and sin where delta
    is negative. The translation is ``V t`` with ``V = (integral of exp(s M) over s
    in [0, 1])``, summed as a power series.
    """
    flat = np.ascontiguousarray(velocities, np.float64).reshape(-1, 6)
    result: NDArray[np.float64] = _exp(flat)
    return result.reshape(*velocities.shape[:-1], 2, 3)


def log(elements: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the algebra elements of group elements, the inverse of `exp`.

    Parameters
    ----------
    elements : (..., 2, 3) float
        Group elements.

    Returns
    -------
    (..., 6) float
        Coordinates in E1 to E6; NaN where there is no real logarithm (the linear part
        has a negative or zero eigenvalue, as a mirror image or a half turn).
    """
    flat = np.ascontiguousarray(elements, np.float64).reshape(-1, 2, 3)
    result: NDArray[np.float64] = _log(flat)
    return result.reshape(*elements.shape[:-2], 6)


def log_between(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``log(first^-1 second)``, (N, 6), 0 where there is no real logarithm.

    Parameters
    ----------
    first, second : (N, 2, 3) float
        Group elements; of one of them N may be 1.
    """
    result: NDArray[np.float64] = _log_between(first, second)
    return result


def moved(
    elements: NDArray[np.float64], velocities: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``elements exp(velocities)`` for (N, 2, 3) and (N, 6) arrays."""
    result: NDArray[np.float64] = _moved(elements, velocities)
    return result


@numba.njit(cache=True)
def _even_odd(delta):  # type: ignore[no-untyped-def]  # numba infers the types
    """Return cosh(r) and sinh(r) / r for r = sqrt(delta), delta of either sign."""
    if abs(delta) < 1e-8:  # power series: the quotient would lose digits
        return 1.0 + delta / 2.0, 1.0 + delta / 6.0
    if delta > 0.0:
        r = math.sqrt(delta)
        return math.cosh(r), math.sinh(r) / r
    r = math.sqrt(-delta)
    return math.cos(r), math.sin(r) / r


@numba.njit(cache=True)
def _average_flow(m, a, b, c):  # type: ignore[no-untyped-def]  # numba infers
    """Return V = sum over k of M^k / (k + 1)! for M = [[m + a, b], [c, m - a]].

    M is halved until it is small, and V then restored by repeated doubling,
    ``V(2 M) = (exp(M) + I) V(M) / 2``.
    """
    norm = abs(m) + abs(a) + abs(b) + abs(c)
    halvings = 0
    while 0.5 < norm < math.inf:
        norm /= 2.0
        halvings += 1
    factor = 0.5**halvings
    p, q, r, s = (m + a) * factor, b * factor, c * factor, (m - a) * factor
    v0, v1, v2, v3 = 1.0, 0.0, 0.0, 1.0
    for k in range(14, 1, -1):  # Horner scheme; 0.5^14 / 15! is far below round-off
        v0, v1, v2, v3 = (
            1.0 + (p * v0 + q * v2) / k,
            (p * v1 + q * v3) / k,
            (r * v0 + s * v2) / k,
            1.0 + (r * v1 + s * v3) / k,
        )
    for _ in range(halvings):
        # exp(M) + I = M V + 2 I
        e0, e1 = p * v0 + q * v2 + 2.0, p * v1 + q * v3
        e2, e3 = r * v0 + s * v2, r * v1 + s * v3 + 2.0
        v0, v1, v2, v3 = (
            (e0 * v0 + e1 * v2) / 2.0,
            (e0 * v1 + e1 * v3) / 2.0,
            (e2 * v0 + e3 * v2) / 2.0,
            (e2 * v1 + e3 * v3) / 2.0,
        )
        p, q, r, s = 2.0 * p, 2.0 * q, 2.0 * r, 2.0 * s
    return v0, v1, v2, v3


@numba.njit(cache=True)
def _exp(velocities):  # type: ignore[no-untyped-def]  # numba infers the types
    result = np.empty((velocities.shape[0], 2, 3))
    for n in range(velocities.shape[0]):
        m, a, turn, shear, x, y = velocities[n]
        b, c = shear - turn, shear + turn
        even, odd = _even_odd(a * a + b * c)
        growth = math.exp(m)
        result[n, 0, 0], result[n, 0, 1] = growth * (even + odd * a), growth * odd * b
        result[n, 1, 0], result[n, 1, 1] = growth * odd * c, growth * (even - odd * a)
        v0, v1, v2, v3 = _average_flow(m, a, b, c)
        result[n, 0, 2], result[n, 1, 2] = v0 * x + v1 * y, v2 * x + v3 * y
    return result


@numba.njit(cache=True)
def _log(elements):  # type: ignore[no-untyped-def]  # numba infers the types
    result = np.empty((elements.shape[0], 6))
    for n in range(elements.shape[0]):
        p, q, x = elements[n, 0]
        r, s, y = elements[n, 1]
        determinant = p * s - q * r
        growth = math.sqrt(max(determinant, 0.0))
        even = (p + s) / (2.0 * growth) if growth > 0.0 else -1.0
        if even <= -1.0:
            result[n] = np.nan
            continue
        a, b, c = (p - s) / (2.0 * growth), q / growth, r / growth
        delta = a * a + b * c  # sinh^2 r, or -sin^2 r; precise near 1
        if delta > 1e-8:
            odd = math.asinh(math.sqrt(delta)) / math.sqrt(delta)
        elif delta < -1e-8:
            sine = math.sqrt(-delta)
            odd = math.atan2(sine, even) / sine
        else:
            odd = 1.0 - delta / 6.0
        m, a, b, c = math.log(growth), a * odd, b * odd, c * odd
        v0, v1, v2, v3 = _average_flow(m, a, b, c)
        scale = v0 * v3 - v1 * v2
        result[n, 0], result[n, 1] = m, a
        result[n, 2], result[n, 3] = (c - b) / 2.0, (b + c) / 2.0
        result[n, 4] = (v3 * x - v1 * y) / scale
        result[n, 5] = (v0 * y - v2 * x) / scale
    return result


@numba.njit(cache=True)
def _log_between(first, second):  # type: ignore[no-untyped-def]  # numba infers
    count = max(first.shape[0], second.shape[0])
    products = np.empty((count, 2, 3))
    for n in range(count):
        one, two = first[n % first.shape[0]], second[n % second.shape[0]]
        a, b, c, d = one[0, 0], one[0, 1], one[1, 0], one[1, 1]
        determinant = a * d - b * c
        for k in range(3):
            x, y = two[0, k], two[1, k]
            if k == 2:
                x, y = x - one[0, 2], y - one[1, 2]
            products[n, 0, k] = (d * x - b * y) / determinant
            products[n, 1, k] = (a * y - c * x) / determinant
    result = _log(products)
    for n in range(count):
        if np.isnan(result[n, 0]):
            result[n] = 0.0
    return result


@numba.njit(cache=True)
def _moved(elements, velocities):  # type: ignore[no-untyped-def]  # numba infers
    result = _exp(velocities)
    for n in range(elements.shape[0]):
        a, b, c, d = (
            elements[n, 0, 0],
            elements[n, 0, 1],
            elements[n, 1, 0],
            elements[n, 1, 1],
        )
        for k in range(3):
            x, y = result[n, 0, k], result[n, 1, k]
            result[n, 0, k] = a * x + b * y
            result[n, 1, k] = c * x + d * y
        result[n, 0, 2] += elements[n, 0, 2]
        result[n, 1, 2] += elements[n, 1, 2]
    return result
