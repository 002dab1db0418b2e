"""Trees, bushes and the wooded hills on the horizon."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import (
    Colour,
    Mesh,
    Surface,
    cross_product,
    cylinder,
    merge,
    triangle_mesh,
    wall_strip,
)
from simbench.render.world.solids import icosphere

__all__ = ["hills", "plant", "thinned", "tree"]

_LEAF_COLOURS: dict[str, tuple[Colour, ...]] = {
    "summer": (
        (0.2, 0.32, 0.1),
        (0.25, 0.36, 0.12),
        (0.16, 0.28, 0.11),
        (0.3, 0.38, 0.15),
    ),
    "autumn": (
        (0.62, 0.34, 0.09),
        (0.7, 0.5, 0.12),
        (0.5, 0.2, 0.08),
        (0.4, 0.36, 0.12),
    ),
}
_BARK: Colour = (0.26, 0.21, 0.17)
_MANY_LEAVES, _THINNED_BY = 80, 4
"""Of plants with more leaves than that, one in four is enough for distant shadows."""


def tree(
    width_m: float,
    height_m: float,
    season: str,
    rng: np.random.Generator,
    *,
    leaves: int = 150,
    crown_from_m: float | None = None,
) -> Mesh:
    """Make a broad-leaved tree or a conifer, its base at the origin.

    The crown is an opaque dark core with loose leaf triangles around it, which make
    its outline irregular.

    Parameters
    ----------
    width_m, height_m : float, m
        Crown's diameter and the whole height.
    season : {"summer", "autumn"}
    rng : numpy.random.Generator
    leaves : int
        Number of leaf triangles.
    crown_from_m : float, m, optional
        Height at which the crown begins; by default a quarter of the height.
    """
    low = height_m * 0.25 if crown_from_m is None else crown_from_m
    is_conifer = crown_from_m is None and bool(rng.random() < 0.25)
    if is_conifer:
        width_m, low = width_m * 0.65, height_m * 0.1
    palette = _LEAF_COLOURS["summer" if is_conifer else season]
    base = np.array(palette[int(rng.integers(len(palette)))])
    if is_conifer:
        base = base * np.array([0.6, 0.75, 0.8])
    middle = np.array([0.0, 0.0, (low + height_m) / 2.0])
    half = np.array([width_m, width_m, height_m - low]) / 2.0
    core = _core(middle, half * 0.78, base * 0.7, is_conifer, rough=leaves < 50)
    foliage = _leaves(middle, half, base, leaves, is_conifer, rng)
    ends, radius = ((0, 0, -0.5), (0, 0, middle[2])), max(0.09, width_m * 0.035)
    trunk = cylinder(*ends, radius, _BARK, sides=7, capped=False)  # ends are hidden
    return merge([trunk, core, foliage])


def _taper(height: NDArray[np.float64], is_conifer: bool) -> NDArray[np.float64]:
    """Return the crown's width, as a share, at heights in [-1, 1]."""
    cone: NDArray[np.float64] = np.clip((1.05 - height) / 2.0, 0.03, 1.0)
    return cone if is_conifer else np.ones_like(height)


def _core(
    middle: NDArray[np.float64],
    half: NDArray[np.float64],
    colour: NDArray[np.float64],
    is_conifer: bool,
    *,
    rough: bool,
) -> Mesh:
    corners = icosphere(0 if rough else 1)
    shape = corners.copy()
    shape[..., :2] *= _taper(corners[..., 2], is_conifer)[..., None]
    red, green, blue = colour
    triangles = shape * half + middle
    return triangle_mesh(
        triangles, (red, green, blue), Surface.FOLIAGE, normals=corners
    )


def _leaves(
    middle: NDArray[np.float64],
    half: NDArray[np.float64],
    colour: NDArray[np.float64],
    count: int,
    is_conifer: bool,
    rng: np.random.Generator,
) -> Mesh:
    outward = rng.standard_normal((count, 3))
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    depth = rng.uniform(0.72, 1.0, (count, 1))
    point = outward * depth
    point[:, :2] *= _taper(point[:, 2], is_conifer)[:, None]
    size = half.mean() * 2.3 / np.sqrt(count)
    u = rng.standard_normal((count, 3))
    v = cross_product(u, rng.standard_normal((count, 3)))
    u *= size / np.linalg.norm(u, axis=-1, keepdims=True)
    v *= size / np.linalg.norm(v, axis=-1, keepdims=True)
    centre = point * half + middle
    a, b, c = centre - u - v * 0.6, centre + u - v * 0.5, centre + v
    triangles = np.stack([a, b, c], axis=1)
    normals = np.repeat(outward + [0.0, 0.0, 0.35], 3, axis=0)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    surface = Surface.LEAF if count > _MANY_LEAVES else Surface.FOLIAGE
    mesh = triangle_mesh(triangles, (1.0, 1.0, 1.0), surface, normals=normals)
    shade = rng.uniform(0.8, 1.2, (count, 1)) * (0.8 + 0.2 * outward[:, 2:])
    tints = np.clip(colour * shade, 0.0, 1.0)
    mesh.colours[:, :3] = np.repeat(tints, 3, axis=0)
    return mesh


def thinned(foliage: Mesh) -> Mesh:
    """Return foliage with fewer and larger leaves, for shadows that are far away.

    Of plants with many leaves one in four is kept, twice as long and as wide.
    """
    leaves, others = foliage.split(Surface.LEAF)
    is_kept = np.arange(len(leaves.positions)) // 3 % _THINNED_BY == 0
    kept = leaves.picked(is_kept)
    corners = kept.positions.reshape(-1, 3, 3)
    middles = corners.mean(axis=1, keepdims=True)
    larger = middles + math.sqrt(_THINNED_BY) * (corners - middles)
    return merge([others, replace(kept, positions=larger.reshape(-1, 3))])


def plant(
    kind: str,
    base: NDArray[np.float64],
    season: str,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> Mesh:
    """Return a random tree or bush, with fewer leaves far from every camera position.

    Parameters
    ----------
    kind : {"tree", "bush"}
    base : (3,) float, m
    season : str
    eyes : (N, 3) float, m
        Positions of the camera over the sequence.
    rng : numpy.random.Generator
    """
    is_tree = kind == "tree"
    height = rng.uniform(6.0, 13.0) if is_tree else rng.uniform(1.6, 3.2)
    spread = rng.uniform(0.5, 0.75) if is_tree else rng.uniform(1.0, 1.6)
    distance = _distance_m(eyes, base)
    leaves = 260 if distance < 60.0 else 60 if distance < 140.0 else 24
    mesh = tree(
        height * spread,
        height,
        season,
        rng,
        leaves=leaves if is_tree else leaves // 3,
        crown_from_m=None if is_tree else 0.2,
    )
    return mesh.moved(base, rng.uniform(0.0, 2.0 * math.pi))


def _distance_m(eyes: NDArray[np.float64], base: NDArray[np.float64]) -> float:
    """Return the distance of a point from the camera path, the polyline ``eyes``."""
    moves = np.diff(eyes, axis=0)
    lengths = np.maximum(np.sum(moves**2, axis=-1), 1e-12)
    part = np.clip(np.sum((base - eyes[:-1]) * moves, axis=-1) / lengths, 0.0, 1.0)
    nearest = np.concatenate([eyes[:1], eyes[:-1] + part[:, None] * moves])
    return float(np.min(np.linalg.norm(nearest - base, axis=-1)))


def hills(center: NDArray[np.float64], season: str, rng: np.random.Generator) -> Mesh:
    """Make a distant ring of wooded hills, from the Fourier series of its crest."""
    count = 96
    angle = 2.0 * math.pi * np.arange(count + 1) / count
    height = np.zeros(count + 1)
    for wave in range(2, 14):
        phase, size = rng.uniform(0, 2 * math.pi), rng.uniform(4, 26) / wave**0.6
        height += size * np.sin(wave * angle + phase)
    height = 24.0 + np.abs(height)
    height[-1] = height[0]
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    foot = np.column_stack([ring * 760.0 + center[:2], np.full(count + 1, -25.0)])
    crest = np.column_stack([ring * 1000.0 + center[:2], height])
    colour = (0.36, 0.3, 0.17) if season == "autumn" else (0.2, 0.29, 0.15)
    mesh = wall_strip(foot + [0, 0, center[2]], crest + [0, 0, center[2]], colour)
    return replace(mesh, normals=-mesh.normals)  # seen from its middle
