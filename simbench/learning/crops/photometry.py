"""Changes of colour, light and sharpness of training pictures."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.learning.crops.crop_recipe import Photometry

__all__ = ["Tone", "change_picture", "sample_tone"]

Picture = NDArray[np.float32]

_LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)
_MIX = 0.12  # deviation of the entries of a mixing matrix
_JITTER = (0.85, 1.18)  # of gamma and contrast, between the pictures of a pair
_BRIGHTNESS_JITTER = 12.0  # grey levels
_KERNEL = 9  # samples of a motion blur's kernel


@dataclass(frozen=True, slots=True)
class Tone:
    """Colour and tone that the two pictures of a pair share.

    Attributes
    ----------
    mix : (3, 3) float32
        Factors from the channels to those of the result.
    gamma, contrast : float
    brightness : float
        Added grey levels.
    """

    mix: NDArray[np.float32]
    gamma: float
    contrast: float
    brightness: float


def sample_tone(settings: Photometry, rng: np.random.Generator) -> Tone:
    """Sample the colour and tone of a pair."""
    mix = np.eye(3, dtype=np.float32)
    if rng.random() < settings.channel_mix:
        order = rng.permutation(3) if rng.random() < 0.5 else np.arange(3)
        noise = rng.normal(0.0, _MIX, (3, 3))
        mix = ((np.eye(3) + noise)[order]).astype(np.float32)
    if rng.random() < settings.grey:
        mix = np.tile(_LUMINANCE, (3, 1))
    return Tone(
        mix,
        rng.uniform(*settings.gamma),
        rng.uniform(*settings.contrast),
        rng.uniform(-settings.brightness, settings.brightness),
    )


def change_picture(
    picture: NDArray[np.uint8],
    tone: Tone,
    settings: Photometry,
    rng: np.random.Generator,
) -> Picture:
    """Return a picture in another tone, light and sharpness.

    Parameters
    ----------
    picture : (S, S, 3) uint8, RGB
    tone : Tone
        Of the pair.
    settings : Photometry
    rng : numpy.random.Generator

    Returns
    -------
    (S, S, 3) float32
        In [0, 255].
    """
    changed = _toned(picture, tone, rng)
    if rng.random() < settings.light:
        changed *= _light(len(changed), rng)[:, :, None]
    if rng.random() < settings.blur:
        blurred = cv2.GaussianBlur(changed, (0, 0), rng.uniform(0.4, 1.8))
        changed = np.asarray(blurred, np.float32)
    if rng.random() < settings.motion_blur:
        changed = np.asarray(cv2.filter2D(changed, -1, _line_kernel(rng)), np.float32)
    if rng.random() < settings.shrink:
        changed = _shrunk(changed, rng.uniform(1.3, 3.0))
    if rng.random() < settings.noise:
        noise = rng.standard_normal(changed.shape, dtype=np.float32)
        changed += np.float32(rng.uniform(1.0, 12.0)) * noise
    np.clip(changed, 0.0, 255.0, out=changed)
    if rng.random() < settings.jpeg:
        changed = _compressed(changed, int(rng.uniform(15.0, 80.0)))
    return changed


def _toned(picture: NDArray[np.uint8], tone: Tone, rng: np.random.Generator) -> Picture:
    """Return a picture with mixed channels, gamma, contrast and brightness."""
    gamma = tone.gamma * rng.uniform(*_JITTER)
    contrast = tone.contrast * rng.uniform(*_JITTER)
    added = rng.uniform(-_BRIGHTNESS_JITTER, _BRIGHTNESS_JITTER)
    mixed = cv2.transform(picture, tone.mix)
    levels = np.arange(256, dtype=np.float32) / np.float32(255.0)
    table = np.float32(255.0) * levels ** np.float32(gamma)
    changed: Picture = np.asarray(cv2.LUT(mixed, table), np.float32)
    mean = float(changed.mean())
    changed -= np.float32(mean)
    changed *= np.float32(contrast)
    changed += np.float32(mean + tone.brightness + added)
    return changed


def _light(side: int, rng: np.random.Generator) -> Picture:
    """Return factors of a ramp of light or of a shadow with an edge, (S, S)."""
    angle = rng.uniform(0.0, 2.0 * math.pi)
    middle = np.arange(side, dtype=np.float32) / np.float32(side) - np.float32(0.5)
    distance = math.cos(angle) * middle[None, :] + math.sin(angle) * middle[:, None]
    distance = distance - rng.uniform(-0.3, 0.3)
    if rng.random() < 0.5:
        change = rng.uniform(0.2, 1.2) * distance
    else:
        change = rng.uniform(0.15, 0.5) * np.tanh(rng.uniform(5.0, 80.0) * distance)
    return np.asarray(1.0 + change, np.float32)


def _line_kernel(rng: np.random.Generator) -> Picture:
    """Return the kernel of a motion along a line, (9, 9)."""
    length, angle = rng.uniform(3.0, 8.0), rng.uniform(0.0, math.pi)
    kernel = np.zeros((_KERNEL, _KERNEL), np.float32)
    places = np.linspace(-length / 2.0, length / 2.0, 2 * _KERNEL - 1)
    rows = np.round(_KERNEL // 2 + places * math.sin(angle)).astype(np.int64)
    columns = np.round(_KERNEL // 2 + places * math.cos(angle)).astype(np.int64)
    kernel[rows, columns] = 1.0
    kernel /= kernel.sum()
    return kernel


def _shrunk(picture: Picture, factor: float) -> Picture:
    """Return a picture that has lost the detail between fewer samples."""
    side = len(picture)
    fewer = max(int(side / factor), 1)
    small = cv2.resize(picture, (fewer, fewer), interpolation=cv2.INTER_AREA)
    large = cv2.resize(small, (side, side), interpolation=cv2.INTER_LINEAR)
    return np.asarray(large, np.float32)


def _compressed(picture: Picture, quality: int) -> Picture:
    """Return a picture after compression as JPEG, of a quality in [0, 100]."""
    flags = [cv2.IMWRITE_JPEG_QUALITY, quality]
    _, encoded = cv2.imencode(".jpg", picture.astype(np.uint8), flags)
    return np.asarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR), np.float32)
