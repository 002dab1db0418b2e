"""Where the shadow maps of a view lie: squares of the sun's plane, fixed to the ground.

Several maps of different size serve one view, the finest around what is nearest. Their
texels lie on grids that are fixed to the ground, and the maps move in whole steps: a
shadow changes neither with the target nor, but for its resolution, with the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera

__all__ = ["FAR_M", "MAPS", "REACH_M", "TEXELS", "ShadowFit", "fit_shadow_maps"]

MAPS = 2
"""Most maps a view."""
TEXELS = 2048
"""Texels along each side of a map."""
REACH_M = 600.0
"""Half the depth of the maps along the light."""
FAR_M = 300.0
"""Distance to which shadows are drawn."""
_HIGH_M = 12.0
"""Height above the ground up to which things receive shadows."""
_STEPS = 8
"""A map moves by this part of its side."""
_RATIO = 1.5
"""Least ratio of the farthest to the nearest ground for two maps."""
_RAYS = 7
"""Rays along each side of the picture that find what it sees."""


@dataclass(frozen=True, slots=True)
class ShadowFit:
    """Squares of the sun's plane that the shadow maps cover, from fine to coarse.

    Attributes
    ----------
    to_light : (4, 4) float
        Road frame to light coordinates [m]: right, up, and away from the sun.
    squares : (K, 3) float, m
        Middle and half side of each map, K at most `MAPS`.
    near_m : float, m
        Distance from the eye at which the first of two maps ends; 0 if there is one.
    """

    to_light: NDArray[np.float64]
    squares: NDArray[np.float64]
    near_m: float

    @property
    def texels_m(self) -> NDArray[np.float64]:
        """Side of a texel of each map, (K,) m."""
        sides: NDArray[np.float64] = 2.0 * self.squares[:, 2] / TEXELS
        return sides

    @property
    def uniforms(self) -> dict[str, NDArray[np.float64] | float]:
        """What shaders read; the maps lie side by side in one texture.

        ``to_light``: as here, but with twice the second coordinate, and the third in
        [0, 1]; ``shadow_squares``: a column for each map, scale and offset (by x, y) to
        the texture's coordinates, and side of a texel [m]; of one map, twice the same.
        """
        scale = np.diag([1.0, 2.0, 0.5 / REACH_M, 1.0])
        scale[2, 3] = 0.5
        columns = np.zeros((4, 4))
        for column, number in enumerate((0, len(self.squares) - 1)):
            x, y, half = self.squares[number]
            across = 0.25 / half
            offsets = 0.25 - x * across, 0.5 - 2.0 * y * across
            columns[:, column] = across, *offsets, 2.0 * half / TEXELS
        return {
            "to_light": scale @ self.to_light,
            "shadow_squares": columns,
            "shadow_near": self.near_m,
            "per_metre": 0.5 / REACH_M,
        }

    def clip(self, number: int) -> NDArray[np.float64]:
        """Return the (4, 4) map from the road frame to the clip space of one map."""
        x, y, half = self.squares[number]
        scale = np.diag([1.0 / half, 1.0 / half, 1.0 / REACH_M, 1.0])
        scale[:2, 3] = [-x / half, -y / half]
        clip: NDArray[np.float64] = scale @ self.to_light
        return clip


def fit_shadow_maps(
    camera: Camera, to_sun: NDArray[np.float64], ground_m: float
) -> ShadowFit:
    """Place shadow maps for a view of flat ground.

    Parameters
    ----------
    camera : Camera
    to_sun : (3,) float
        Unit vector, not vertical.
    ground_m : float, m
        Height of the ground. Where it differs, maps are less well used, not wrong.

    Returns
    -------
    ShadowFit
        A function of the arguments alone: every frame has the same maps, whichever
        frames are rendered before.
    """
    rotation = _light_axes(to_sun)
    eye = camera.position
    rays = _rays(camera)
    begins, stops, grounds = _within_heights(rays, eye[2] - ground_m)
    widest = np.linalg.norm(rays, axis=1).max()  # distance over depth, in a corner
    # in steps, as all that follows
    near = 2.0 ** (math.floor(2.0 * math.log2(max(0.6 * grounds.min(), 3.0))) / 2.0)
    far = max(float(stops.max()), near)
    middle = math.sqrt(near * far) if far > _RATIO * near else 0.0
    parts = [(0.0, middle), (middle / widest, far)] if middle else [(0.0, far)]
    squares = []
    for first, last in parts:
        depths = np.concatenate([np.maximum(begins, first), np.minimum(stops, last)])
        is_there = np.tile((begins < last) & (stops > first), 2)
        points = eye + np.tile(rays, (2, 1)) * depths[:, None]
        squares.append(
            _square(
                (points if not is_there.any() else points[is_there]) @ rotation[:2].T
            )
        )
    to_light = np.eye(4)
    to_light[:3, :3] = rotation
    to_light[2, 3] = -round(float(rotation[2] @ eye) / 256.0) * 256.0
    return ShadowFit(to_light, np.array(squares), middle)


def _rays(camera: Camera) -> NDArray[np.float64]:
    """Return rays over the picture, (N, 3) of depth 1, some of them at its horizon."""
    shares = np.linspace(0.0, 1.0, _RAYS)
    pixels = np.stack(np.meshgrid(shares, shares), axis=-1) * [
        camera.width,
        camera.height,
    ]
    slopes = (pixels - camera.matrix[:2, 2]) / np.diag(camera.matrix)[:2]
    ones = np.ones((_RAYS, _RAYS, 1))
    rays = np.concatenate([slopes, ones], axis=-1) @ camera.rotation
    top, bottom = rays[0], rays[-1]
    up, down = top[:, 2:], bottom[:, 2:]
    crosses = (up * down < 0.0)[:, 0]
    level = top + (bottom - top) * (up / np.where(up == down, 1.0, up - down))
    return np.concatenate([rays.reshape(-1, 3), level[crosses]])


def _within_heights(
    rays: NDArray[np.float64], height_m: float
) -> tuple[NDArray[np.float64], ...]:
    """Return where rays from a height are near the ground: depths of begin and end.

    Also where they meet the ground; `FAR_M` where they do not.
    """
    steep = np.where(np.abs(rays[:, 2]) < 1e-9, 1e-9, rays[:, 2])
    grounds, tops = -height_m / steep, (_HIGH_M - height_m) / steep
    grounds = np.where(grounds > 0.0, np.minimum(grounds, FAR_M), FAR_M)
    if height_m > _HIGH_M:
        begins = np.where(tops > 0.0, np.minimum(tops, FAR_M), FAR_M)
        return begins, grounds, grounds
    tops = np.where(tops > 0.0, np.minimum(tops, FAR_M), FAR_M)
    return np.zeros(len(rays)), np.minimum(grounds, tops), grounds


def _light_axes(to_sun: NDArray[np.float64]) -> NDArray[np.float64]:
    forward = -to_sun
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(right, forward), forward])


def _square(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return middle and half side of a square around points, in whole steps."""
    low, high = points.min(axis=0), points.max(axis=0)
    least = float((high - low).max()) / (1.0 - 1.0 / _STEPS)
    side = 2.0 ** (math.ceil(4.0 * math.log2(least)) / 4.0)
    step = side / _STEPS
    x, y = np.round((low + high) / 2.0 / step) * step
    return np.array([x, y, side / 2.0])
