"""Triangle meshes with what the camera needs at each corner, and simple solids.

Axes of a solid in its own frame: x forward, y to the left, z up, metres.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Colour",
    "Mesh",
    "Surface",
    "box",
    "cylinder",
    "extrusion",
    "merge",
    "quad_strip",
    "shaded",
    "soup",
]

Colour = tuple[float, float, float]
"""sRGB, in [0, 1]."""


class Surface(IntEnum):
    """How a surface takes light; the shader knows the same numbers."""

    MATTE = 0
    ASPHALT = 1
    GRASS = 2
    PAINT = 3
    GLASS = 4
    LAMP = 5
    FOLIAGE = 6


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles, each with corners of its own.

    Attributes
    ----------
    positions : (3 F, 3) float32, m
        Corners, three a triangle, counter-clockwise seen from outside.
    normals : (3 F, 3) float32
        Unit vectors.
    colours : (3 F, 4) float32, in [0, 1]
        sRGB; the fourth is 1 where the vehicle's paint takes the colour's place.
    surface : (3 F, 2) float32
        Instance id (0: the instance's own), and `Surface`.
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
        return Mesh(
            points.astype(np.float32),
            normals.astype(np.float32),
            self.colours,
            self.surface,
        )

    def tilted(self, angle: float) -> Mesh:
        """Return it turned about x by ``angle`` [rad], from y towards z."""
        cos, sin = math.cos(angle), math.sin(angle)
        turn = np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]])
        return Mesh(
            (self.positions @ turn.T).astype(np.float32),
            (self.normals @ turn.T).astype(np.float32),
            self.colours,
            self.surface,
        )

    def with_id(self, number: int) -> Mesh:
        """Return it with an instance id at every corner."""
        surface = self.surface.copy()
        surface[:, 0] = number
        return Mesh(self.positions, self.normals, self.colours, surface)


def soup(
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
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(cross, axis=-1, keepdims=True)
        flat = cross / np.where(size == 0.0, 1.0, size)
        normals = np.repeat(flat, 3, axis=0)
    count = len(corners) * 3
    rgba = np.tile(np.array([*colour, float(painted)], np.float32), (count, 1))
    kind = np.tile(np.array([0.0, float(surface)], np.float32), (count, 1))
    return Mesh(
        corners.reshape(-1, 3).astype(np.float32),
        normals.reshape(-1, 3).astype(np.float32),
        rgba,
        kind,
    )


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """Put meshes into one; of none, a mesh without triangles."""
    parts = list(meshes)
    if not parts:
        return soup(np.zeros((0, 3, 3)), (0.0, 0.0, 0.0))
    return Mesh(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.colours for part in parts]),
        np.concatenate([part.surface for part in parts]),
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
    x0, y0, z0 = np.asarray(low, np.float64)
    x1, y1, z1 = np.asarray(high, np.float64)
    t = taper
    corner = np.array(
        [
            [x0, y0, z0],
            [x1, y0, z0],
            [x1, y1, z0],
            [x0, y1, z0],
            [x0 + t, y0 + t, z1],
            [x1 - t, y0 + t, z1],
            [x1 - t, y1 - t, z1],
            [x0 + t, y1 - t, z1],
        ]
    )
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6)]
    faces.append((3, 0, 4, 7))
    triangles = [
        corner[[a, b, c]] for q in faces for a, b, c in (q[:3], (q[0], q[2], q[3]))
    ]
    return soup(np.array(triangles), colour, surface, painted=painted)


def cylinder(
    start: ArrayLike,
    end: ArrayLike,
    radius: float,
    colour: Colour,
    surface: Surface = Surface.MATTE,
    *,
    sides: int = 10,
    end_radius: float | None = None,
) -> Mesh:
    """Make a capped cylinder, or cone frustum, between two points [m], smooth-shaded.

    Its corners lie on the circle: seen from the side it is between
    ``cos(pi / sides)`` and 1 times as wide as the circle.
    """
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    axis = (b - a) / np.linalg.norm(b - a)
    helper = np.array([0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    u = np.cross(helper, axis)
    u = u / np.linalg.norm(u)
    v = np.cross(axis, u)
    angle = 2.0 * math.pi * np.arange(sides + 1) / sides
    ring = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    low = a + radius * ring
    high = b + (radius if end_radius is None else end_radius) * ring
    side = np.concatenate(
        [
            np.stack([low[:-1], low[1:], high[1:]], axis=1),
            np.stack([low[:-1], high[1:], high[:-1]], axis=1),
        ]
    )
    smooth = np.concatenate(
        [
            np.stack([ring[:-1], ring[1:], ring[1:]], axis=1),
            np.stack([ring[:-1], ring[1:], ring[:-1]], axis=1),
        ]
    )
    bottom = np.stack([np.broadcast_to(a, low[1:].shape), low[1:], low[:-1]], axis=1)
    top = np.stack([np.broadcast_to(b, high[1:].shape), high[:-1], high[1:]], axis=1)
    caps = np.concatenate([bottom, top])
    return merge(
        [soup(side, colour, surface, normals=smooth), soup(caps, colour, surface)]
    )


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
    for i in range(len(points)):
        j = (i + 1) % len(points)
        triangles.append([right[i], left[i], left[j]])
        triangles.append([right[i], left[j], right[j]])
    return soup(np.array(triangles), colour, surface, painted=painted)


def quad_strip(
    left: NDArray[np.float64],
    right: NDArray[np.float64],
    colour: Colour,
    surface: Surface = Surface.MATTE,
) -> Mesh:
    """Make a ribbon between two polylines of (N, 3) points [m], facing up."""
    a, b, c, d = left[:-1], right[:-1], right[1:], left[1:]
    triangles = np.concatenate(
        [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    )
    return soup(triangles, colour, surface)


def shaded(colour: Colour, share: float) -> Colour:
    """Return a colour darker, or with a share above 1 lighter, up to white."""
    red, green, blue = (min(1.0, part * share) for part in colour)
    return red, green, blue
