"""Static scene of the ball scenarios: a floor of tiles or boards with low walls."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import (
    Colour,
    Mesh,
    box,
    merge,
    quads,
    shaded,
    triangle_mesh,
)
from simbench.render.world.static_scene import StaticScene
from simbench.render.world.vegetation import plant
from simbench.scenarios.schema import FloorPlan, Surroundings
from simbench.scenarios.schema.road import BOARD_RATIO

__all__ = ["floor_scene"]

_TILE: Colour = (0.66, 0.65, 0.62)
_JOINT: Colour = (0.4, 0.39, 0.37)
_WOOD: Colour = (0.63, 0.47, 0.3)
_PLAIN: Colour = (0.5, 0.52, 0.53)
_YARD: Colour = (0.47, 0.47, 0.45)
_WALL: Colour = (0.74, 0.74, 0.71)
_YARD_M = 700.0
_JOINT_SHARE = 0.025
_WALL_THICK_M = 0.06


def floor_scene(
    plan: FloorPlan,
    surroundings: Surroundings,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> StaticScene:
    """Build a floor with its walls in the middle of a paved yard.

    Parameters
    ----------
    plan : FloorPlan
    surroundings : Surroundings
    eyes : (N, 3) float, m
        Positions of the camera.
    rng : numpy.random.Generator
    """
    middle = np.array([plan.length_m / 2.0, 0.0, 0.0])
    reach = math.hypot(plan.length_m, plan.width_m)
    objects = [("wall", wall) for wall in _walls(plan)]
    if surroundings.tree_spacing_m is not None:
        radius = reach / 2.0 + surroundings.tree_lateral_m
        count = max(3, round(2.0 * math.pi * radius / surroundings.tree_spacing_m))
        for angle in 2.0 * math.pi * np.arange(count) / count:
            out = radius + rng.exponential(4.0)
            base = middle + out * np.array([math.cos(angle), math.sin(angle), 0.0])
            tree = plant("tree", base, surroundings.season, eyes, rng)
            objects.append(("tree", tree))
    floor = _floor(plan, rng)  # after the trees: both share the generator
    return StaticScene(merge([*_yard(plan), *floor]), objects, middle)


def _rectangle(x: tuple[float, float], y: tuple[float, float], colour: Colour) -> Mesh:
    (x0, x1), (y0, y1) = x, y
    corners = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], float)
    return triangle_mesh(quads(*corners), colour)


def _yard(plan: FloorPlan) -> list[Mesh]:
    """Pave the ground around the floor, but not below it."""
    half, length, far = plan.width_m / 2.0, plan.length_m, _YARD_M
    return [
        _rectangle((-far, 0.0), (-far, far), _YARD),
        _rectangle((length, far), (-far, far), _YARD),
        _rectangle((0.0, length), (-far, -half), _YARD),
        _rectangle((0.0, length), (half, far), _YARD),
    ]


def _floor(plan: FloorPlan, rng: np.random.Generator) -> list[Mesh]:
    """Make rows of square tiles or of long staggered boards, each of its own shade."""
    half, length, width = plan.width_m / 2.0, plan.length_m, plan.piece_m
    if plan.pattern == "plain":
        return [_rectangle((0.0, length), (-half, half), _PLAIN)]
    is_wood, joint = plan.pattern == "boards", width * _JOINT_SHARE
    colour, dark, shades = _TILE, _JOINT, (0.93, 1.05)
    if is_wood:
        colour, dark, shades = _WOOD, shaded(_WOOD, 0.62), (0.86, 1.1)
    parts = []
    for low, high in pairwise(_cuts(-half, half, width)):
        step = width * BOARD_RATIO if is_wood else width
        first = rng.uniform(0.2, 1.0) * step if is_wood else 0.0
        parts.append(_rectangle((0.0, length), (low, low + joint), dark))
        for left, right in pairwise(_cuts(0.0, length, step, first)):
            row = low + joint, high
            parts.append(_rectangle((left, left + joint), row, dark))
            shade = shaded(colour, rng.uniform(*shades))
            parts.append(_rectangle((left + joint, right), row, shade))
    return parts


def _cuts(low: float, high: float, step: float, first: float = 0.0) -> list[float]:
    """Return the ends of the pieces between two limits; a sliver joins the last."""
    inner = np.arange(low + (first or step), high - 0.2 * step, step)
    return [low, *inner.tolist(), high]


def _walls(plan: FloorPlan) -> list[Mesh]:
    if plan.wall_m == 0:
        return []
    half, length, thick = plan.width_m / 2.0, plan.length_m, _WALL_THICK_M
    top = plan.wall_m
    return [
        box((-thick, -half - thick, 0.0), (0.0, half + thick, top), _WALL),
        box((length, -half - thick, 0.0), (length + thick, half + thick, top), _WALL),
        box((0.0, -half - thick, 0.0), (length, -half, top), _WALL),
        box((0.0, half, 0.0), (length, half + thick, top), _WALL),
    ]
