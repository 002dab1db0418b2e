"""Meshes of vehicle bodies: SUMO's car models, and other classes modelled here.

The lowest point of a body is at z = 0, its centre at x = y = 0, its front towards +x;
its bounding box has the vehicle's length, width and height.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from simbench.core.trajectories import Vehicle, VehicleClass
from simbench.render.world.mesh import (
    Colour,
    Mesh,
    Surface,
    box,
    cylinder,
    extrusion,
    merge,
    triangle_mesh,
)
from simbench.render.world.solids import icosphere, simplified
from simbench.render.world.sumo_cars import PLATE, sumo_car

__all__ = ["Hull", "body", "hull", "simple_body"]

_TYRE: Colour = (0.05, 0.05, 0.055)
_HUB: Colour = (0.55, 0.56, 0.58)
_GLASS: Colour = (0.07, 0.085, 0.1)
_DARK: Colour = (0.13, 0.13, 0.14)
_GREY: Colour = (0.5, 0.51, 0.52)
_WHITE_LAMP: Colour = (0.98, 0.96, 0.86)
_RED_LAMP: Colour = (0.72, 0.05, 0.04)
_PAINTED: Colour = (1.0, 1.0, 1.0)

_SUMO_CARS: dict[str, str] = {
    "car": "car-normal-citrus",
    "suv": "car-microcargo-citrus",
    "van": "car-minibus-citrus",
}


_SIMPLE_TRIANGLES: dict[str, int] = {
    "car": 300,
    "suv": 300,
    "van": 300,
    "truck": 240,
    "trailer": 400,
    "bus": 240,
    "motorcycle": 450,
}
"""Triangles of simplified bodies: their outlines enclose 1 % less, at most."""


def body(vehicle: Vehicle) -> Mesh:
    """Return the mesh of a vehicle in its own frame, in metres.

    The same for all vehicles of one class and size; painted corners get the colour of
    the instance.
    """
    return _body(vehicle.vehicle_class, vehicle.length, vehicle.width, vehicle.height)


@cache
def _body(kind: VehicleClass, length: float, width: float, height: float) -> Mesh:
    raw = sumo_car(_SUMO_CARS[kind]) if kind in _SUMO_CARS else _MODELS[kind]()
    low, high = raw.positions.min(axis=0), raw.positions.max(axis=0)
    scale = np.array([length, width, height]) / (high - low)
    middle = (low + high) / 2.0
    offset = -np.array([middle[0], middle[1], low[2]]) * scale
    return raw.moved(offset, scale=scale)


def simple_body(vehicle: Vehicle) -> Mesh:
    """Return the body with few triangles, for a vehicle that is small in the picture.

    Its outline is within about 2 cm of that of `body`.
    """
    kind = vehicle.vehicle_class
    return _simple_body(kind, vehicle.length, vehicle.width, vehicle.height)


@cache
def _simple_body(
    kind: VehicleClass, length: float, width: float, height: float
) -> Mesh:
    whole = _body(kind, length, width, height)
    count = _SIMPLE_TRIANGLES.get(kind)
    return whole if count is None else simplified(whole, count)


@dataclass(frozen=True, slots=True)
class Hull:
    """The convex hull of a body.

    The bounding box of its projection is that of the projected mesh.

    Attributes
    ----------
    points : (P, 3) float, m
    edges : (E, 2) int
        Indices of the two ends of each edge.
    """

    points: NDArray[np.float64]
    edges: NDArray[np.int64]


def hull(vehicle: Vehicle) -> Hull:
    """Return the convex hull of a vehicle's body, in the vehicle's frame."""
    return _hull(vehicle.vehicle_class, vehicle.length, vehicle.width, vehicle.height)


@cache
def _hull(kind: VehicleClass, length: float, width: float, height: float) -> Hull:
    mesh = _body(kind, length, width, height)
    unique = np.unique(mesh.positions.astype(np.float64), axis=0)
    solid = ConvexHull(unique, qhull_options="QbB Pp Qt")
    kept = np.sort(solid.vertices)
    corners = np.searchsorted(kept, solid.simplices)
    edges = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return Hull(unique[kept], np.unique(edges, axis=0).astype(np.int64))


def _painted_box(low: ArrayLike, high: ArrayLike, taper: float = 0.0) -> Mesh:
    return box(low, high, _PAINTED, Surface.PAINT, painted=True, taper=taper)


def _painted_extrusion(profile: ArrayLike, half: float) -> Mesh:
    return extrusion(profile, -half, half, _PAINTED, Surface.PAINT, painted=True)


def _wheel(x: float, y: float, radius: float, width: float) -> Mesh:
    """Make one wheel (or twin) with its hub; ``y`` is the outer face."""
    inner = y - width if y > 0 else y + width
    hub = y + (0.01 if y > 0 else -0.01)
    return merge(
        [
            cylinder((x, inner, radius), (x, y, radius), radius, _TYRE, sides=14),
            cylinder((x, y, radius), (x, hub, radius), radius * 0.55, _HUB, sides=10),
        ]
    )


def _axle(x: float, half_width: float, radius: float, width: float) -> Mesh:
    return merge(
        [_wheel(x, half_width, radius, width), _wheel(x, -half_width, radius, width)]
    )


def _lamps(x: float, half_width: float, z: float, colour: Colour, size: float) -> Mesh:
    """Make a pair of lamps on a face at ``x``."""
    sides = []
    for y in (half_width - size, -half_width):
        low, high = (x - 0.02, y, z), (x + 0.02, y + size, z + size * 0.7)
        sides.append(box(low, high, colour, Surface.LAMP))
    return merge(sides)


def _cab(front: float, back: float, half: float, floor: float, roof: float) -> Mesh:
    """Make a cab-over lorry cab with windscreen, side windows, grille and lamps."""
    waist, top = floor + 0.55 * (roof - floor), roof - 0.18
    nose = [(back, floor), (front, floor), (front, waist)]
    nose += [(front - 0.22, roof - 0.12), (front - 0.5, roof), (back, roof)]
    screen = [(front - 0.2, waist + 0.02), (front + 0.015, waist + 0.02)]
    screen += [(front - 0.195, top), (front - 0.3, top)]
    window = [(back + 0.5, waist + 0.05), (front - 0.25, waist + 0.05)]
    window += [(front - 0.45, top), (back + 0.5, top)]
    grille_low = (front - 0.01, -half * 0.7, floor + 0.25)
    grille_high = (front + 0.02, half * 0.7, waist - 0.12)
    return merge(
        [
            _painted_extrusion(nose, half),
            extrusion(screen, -half + 0.1, half - 0.1, _GLASS, Surface.GLASS),
            extrusion(window, -half - 0.01, half + 0.01, _GLASS, Surface.GLASS),
            box(grille_low, grille_high, _DARK),
            box((front - 0.1, -half, floor - 0.15), (front + 0.05, half, floor), _DARK),
            _lamps(front + 0.01, half - 0.08, floor + 0.12, _WHITE_LAMP, 0.26),
        ]
    )


def _cargo(
    low: tuple[float, float, float], high: tuple[float, float, float], *, painted: bool
) -> Mesh:
    """Make a box body with corner posts, rear doors and tail lamps."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    colour: Colour = _PAINTED if painted else (0.86, 0.86, 0.84)
    parts = [box(low, high, colour, Surface.PAINT, painted=painted)]
    for y in (y0 - 0.01, y1 - 0.07):
        for x in (x0 - 0.01, x1 - 0.07):
            post_high = (x + 0.08, y + 0.08, z1 + 0.01)
            parts.append(box((x, y, z0), post_high, _GREY))
    parts.append(box((x0 - 0.02, -0.02, z0), (x0, 0.02, z1), _DARK))
    parts.append(box((x0 - 0.04, y0, z0 - 0.18), (x0 + 0.06, y1, z0), _DARK))
    parts.append(_lamps(x0 - 0.04, y1 - 0.05, z0 - 0.16, _RED_LAMP, 0.22))
    stripe = (0.75, 0.1, 0.08)
    parts.append(box((x0, y0 - 0.008, z0), (x1, y1 + 0.008, z0 + 0.09), stripe))
    return merge(parts)


def _truck() -> Mesh:
    half = 1.2
    return merge(
        [
            _cab(4.2, 2.3, half, 0.75, 2.75),
            _cargo((-4.2, -half, 1.05), (2.1, half, 3.3), painted=False),
            box((-4.0, -0.45, 0.6), (3.6, 0.45, 1.05), _DARK),
            box((-1.6, -half + 0.03, 0.5), (1.6, half - 0.03, 0.9), _GREY),
            _axle(3.2, half, 0.48, 0.3),
            _axle(-2.6, half, 0.48, 0.55),
        ]
    )


def _trailer() -> Mesh:
    half = 1.25
    return merge(
        [
            _cab(8.2, 6.1, half, 0.85, 3.6),
            _cargo((-8.2, -half, 1.15), (5.5, half, 4.0), painted=True),
            box((-7.8, -0.5, 0.7), (7.6, 0.5, 1.15), _DARK),
            box((-2.6, -half + 0.02, 0.45), (2.4, half - 0.02, 1.1), _GREY),
            _axle(7.0, half, 0.52, 0.3),
            _axle(3.6, half, 0.52, 0.6),
            *(_axle(x, half, 0.5, 0.45) for x in (-6.7, -5.4, -4.1)),
        ]
    )


def _bus() -> Mesh:
    half, roof, front, back = 1.25, 3.2, 6.0, -6.0
    shell = [(back, 0.35), (front, 0.35), (front, 1.4), (front - 0.25, roof - 0.1)]
    shell += [(front - 0.6, roof), (back + 0.2, roof), (back, roof - 0.2)]
    parts = [_painted_extrusion(shell, half)]
    for number in range(7):
        x = -5.5 + number * 1.58
        low, high = (x, -half - 0.012, 1.35), (x + 1.45, half + 0.012, 2.6)
        parts.append(box(low, high, _GLASS, Surface.GLASS))
    screen = [(front - 0.3, 1.3), (front + 0.02, 1.3)]
    screen += [(front - 0.2, 2.9), (front - 0.5, 2.9)]
    parts.append(extrusion(screen, -half + 0.1, half - 0.1, _GLASS, Surface.GLASS))
    rear_low, rear_high = (back - 0.015, -0.95, 1.7), (back + 0.1, 0.95, 2.7)
    parts.append(box(rear_low, rear_high, _GLASS, Surface.GLASS))
    parts.append(box((back - 0.03, -0.25, 0.6), (back, 0.25, 0.72), PLATE))
    parts.append(_lamps(front + 0.01, half - 0.1, 0.7, _WHITE_LAMP, 0.3))
    parts.append(_lamps(back - 0.01, half - 0.08, 0.9, _RED_LAMP, 0.28))
    parts.append(box((-3.2, -0.7, roof), (1.0, 0.7, roof + 0.18), _GREY, taper=0.1))
    parts.append(box((back, -half, 0.3), (front, half, 0.42), _DARK))
    parts += [_axle(3.6, half + 0.01, 0.48, 0.3), _axle(-3.0, half + 0.01, 0.48, 0.5)]
    return merge(parts)


def _motorcycle() -> Mesh:
    """Make a motorcycle and its rider, leaning forward."""
    suit: Colour = (0.16, 0.17, 0.2)
    parts = [
        _thin_wheel(0.75, 0.32),
        _thin_wheel(-0.72, 0.32),
        box((-0.55, -0.14, 0.35), (0.5, 0.14, 0.75), _DARK, taper=0.04),
        _painted_box((-0.05, -0.17, 0.7), (0.5, 0.17, 0.98), taper=0.05),
        box((-0.9, -0.12, 0.72), (0.0, 0.12, 0.86), _DARK),
        _painted_box((0.55, -0.2, 0.72), (0.85, 0.2, 1.1), taper=0.08),
        box((0.82, -0.1, 0.8), (0.88, 0.1, 0.95), _WHITE_LAMP, Surface.LAMP),
        box((-0.95, -0.09, 0.74), (-0.9, 0.09, 0.84), _RED_LAMP, Surface.LAMP),
        cylinder((0.75, 0.0, 0.32), (0.5, 0.0, 1.0), 0.06, _GREY, sides=8),
        cylinder((0.55, -0.42, 1.02), (0.55, 0.42, 1.02), 0.03, _DARK, sides=6),
    ]
    for side in (-1.0, 1.0):
        hip, knee = (-0.3, side * 0.14, 0.88), (0.15, side * 0.26, 0.72)
        foot, hand = (-0.1, side * 0.24, 0.33), (0.5, side * 0.36, 1.04)
        shoulder = (0.05, side * 0.22, 1.28)
        parts.append(cylinder(hip, knee, 0.1, suit, sides=7, end_radius=0.08))
        parts.append(cylinder(knee, foot, 0.08, suit, sides=7, end_radius=0.06))
        parts.append(cylinder(shoulder, hand, 0.075, suit, sides=7, end_radius=0.05))
    parts.append(cylinder((-0.32, 0, 0.82), (0.06, 0, 1.32), 0.2, suit, sides=9))
    helmet = icosphere(1, 0.15) + np.array([0.14, 0.0, 1.42])
    parts.append(triangle_mesh(helmet, (0.85, 0.85, 0.87), Surface.PAINT))
    return merge(parts)


def _thin_wheel(x: float, radius: float) -> Mesh:
    rim = radius * 0.6
    return merge(
        [
            cylinder((x, -0.07, radius), (x, 0.07, radius), radius, _TYRE, sides=14),
            cylinder((x, -0.075, radius), (x, 0.075, radius), rim, _HUB, sides=10),
        ]
    )


def _ball() -> Mesh:
    corners = icosphere(3, 0.5)
    normals = corners.reshape(-1, 3) / 0.5
    return triangle_mesh(
        corners, _PAINTED, Surface.PAINT, painted=True, normals=normals
    )


_MODELS: dict[str, Callable[[], Mesh]] = {
    "truck": _truck,
    "trailer": _trailer,
    "bus": _bus,
    "motorcycle": _motorcycle,
    "ball": _ball,
}
