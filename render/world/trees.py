"""Trees that look like trees at the resolution of a traffic camera."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from simbench.render.world.mesh import Colour, Mesh, Surface, cylinder, merge, soup

__all__ = ["tree"]

_LEAVES: dict[str, tuple[Colour, ...]] = {
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


def tree(
    width_m: float,
    height_m: float,
    season: str,
    rng: np.random.Generator,
    *,
    leaves: int = 150,
    crown_from_m: float | None = None,
) -> Mesh:
    """Make a broad-leaved tree or a conifer, foot at the origin.

    A dark core stops the light; loose leaf sheets around it break up the outline and
    let the sky through at the rim, as real crowns do.

    Parameters
    ----------
    width_m, height_m : float, m
        Crown's diameter and the whole height.
    season : {"summer", "autumn"}
    rng : numpy.random.Generator
    leaves : int
        Number of leaf sheets: fewer for trees far away.
    crown_from_m : float, m, optional
        Height at which the crown begins; by default a quarter of the height.
    """
    low = height_m * 0.25 if crown_from_m is None else crown_from_m
    is_conifer = crown_from_m is None and bool(rng.random() < 0.25)
    if is_conifer:
        width_m, low = width_m * 0.65, height_m * 0.1
    palette = _LEAVES["summer" if is_conifer else season]
    base = np.array(palette[int(rng.integers(len(palette)))])
    if is_conifer:
        base = base * np.array([0.6, 0.75, 0.8])
    middle = np.array([0.0, 0.0, (low + height_m) / 2.0])
    half = np.array([width_m, width_m, height_m - low]) / 2.0
    core = _core(middle, half * 0.78, base * 0.7, is_conifer, rough=leaves < 50)
    sheets = _sheets(middle, half, base, leaves, is_conifer, rng)
    trunk = cylinder(
        (0, 0, -0.5), (0, 0, middle[2]), max(0.09, width_m * 0.035), _BARK, sides=7
    )
    return merge([trunk, core, sheets])


def _taper(height: NDArray[np.float64], is_conifer: bool) -> NDArray[np.float64]:
    """Return the crown's width, as a share, at heights in [-1, 1]."""
    if is_conifer:
        cone: NDArray[np.float64] = np.clip((1.05 - height) / 2.0, 0.03, 1.0)
        return cone
    return np.ones_like(height)


def _core(
    middle: NDArray[np.float64],
    half: NDArray[np.float64],
    colour: NDArray[np.float64],
    is_conifer: bool,
    *,
    rough: bool,
) -> Mesh:
    ball = trimesh.creation.icosphere(subdivisions=0 if rough else 1)
    corners = np.asarray(ball.triangles, np.float64)
    normals = corners.reshape(-1, 3)
    shape = corners.copy()
    shape[..., :2] *= _taper(corners[..., 2], is_conifer)[..., None]
    red, green, blue = colour
    return soup(
        shape * half + middle, (red, green, blue), Surface.FOLIAGE, normals=normals
    )


def _sheets(
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
    spot = outward * depth
    spot[:, :2] *= _taper(spot[:, 2], is_conifer)[:, None]
    size = half.mean() * 2.3 / np.sqrt(count)
    u = rng.standard_normal((count, 3))
    v = np.cross(u, rng.standard_normal((count, 3)))
    u *= size / np.linalg.norm(u, axis=-1, keepdims=True)
    v *= size / np.linalg.norm(v, axis=-1, keepdims=True)
    place = spot * half + middle
    a, b, c = place - u - v * 0.6, place + u - v * 0.5, place + v
    triangles = np.stack([a, b, c], axis=1)
    normals = np.repeat(outward + [0.0, 0.0, 0.35], 3, axis=0)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    mesh = soup(triangles, (1.0, 1.0, 1.0), Surface.FOLIAGE, normals=normals)
    shade = rng.uniform(0.8, 1.2, (count, 1)) * (0.8 + 0.2 * outward[:, 2:])
    tints = np.clip(colour * shade, 0.0, 1.0)
    mesh.colours[:, :3] = np.repeat(tints, 3, axis=0)
    return mesh
