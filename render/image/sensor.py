"""Sensor model: blur, low resolution, exposure, contrast, noise and JPEG."""

from __future__ import annotations

import math

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from simbench.scenarios.schema import Imaging

__all__ = ["Sensor"]

_READ_SHARE = 0.25
"""Share of the noise variance at zero light; the rest grows with the signal."""
_TILE = 1 << 20
"""Standard normals that a sensor draws, once; must exceed the levels of a row."""


class Sensor:
    """A lens, sensor and compression, applied to image after image.

    In this order: lens blur, low resolution, exposure (a gain on the linear light, by
    a display gamma of 2.2), contrast (about the mean level of each channel; before the
    noise, so that low contrast lowers the signal-to-noise ratio), noise (Gaussian, its
    variance growing with the signal as that of photon noise), JPEG.

    Noise is drawn once, as a tile of 2**20 normals: drawing as many as a frame has
    levels would take several times as long as adding them. The noise of each row of
    each frame is the sum of two parts of the tile, from random places on and with
    random signs, over the square root of 2. Sums of normals are normal, the signs make
    the expected correlation of any two levels 0, and of 1e5 rows two are equal with a
    probability of 1 %.

    Parameters
    ----------
    imaging : Imaging
    rng : numpy.random.Generator
        Source of the tile, the same for all images of a sequence.
    """

    def __init__(self, imaging: Imaging, rng: np.random.Generator) -> None:
        self._imaging = imaging
        self._tile = np.zeros(0, np.float32)
        if imaging.noise > 0.0:
            tile = rng.standard_normal(_TILE, dtype=np.float32)
            self._tile = tile / tile.std()

    def expose(
        self, image: NDArray[np.uint8], rng: np.random.Generator
    ) -> NDArray[np.uint8]:
        """Return an image as the sensor gives it.

        Parameters
        ----------
        image : (H, W, 3) uint8, RGB
            Not written into.
        rng : numpy.random.Generator
            Source of the places in the tile, a separate one for each frame.

        Returns
        -------
        (H, W, 3) uint8, RGB
        """
        imaging = self._imaging
        if imaging.blur_px > 0.0:
            blurred = cv2.GaussianBlur(image, (0, 0), imaging.blur_px)
            image = np.asarray(blurred, np.uint8)
        if imaging.downscale > 1.0:
            image = _reduce_resolution(image, imaging.downscale)
        levels = np.arange(256) / 255.0
        if imaging.exposure != 1.0:
            light = np.clip(levels**2.2 * imaging.exposure, 0.0, 1.0)
            table = np.rint(light ** (1 / 2.2) * 255.0).astype(np.uint8)
            image = np.asarray(cv2.LUT(image, table), np.uint8)
        if imaging.contrast != 1.0:
            mean = image.mean(axis=(0, 1))
            table = mean + imaging.contrast * (np.arange(256)[:, None] - mean)
            table = np.clip(np.rint(table), 0, 255).astype(np.uint8)
            image = np.stack([table[image[..., n], n] for n in range(3)], axis=-1)
        if imaging.noise > 0.0:
            spread = imaging.noise * np.sqrt(_READ_SHARE + (1.0 - _READ_SHARE) * levels)
            image = self._add_noise(image, (255.0 * spread).astype(np.float32), rng)
        if imaging.jpeg_quality is not None:
            image = _compress(image, imaging.jpeg_quality)
        return image

    def _add_noise(
        self,
        image: NDArray[np.uint8],
        scale: NDArray[np.float32],
        rng: np.random.Generator,
    ) -> NDArray[np.uint8]:
        """Add noise with the spread of each level, (256,)."""
        rows = np.ascontiguousarray(image).reshape(len(image), -1)
        last = len(self._tile) - rows.shape[1]
        starts = rng.integers(0, last, (len(rows), 2), endpoint=True)
        signs = rng.choice(np.array([-1.0, 1.0], np.float32), (len(rows), 2))
        noisy = _add_rows_of_noise(rows, self._tile, starts, signs, scale)
        return np.asarray(noisy).reshape(image.shape)


@numba.njit(cache=True)
def _add_rows_of_noise(rows, tile, starts, signs, scale):  # type: ignore[no-untyped-def]
    """Add to each row two parts of a tile times signs and spread of each level; round.

    Compiled by numba; rows are (H, N) uint8, starts and signs (H, 2), and scale is
    (256,) float32.
    """
    noisy = np.empty_like(rows)
    for row in range(rows.shape[0]):
        one, other = starts[row]
        shared = signs[row, 0] * signs[row, 1]
        signed = signs[row, 0] * np.float32(math.sqrt(0.5)) * scale
        for index in range(rows.shape[1]):
            level = rows[row, index]
            normal = tile[one + index] + shared * tile[other + index]
            value = np.rint(np.float32(level) + normal * signed[level])
            value = min(max(value, np.float32(0)), np.float32(255))
            noisy[row, index] = np.uint8(value)
    return noisy


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
