"""Sensor model: blur, low resolution, exposure, contrast, noise and JPEG."""

from __future__ import annotations

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from simbench.scenarios.schema import Imaging

__all__ = ["simulate_sensor"]

_READ_SHARE = 0.25
"""Share of the noise variance at zero light; the rest grows with the signal."""


def simulate_sensor(
    image: NDArray[np.uint8], imaging: Imaging, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Apply lens, sensor and compression to an image.

    In this order: lens blur, low resolution, exposure (a gain on the linear light, by
    a display gamma of 2.2), contrast (about the mean level of each channel; before the
    noise, so that low contrast lowers the signal-to-noise ratio), noise (Gaussian, its
    variance growing with the signal as that of photon noise), JPEG.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        Not written into.
    imaging : Imaging
    rng : numpy.random.Generator
        Source of the noise, a separate one for each frame.

    Returns
    -------
    (H, W, 3) uint8, RGB
    """
    if imaging.blur_px > 0.0:
        blurred = cv2.GaussianBlur(image, (0, 0), imaging.blur_px)
        image = np.asarray(blurred, np.uint8)
    if imaging.downscale > 1.0:
        image = _reduce_resolution(image, imaging.downscale)
    levels = np.arange(256) / 255.0
    if imaging.exposure != 1.0:
        light = np.clip(levels**2.2 * imaging.exposure, 0.0, 1.0)
        image = np.rint(light ** (1 / 2.2) * 255.0).astype(np.uint8)[image]
    if imaging.contrast != 1.0:
        mean = image.mean(axis=(0, 1))
        table = mean + imaging.contrast * (np.arange(256)[:, None] - mean)
        table = np.clip(np.rint(table), 0, 255).astype(np.uint8)
        image = np.stack([table[image[..., n], n] for n in range(3)], axis=-1)
    if imaging.noise > 0.0:
        spread = imaging.noise * np.sqrt(_READ_SHARE + (1.0 - _READ_SHARE) * levels)
        scale = (255.0 * spread).astype(np.float32)
        normals = rng.standard_normal(image.shape, dtype=np.float32)
        image = np.asarray(_add_noise(np.ascontiguousarray(image), normals, scale))
    if imaging.jpeg_quality is not None:
        image = _compress(image, imaging.jpeg_quality)
    return image


@numba.njit(cache=True)
def _add_noise(image, normals, scale):  # type: ignore[no-untyped-def]  # compiled
    """Add float32 normals times the (256,) float32 spread of each level, and round.

    NumPy draws the normals: about one in 1e8 of numba's own differs, and all after it.
    """
    levels, parts = image.ravel(), normals.ravel()
    noisy = np.empty_like(levels)
    for index in range(levels.size):
        level = levels[index]
        value = np.rint(np.float32(level) + parts[index] * scale[level])
        noisy[index] = np.uint8(min(max(value, np.float32(0)), np.float32(255)))
    return noisy.reshape(image.shape)


def _reduce_resolution(image: NDArray[np.uint8], factor: float) -> NDArray[np.uint8]:
    """Scale an image down by a factor and up again to its size."""
    height, width = image.shape[:2]
    small = (max(1, round(width / factor)), max(1, round(height / factor)))
    reduced = cv2.resize(image, small, interpolation=cv2.INTER_AREA)
    enlarged = cv2.resize(reduced, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(enlarged, np.uint8)


def _compress(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Encode an image as JPEG and decode it again."""
    bgr = cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    _, code = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    decoded = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
    return np.asarray(cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB), np.uint8)
