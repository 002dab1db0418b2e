"""Triangle meshes with position, normal, colour and id per corner; simple solids.

Axes of a solid in its own frame: x forward, y to the left, z up, metres.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Colour",
    "Mesh",
    "Surface",
    "box",
    "cross_product",
    "cylinder",
    "extrusion",
    "merge",
    "quad_strip",
    "quads",
    "shaded",
    "triangle_mesh",
    "wall_strip",
]

Colour = tuple[float, float, float]
"""sRGB, in [0, 1]."""


class Surface(IntEnum):
    """Material of a surface; the numbers are those of ``scene.frag``."""

    MATTE = 0
    ASPHALT = 1
    GRASS = 2
    PAINT = 3
    GLASS = 4
    LAMP = 5
    FOLIAGE = 6
    LEAF = 7


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles that share no vertices.

    Attributes
    ----------
    positions : (3 F, 3) float32, m
        Corners, three a triangle, counter-clockwise seen from outside.
    normals : (3 F, 3) float32
        Unit vectors.
    colours : (3 F, 4) float32, in [0, 1]
        sRGB; the fourth is 1 where the instance's paint replaces the colour.
    surface : (3 F, 2) float32
        Instance id, 0 for that of the instance, and `Surface`.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    colours: NDArray[np.float32]
    surface: NDArray[np.float32]

    def moved(
        self, offset: ArrayLike, heading: float = 0.0, scale: ArrayLike = 1.0
    ) -> Mesh:
        """Return it scaled, turned about z by ``heading`` [rad], then shifted [m]."""
        cos, sin = math.cos(heading), math.sin(heading)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        size = np.broadcast_to(np.asarray(scale, np.float64), 3)
        points = (self.positions * size) @ turn.T + np.asarray(offset, np.float64)
        normals = (self.normals / size) @ turn.T
        normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
        return self._with(points, normals)

    def tilted(self, angle: float) -> Mesh:
        """Return it turned about x by ``angle`` [rad], from y towards z."""
        cos, sin = math.cos(angle), math.sin(angle)
        turn = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]])
        return self._with(self.positions @ turn.T, self.normals @ turn.T)

    def _with(self, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Mesh:
        positions = points.astype(np.float32)
        return replace(self, positions=positions, normals=normals.astype(np.float32))

    def split(self, *surfaces: Surface) -> tuple[Mesh, Mesh]:
        """Return its triangles of some surfaces, and all others."""
        chosen = np.isin(self.surface[:, 1], surfaces)
        return self.picked(chosen), self.picked(~chosen)

    def picked(self, corners: NDArray[np.bool_]) -> Mesh:
        """Return the triangles of some corners, (3 F,) bool, three a triangle."""
        return Mesh(*(getattr(self, one.name)[corners] for one in fields(Mesh)))

    def with_id(self, number: int) -> Mesh:
        """Return it with an instance id at every corner."""
        surface = self.surface.copy()
        surface[:, 0] = number
        return replace(self, surface=surface)


def cross_product(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the cross products of (..., 3) vectors.

    `numpy.cross` takes ten times as long for the few vectors of a part of a tree.
    """
    x, y, z = first[..., 0], first[..., 1], first[..., 2]
    u, v, w = second[..., 0], second[..., 1], second[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def triangle_mesh(
    triangles: NDArray[np.float64],
    colour: Colour,
    surface: Surface = Surface.MATTE,
    *,
    painted: bool = False,
    normals: NDArray[np.float64] | None = None,
) -> Mesh:
    """Make a mesh of (F, 3, 3) corners [m], flat-shaded unless normals are given."""
    corners = np.asarray(triangles, np.float64).reshape(-1, 3, 3)
    if normals is None:
        sides = corners[:, 1:] - corners[:, :1]
        cross = cross_product(sides[:, 0], sides[:, 1])
        size = np.linalg.norm(cross, axis=-1, keepdims=True)
        normals = np.repeat(cross / np.where(size == 0.0, 1.0, size), 3, axis=0)
    count = len(corners) * 3
    return Mesh(
        corners.reshape(-1, 3).astype(np.float32),
        normals.reshape(-1, 3).astype(np.float32),
        np.full((count, 4), [*colour, float(painted)], np.float32),
        np.full((count, 2), [0.0, float(surface)], np.float32),
    )


def quads(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    d: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Split N quadrilaterals, (..., 3) corners each, into (2 N, 3, 3) triangles."""
    halves = [np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)]
    return np.concatenate(halves).reshape(-1, 3, 3)


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """Put meshes into one; of none, a mesh without triangles."""
    parts = list(meshes)
    if not parts:
        return triangle_mesh(np.zeros((0, 3, 3)), (0.0, 0.0, 0.0))
    return Mesh(
        *(np.concatenate([getattr(m, f.name) for m in parts]) for f in fields(Mesh))
    )


def box(
    low: ArrayLike,
    high: ArrayLike,
    colour: Colour,
    surface: Surface = Surface.MATTE,
    *,
    painted: bool = False,
    taper: float = 0.0,
) -> Mesh:
    """Make a box between two corners [m]; the top is narrower by ``taper`` a side."""
    (x0, y0, z0), (x1, y1, z1) = np.asarray(low), np.asarray(high)
    x, y = np.array([x0, x1, x1, x0], float), np.array([y0, y0, y1, y1], float)
    bottom = np.stack([x, y, np.full(4, z0)], axis=1)
    x, y = x + taper * np.array([1, -1, -1, 1]), y + taper * np.array([1, 1, -1, -1])
    corners = np.concatenate([bottom, np.stack([x, y, np.full(4, z1)], axis=1)])
    faces = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6]]
    faces.append([3, 0, 4, 7])
    triangles = corners[np.array(faces)[:, [0, 1, 2, 0, 2, 3]]]
    return triangle_mesh(triangles, colour, surface, painted=painted)


def cylinder(
    start: ArrayLike,
    end: ArrayLike,
    radius: float,
    colour: Colour,
    surface: Surface = Surface.MATTE,
    *,
    sides: int = 10,
    end_radius: float | None = None,
    capped: bool = True,
) -> Mesh:
    """Make a cylinder, or cone frustum, between two points [m], smooth-shaded.

    Its corners lie on the circle: seen from the side it is between
    ``cos(pi / sides)`` and 1 times as wide as the circle.
    """
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    axis = (b - a) / np.linalg.norm(b - a)
    other = np.array([0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    u = cross_product(other, axis)
    u = u / np.linalg.norm(u)
    v = cross_product(axis, u)
    angle = 2.0 * math.pi * np.arange(sides + 1) / sides
    ring = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    low = a + radius * ring
    high = b + (radius if end_radius is None else end_radius) * ring
    side = quads(low[:-1], low[1:], high[1:], high[:-1])
    smooth = quads(ring[:-1], ring[1:], ring[1:], ring[:-1])
    mantle = triangle_mesh(side, colour, surface, normals=smooth)
    if not capped:
        return mantle
    bottom = np.stack([np.broadcast_to(a, low[1:].shape), low[1:], low[:-1]], axis=1)
    top = np.stack([np.broadcast_to(b, high[1:].shape), high[:-1], high[1:]], axis=1)
    caps = triangle_mesh(np.concatenate([bottom, top]), colour, surface)
    return merge([mantle, caps])


def extrusion(
    profile: ArrayLike,
    low_y: float,
    high_y: float,
    colour: Colour,
    surface: Surface = Surface.MATTE,
    *,
    painted: bool = False,
) -> Mesh:
    """Sweep a convex outline in the x-z plane [m] from ``low_y`` to ``high_y``.

    The outline runs counter-clockwise seen from the right (looking along +y).
    """
    points = np.asarray(profile, np.float64)
    right = np.insert(points, 1, low_y, axis=1)
    left = np.insert(points, 1, high_y, axis=1)
    triangles = []
    for i in range(1, len(points) - 1):
        triangles.append([right[0], right[i], right[i + 1]])
        triangles.append([left[0], left[i + 1], left[i]])
    for i, j in zip(range(len(points)), [*range(1, len(points)), 0], strict=True):
        triangles.append([right[i], left[i], left[j]])
        triangles.append([right[i], left[j], right[j]])
    return triangle_mesh(np.array(triangles), colour, surface, painted=painted)


def quad_strip(
    left: NDArray[np.float64],
    right: NDArray[np.float64],
    colour: Colour,
    surface: Surface = Surface.MATTE,
) -> Mesh:
    """Make a ribbon between two polylines of (N, 3) points [m], facing up."""
    return triangle_mesh(
        quads(left[:-1], right[:-1], right[1:], left[1:]), colour, surface
    )


def wall_strip(
    bottom: NDArray[np.float64], top: NDArray[np.float64], colour: Colour
) -> Mesh:
    """Make a ribbon from one polyline of (N, 3) points [m] up to another."""
    return triangle_mesh(quads(bottom[:-1], bottom[1:], top[1:], top[:-1]), colour)


def shaded(colour: Colour, share: float) -> Colour:
    """Return a colour darker, or with a share above 1 lighter, up to white."""
    red, green, blue = (min(1.0, part * share) for part in colour)
    return red, green, blue
