"""Glare of bright lamps: glow and halo around them, and reflections on a wet road.

Light scatters in lens, sensor and fog around every visible lamp, and a wet road
reflects it as a long streak. Only the image is changed, not ids or ground truth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera

__all__ = ["VisibleLamps", "draw_glare"]

_CORE = 0.0036
"""Sigma of the core of the glare as a share of the image's width."""
_MIN_LIGHT = 0.004
"""Glare below this share of full scale is omitted."""
_MAX_PEAK = 6.0
_FAR_M2, _STRENGTH = 500.0, 6000.0
_SKIRT, _SKIRT_WIDTH = 0.07, 3.0
_FOG_HALO, _FOG_WIDTH = 0.05, 12.0
_WET_SHARE = 0.25


@dataclass(frozen=True, slots=True)
class VisibleLamps:
    """N lamps whose light may reach the camera.

    Attributes
    ----------
    positions : (N, 3) float, m
        In the road frame.
    light : (N, 3) float
        Linear RGB towards the camera; 1 for a head lamp seen from the front.
    ids : (N,) int
        Instance ids of their vehicles or posts: where another id is visible, the lamp
        is occluded.
    road_z : (N,) float, m
        Height of the road below them.
    """

    positions: NDArray[np.float64]
    light: NDArray[np.float64]
    ids: NDArray[np.int64]
    road_z: NDArray[np.float64]


def draw_glare(
    image: NDArray[np.uint8],
    ids: NDArray[np.uint16],
    camera: Camera,
    lamps: VisibleLamps,
    *,
    haze_per_m: float,
    wet_id: int | None,
) -> NDArray[np.uint8]:
    """Return an image with the glare of its lamps.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        Not written into.
    ids : (S H, S W) uint16
        Instance ids at the samples.
    camera : Camera
    lamps : VisibleLamps
    haze_per_m : float, 1/m
        Extinction: dims lamps and widens their glare.
    wet_id : int or None
        Id of the ground if it is wet and reflects lamps.
    """
    samples = ids.shape[0] // image.shape[0]
    pixels, depth = camera.project(lamps.positions)
    seen = _visible(pixels * samples, lamps.ids, ids)
    if not seen.any():
        return image
    light = np.zeros(image.shape, np.float32)
    middle = slice(samples // 2, None, samples)
    is_wet = ids[middle, middle] == (-1 if wet_id is None else wet_id)
    mirrored = lamps.positions.copy()
    mirrored[:, 2] = 2.0 * lamps.road_z - mirrored[:, 2]
    below, _ = camera.project(mirrored)
    core = _CORE * image.shape[1]
    for index in np.flatnonzero(seen):
        distance = float(depth[index])
        thick = haze_per_m * distance
        strength = min(_STRENGTH / (distance**2 + _FAR_M2), _MAX_PEAK)
        colour = (lamps.light[index] * strength * math.exp(-thick)).astype(np.float32)
        if colour.max() < _MIN_LIGHT:
            continue
        x, y = pixels[index]
        _add_glow(light, x, y, core, colour, _FOG_HALO * min(thick, 2.0))
        if wet_id is not None and np.isfinite(below[index]).all():
            mirrored_x, mirrored_y = below[index]
            streak = max(1.5 * core, 0.3 * (mirrored_y - y))
            _add_streak(light, is_wet, mirrored_x, mirrored_y, core, streak, colour)
    return np.asarray(_add_light(image, light))


def _visible(
    points: NDArray[np.float64], owners: NDArray[np.int64], ids: NDArray[np.uint16]
) -> NDArray[np.bool_]:
    """Return which (N, 2) points on the sample grid are within a sample of their id."""
    height, width = ids.shape
    # NaN, behind the camera, compares false.
    inside = np.all((points >= 0.0) & (points < [width, height]), axis=1)
    column, row = np.where(inside[:, None], points, 0.0).astype(np.int64).T
    shown = np.zeros(len(points), bool)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            y = np.clip(row + down, 0, height - 1)
            x = np.clip(column + right, 0, width - 1)
            shown |= ids[y, x] == owners
    seen: NDArray[np.bool_] = inside & shown
    return seen


@numba.njit(cache=True)
def _window(size, middle, reach):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return the range of pixels, of ``size``, within ``reach`` of a position."""
    return max(0, int(middle - reach)), min(size, int(middle + reach) + 2)


@numba.njit(cache=True)
def _add_glow(light, x, y, core, colour, halo):  # type: ignore[no-untyped-def]
    """Add a Gaussian core, a wide faint skirt and, in fog or rain, a halo."""
    wide, hazy = _SKIRT_WIDTH * core, _FOG_WIDTH * core
    # The skirt and the halo fall with the cube of the distance.
    peak = colour.max() / _MIN_LIGHT
    reach = max(3.0 * core, wide * (peak * _SKIRT) ** (1 / 3))
    reach = max(reach, hazy * (peak * halo) ** (1 / 3))
    left, right = _window(light.shape[1], x, reach)
    top, bottom = _window(light.shape[0], y, reach)
    for row in range(top, bottom):
        for column in range(left, right):
            square = (column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2
            spread = 1.0 + square / wide**2
            shape = _SKIRT / (spread * math.sqrt(spread))
            if square < 16.0 * core**2:
                shape += math.exp(-0.5 * square / core**2)
            if halo > 0.0:
                spread = 1.0 + square / hazy**2
                shape += halo / (spread * math.sqrt(spread))
            for channel in range(3):
                light[row, column, channel] += shape * colour[channel]


@numba.njit(cache=True)
def _add_streak(light, is_wet, x, y, core, length, colour):  # type: ignore[no-untyped-def]
    """Add the reflection of a lamp on the wet road: a streak towards the camera."""
    across = 1.2 * core
    left, right = _window(light.shape[1], x, 3.0 * across)
    top, bottom = _window(light.shape[0], y, 2.5 * length)
    for row in range(top, bottom):
        for column in range(left, right):
            if is_wet[row, column]:
                dx, dy = (column + 0.5 - x) / across, (row + 0.5 - y) / length
                shape = _WET_SHARE * math.exp(-0.5 * (dx * dx + dy * dy))
                for channel in range(3):
                    light[row, column, channel] += shape * colour[channel]


@numba.njit(cache=True)
def _add_light(image, light):  # type: ignore[no-untyped-def]  # compiled by numba
    """Add linear light to an image with levels proportional to its square root."""
    result = image.copy()
    for row in range(image.shape[0]):
        for column in range(image.shape[1]):
            for channel in range(3):
                more = light[row, column, channel]
                if more > 0.0:
                    level = image[row, column, channel] / 255.0
                    level = math.sqrt(min(level * level + more, 1.0))
                    result[row, column, channel] = int(255.0 * level + 0.5)
    return result
