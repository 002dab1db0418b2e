"""What the sensor does to the picture: exposure, blur, lost detail, noise, JPEG."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.scenarios.schema import Imaging

__all__ = ["expose"]

_READ_SHARE = 0.25
"""Share of the noise variance that is there in the dark; the rest grows with light."""


def expose(
    image: NDArray[np.uint8], imaging: Imaging, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return the picture as the sensor and the file give it.

    In this order: lens blur, detail lost to low resolution, exposure (a gain on the
    light, undone and redone through the display gamma of 2.2), contrast (about the mean
    level of each channel: what veils a picture does so before the sensor's noise, which
    then weighs more), noise (Gaussian, its variance growing with the signal as photon
    noise does), JPEG.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        Not written into.
    imaging : Imaging
    rng : numpy.random.Generator
        Source of the noise; one a frame, so that no frame depends on another.

    Returns
    -------
    (H, W, 3) uint8, RGB
    """
    picture = image
    if imaging.blur_px > 0.0:
        blurred = cv2.GaussianBlur(picture, (0, 0), imaging.blur_px)
        picture = np.asarray(blurred, np.uint8)
    if imaging.downscale > 1.0:
        picture = _lose_detail(picture, imaging.downscale)
    if imaging.exposure != 1.0:
        levels = (np.arange(256) / 255.0) ** 2.2 * imaging.exposure
        table = np.clip(levels, 0.0, 1.0) ** (1 / 2.2) * 255.0
        picture = np.rint(table).astype(np.uint8)[picture]
    if imaging.contrast != 1.0:
        picture = _veil(picture, imaging.contrast)
    if imaging.noise > 0.0:
        levels = np.arange(256) / 255.0
        spread = imaging.noise * np.sqrt(_READ_SHARE + (1.0 - _READ_SHARE) * levels)
        scale = (255.0 * spread).astype(np.float32)[picture]
        grain = rng.standard_normal(picture.shape, dtype=np.float32)
        noisy = picture + grain * scale
        picture = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    if imaging.jpeg_quality is not None:
        picture = _compress(picture, imaging.jpeg_quality)
    return picture


def _veil(picture: NDArray[np.uint8], contrast: float) -> NDArray[np.uint8]:
    mean = picture.mean(axis=(0, 1))
    levels = np.arange(256)[:, None]
    table = np.clip(np.rint(mean + contrast * (levels - mean)), 0, 255)
    veiled = [
        table[:, channel].astype(np.uint8)[picture[..., channel]]
        for channel in range(3)
    ]
    return np.stack(veiled, axis=-1)


def _lose_detail(picture: NDArray[np.uint8], factor: float) -> NDArray[np.uint8]:
    height, width = picture.shape[:2]
    small = (max(1, round(width / factor)), max(1, round(height / factor)))
    reduced = cv2.resize(picture, small, interpolation=cv2.INTER_AREA)
    back = cv2.resize(reduced, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(back, np.uint8)


def _compress(picture: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    _, code = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, quality])
    decoded = np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), np.uint8)
    return np.asarray(cv2.cvtColor(decoded, cv2.COLOR_BGR2RGB), np.uint8)
