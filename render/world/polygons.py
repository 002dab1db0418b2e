"""Geometry of polylines and polygons: offsets, dashes, points, triangles."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["arc_lengths", "dashes", "offset", "resample", "triangulate"]

_MITRE_LIMIT = 0.35  # cosine of half the sharpest turn that keeps its full distance


def arc_lengths(shape: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of each point of a polyline from its start, (N,) m."""
    steps = np.linalg.norm(np.diff(shape, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def offset(shape: NDArray[np.float64], aside_m: float) -> NDArray[np.float64]:
    """Return a polyline parallel to another, with mitred corners.

    Parameters
    ----------
    shape : (N, 3) float, m
        N at least 2, no two neighbours equal.
    aside_m : float, m
        To the left in the plane; negative to the right.

    Returns
    -------
    (N, 3) float, m
    """
    step = np.diff(shape[:, :2], axis=0)
    normal = np.stack([-step[:, 1], step[:, 0]], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    before = np.concatenate([normal[:1], normal])
    after = np.concatenate([normal, normal[-1:]])
    mean = before + after
    size = np.linalg.norm(mean, axis=-1, keepdims=True)
    mean = np.where(size > 1e-9, mean / np.maximum(size, 1e-9), after)
    reach = np.maximum(np.sum(mean * after, axis=-1, keepdims=True), _MITRE_LIMIT)
    moved = shape.copy()
    moved[:, :2] += aside_m * mean / reach
    return moved


def dashes(
    shape: NDArray[np.float64], dash_m: float, gap_m: float
) -> list[NDArray[np.float64]]:
    """Cut a polyline into dashes.

    Returns
    -------
    list of (K, 3) float, m
        Polylines of ``dash_m`` each, ``gap_m`` apart; corners inside a dash are kept.
    """
    arc = arc_lengths(shape)
    parts = []
    for start in np.arange(gap_m / 2.0, arc[-1] - dash_m, dash_m + gap_m):
        end = start + dash_m
        at = np.concatenate([[start], arc[(arc > start) & (arc < end)], [end]])
        parts.append(_points_at(at, arc, shape))
    return parts


def resample(shape: NDArray[np.float64], every_m: float = 4.0) -> NDArray[np.float64]:
    """Return (K, 3) points along a polyline, at most ``every_m`` apart."""
    arc = arc_lengths(shape)
    at = np.linspace(0.0, arc[-1], max(2, math.ceil(arc[-1] / every_m) + 1))
    return _points_at(at, arc, shape)


def _points_at(
    at: NDArray[np.float64], arc: NDArray[np.float64], shape: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.stack([np.interp(at, arc, shape[:, axis]) for axis in range(3)], axis=1)


def triangulate(outline: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangulate a simple polygon by ear clipping.

    Parameters
    ----------
    outline : (N, 3) float, m
        In either order, not closed; heights are kept.

    Returns
    -------
    (F, 3, 3) float, m
        Counter-clockwise seen from above. Of a self-intersecting outline, the
        triangles found until no ear is left.
    """
    points = outline[np.linalg.norm(outline - np.roll(outline, 1, 0), axis=1) > 1e-6]
    x, y = points[:, 0], points[:, 1]
    area = float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    ring = points if area > 0 else points[::-1]
    triangles = []
    while len(ring) >= 3:
        ears = _ears(ring)
        if not len(ears):
            break
        ear = int(ears[0])
        triangles.append(ring[[ear - 1, ear, (ear + 1) % len(ring)]])
        ring = np.delete(ring, ear, axis=0)
    return np.array(triangles).reshape(-1, 3, 3)


def _ears(ring: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the convex corners whose triangles contain no other corner."""
    b = ring[:, :2]
    a, c = np.roll(b, 1, axis=0), np.roll(b, -1, axis=0)
    inside = np.ones((len(ring), len(ring)), dtype=np.bool_)
    for start, end in ((a, b), (b, c), (c, a)):
        edge = (end - start)[:, None]
        to = b[None] - start[:, None]
        inside &= edge[..., 0] * to[..., 1] - edge[..., 1] * to[..., 0] > 1e-12
    is_convex = (b - a)[:, 0] * (c - b)[:, 1] - (b - a)[:, 1] * (c - b)[:, 0] > 0.0
    return np.flatnonzero(is_convex & ~inside.any(axis=1))
