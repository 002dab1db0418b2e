"""A floor of tiles or boards with low walls, for balls."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import Colour, Mesh, Surface, box, merge, shaded, soup
from simbench.render.world.setting import Setting, grown
from simbench.scenarios.schema import FloorPlan, Surroundings

__all__ = ["floor_setting"]

_TILE: Colour = (0.66, 0.65, 0.62)
_JOINT: Colour = (0.4, 0.39, 0.37)
_WOOD: Colour = (0.63, 0.47, 0.3)
_PLAIN: Colour = (0.5, 0.52, 0.53)
_YARD: Colour = (0.47, 0.47, 0.45)
_WALL: Colour = (0.74, 0.74, 0.71)
_YARD_M = 700.0
_JOINT_SHARE = 0.025
_BOARD_RATIO = 8.0  # length over width
_WALL_THICK_M = 0.06


def floor_setting(
    plan: FloorPlan,
    wanted: Surroundings,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> Setting:
    """Build a floor with its walls in the middle of a paved yard."""
    middle = np.array([plan.length_m / 2.0, 0.0, 0.0])
    reach = math.hypot(plan.length_m, plan.width_m)
    pieces = {"tiles": _tiles, "boards": _boards, "plain": _plain}[plan.pattern]
    standing = [("wall", wall) for wall in _walls(plan)]
    if wanted.tree_spacing_m is not None:
        distance = reach / 2.0 + wanted.tree_lateral_m
        around = max(3, round(2.0 * math.pi * distance / wanted.tree_spacing_m))
        for angle in 2.0 * math.pi * np.arange(around) / around:
            out = distance + rng.exponential(4.0)
            base = middle + out * np.array([math.cos(angle), math.sin(angle), 0.0])
            standing.append(("tree", grown("tree", base, wanted.season, eyes, rng)))
    return Setting(merge([_yard(plan), *pieces(plan, rng)]), standing, middle, reach)


def _rectangle(x: tuple[float, float], y: tuple[float, float], colour: Colour) -> Mesh:
    a, b = [x[0], y[0], 0.0], [x[1], y[0], 0.0]
    c, d = [x[1], y[1], 0.0], [x[0], y[1], 0.0]
    return soup(np.array([[a, b, c], [a, c, d]]), colour, Surface.MATTE)


def _yard(plan: FloorPlan) -> Mesh:
    """Pave what lies around the floor, without lying under it."""
    half, length = plan.width_m / 2.0, plan.length_m
    far = _YARD_M
    return merge(
        [
            _rectangle((-far, 0.0), (-far, far), _YARD),
            _rectangle((length, far), (-far, far), _YARD),
            _rectangle((0.0, length), (-far, -half), _YARD),
            _rectangle((0.0, length), (half, far), _YARD),
        ]
    )


def _plain(plan: FloorPlan, _: np.random.Generator) -> list[Mesh]:
    half = plan.width_m / 2.0
    return [_rectangle((0.0, plan.length_m), (-half, half), _PLAIN)]


def _tiles(plan: FloorPlan, rng: np.random.Generator) -> list[Mesh]:
    """Lay square tiles, each of a shade of its own, with joints between them."""
    half, joint = plan.width_m / 2.0, plan.piece_m * _JOINT_SHARE
    rows = _cuts(-half, half, plan.piece_m)
    columns = _cuts(0.0, plan.length_m, plan.piece_m)
    parts = []
    for low, high in pairwise(rows):
        parts.append(_rectangle((0.0, plan.length_m), (low, low + joint), _JOINT))
        for left, right in pairwise(columns):
            tile = low + joint, high
            parts.append(_rectangle((left, left + joint), tile, _JOINT))
            shade = shaded(_TILE, rng.uniform(0.93, 1.05))
            parts.append(_rectangle((left + joint, right), tile, shade))
    return parts


def _boards(plan: FloorPlan, rng: np.random.Generator) -> list[Mesh]:
    """Lay long boards side by side, their ends staggered."""
    half, joint = plan.width_m / 2.0, plan.piece_m * _JOINT_SHARE
    length = plan.piece_m * _BOARD_RATIO
    parts = []
    for low, high in pairwise(_cuts(-half, half, plan.piece_m)):
        ends = _cuts(0.0, plan.length_m, length, rng.uniform(0.2, 1.0) * length)
        dark = shaded(_WOOD, 0.62)
        parts.append(_rectangle((0.0, plan.length_m), (low, low + joint), dark))
        for left, right in pairwise(ends):
            board = low + joint, high
            parts.append(_rectangle((left, left + joint), board, dark))
            shade = shaded(_WOOD, rng.uniform(0.86, 1.1))
            parts.append(_rectangle((left + joint, right), board, shade))
    return parts


def _cuts(low: float, high: float, step: float, first: float = 0.0) -> list[float]:
    """Return where pieces begin and end between two places; slivers join the last."""
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
