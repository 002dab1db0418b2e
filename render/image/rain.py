"""Rain streaks of the drops near the camera.

Drops farther away are not drawn one by one; they are part of the extinction, see
`simbench.render.world.illumination.extinction_per_m`.
"""

from __future__ import annotations

import math

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera

__all__ = ["draw_rain", "falling_drops"]

_NEAR_M, _FAR_M = 0.6, 14.0
_MIN_MM, _MAX_MM = 1.0, 5.5
_SHUTTER_S = 1.0 / 60.0
_OPACITY = 9.0
"""Factor on the physical opacity of streaks, which would hardly be visible at 8 bits;
chosen by eye."""
_MIN_OPACITY, _MAX_OPACITY = 0.03, 0.55
_SHIFT = 4
_SHADES = 8
_MAX_DROPS = 6000


def falling_drops(
    rate_mm_per_h: float, camera: Camera, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Sample the drops in view at one instant.

    Parameters
    ----------
    rate_mm_per_h : float, mm/h
    camera : Camera
    rng : numpy.random.Generator

    Returns
    -------
    positions : (N, 3) float, m
        In the road frame.
    diameters : (N,) float, mm
        Between `_MIN_MM` and `_MAX_MM`: ``8000 exp(-4.1 R**-0.21 D)`` drops a m3
        and mm.
    speeds : (N,) float, m/s
        Downwards: ``9.65 - 10.3 exp(-0.6 D)``.

    References
    ----------
    Marshall and Palmer (1948), "The distribution of raindrops with size",
    J. Meteorology 5, eqs. 1 and 3. Atlas, Srivastava and Sekhon (1973), "Doppler radar
    characteristics of precipitation at vertical incidence", Rev. Geophys. 11(1).
    """
    slope = 4.1 * rate_mm_per_h**-0.21
    low, high = math.exp(-slope * _MIN_MM), math.exp(-slope * _MAX_MM)
    per_m3 = 8000.0 / slope * (low - high)
    # The margin is for streaks that begin outside the image.
    wide = 1.1 * camera.width / camera.focal_px
    tall = 1.3 * camera.height / camera.focal_px
    per_cube = per_m3 * wide * tall / 3.0
    # In heavy rain the farthest, which are the thinnest, are omitted.
    cubes = min(_FAR_M**3 - _NEAR_M**3, _MAX_DROPS / per_cube)
    count = int(rng.poisson(per_cube * cubes))
    share = rng.random((count, 4))
    # Uniform in the volume: the cross-section grows with the square of the depth.
    depth = np.cbrt(_NEAR_M**3 + share[:, 0] * cubes)
    local = np.stack(
        [(share[:, 1] - 0.5) * wide, (share[:, 2] - 0.5) * tall, np.ones(count)],
        axis=-1,
    )
    positions = (local * depth[:, None] - camera.translation) @ camera.rotation
    diameters = -np.log(low - share[:, 3] * (low - high)) / slope
    return positions, diameters, 9.65 - 10.3 * np.exp(-0.6 * diameters)


def draw_rain(
    image: NDArray[np.uint8],
    rate_mm_per_h: float,
    camera: Camera,
    velocity: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.uint8]:
    """Return an image with the streaks of falling drops.

    A drop refracts light from nearly the whole scene and is about as bright as its
    surroundings with the sky. It covers a point for only a part of the exposure:
    ``diameter / (speed * shutter)``.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        Not written into.
    rate_mm_per_h : float, mm/h
    camera : Camera
    velocity : (3,) float, m/s
        Of the camera, road frame.
    rng : numpy.random.Generator
        Source of the drops, a separate one for each frame.

    References
    ----------
    Garg and Nayar (2007), "Vision and rain", IJCV 75(1), sections 3 and 4: brightness
    of drops, and of the streaks they leave.
    """
    positions, diameters, speeds = falling_drops(rate_mm_per_h, camera, rng)
    moved = -velocity - speeds[:, None] * [0.0, 0.0, 1.0]
    first, depth = camera.project(positions)
    last, _ = camera.project(positions + moved * _SHUTTER_S)
    size_px = camera.focal_px * diameters / 1000.0 / depth
    length = np.linalg.norm(last - first, axis=-1)
    opacity = _OPACITY * np.minimum(size_px, 1.0) * size_px / np.maximum(length, 1e-6)
    opacity = np.minimum(opacity, _MAX_OPACITY)
    room = 4.0  # the widest line, and its soft edge
    beyond = np.array([camera.width, camera.height]) + room
    is_near = (np.maximum(first, last) > -room) & (np.minimum(first, last) < beyond)
    is_shown = np.isfinite(length) & (opacity > _MIN_OPACITY)
    shown = np.flatnonzero(is_shown & is_near[:, 0] & is_near[:, 1])
    lines = np.stack([first[shown], last[shown]], axis=1)
    alpha = _streaks(image.shape[:2], lines, size_px[shown], opacity[shown])
    bright = cv2.resize(image, (4, 3), interpolation=cv2.INTER_AREA).max(axis=(0, 1))
    around = np.array(cv2.mean(image)[:3])
    colour = 0.25 * around + 0.75 * bright
    return np.asarray(_blend(image, alpha, colour))


def _streaks(
    shape: tuple[int, int],
    lines: NDArray[np.float64],
    size_px: NDArray[np.float64],
    opacity: NDArray[np.float64],
) -> NDArray[np.uint8]:
    """Draw (N, 2, 2) lines in classes of width and opacity: (H, W), 255 is opaque."""
    alpha = np.zeros(shape, np.uint8)
    widths = np.clip(np.rint(size_px), 1, 4).astype(np.int64)
    shades = np.minimum(opacity / _MAX_OPACITY * _SHADES, _SHADES - 1).astype(np.int64)
    # OpenCV: the origin is the centre of the first pixel; fixed-point coordinates.
    fixed = np.rint(np.clip(lines - 0.5, -4e3, 1e4) * 2**_SHIFT).astype(np.int32)
    for shade in range(_SHADES):  # dense streaks overwrite faint ones
        level = round(255 * (shade + 0.5) / _SHADES * _MAX_OPACITY)
        for width in range(1, 5):
            chosen = fixed[(shades == shade) & (widths == width)]
            if len(chosen):
                cv2.polylines(
                    alpha, list(chosen), False, level, width, cv2.LINE_AA, _SHIFT
                )
    return alpha


@numba.njit(cache=True)
def _blend(image, alpha, colour):  # type: ignore[no-untyped-def]  # compiled by numba
    """Blend a colour into an image by an (H, W) uint8 alpha, 255 for opaque."""
    result = image.copy()
    for row in range(image.shape[0]):
        for column in range(image.shape[1]):
            if alpha[row, column]:
                share = alpha[row, column] / 255.0
                for channel in range(3):
                    level = image[row, column, channel]
                    level += share * (colour[channel] - level)
                    result[row, column, channel] = int(level + 0.5)
    return result
