"""Automatic exposure: a gain that follows the scene's light with a time constant."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["AutoExposure"]

_MIN_GAIN, _MAX_GAIN = 1.0 / 64.0, 64.0
_MIN_LIGHT = 1e-5  # avoids division by zero


class AutoExposure:
    """Controls the gain so that the mean light of the images stays that of the first.

    After each image the logarithm of the gain moves by a share
    ``1 - exp(-t / time constant)`` towards the value that would have given this image
    the mean of the first: the control is causal and lags behind changes of the light.

    Parameters
    ----------
    time_constant_s : float or None, s
        None keeps the gain at 1.

    Attributes
    ----------
    gain : float
        Factor on the light of the next image; 1 for the first.
    """

    def __init__(self, time_constant_s: float | None) -> None:
        self._time_constant_s = time_constant_s
        self._setpoint: float | None = None
        self.gain = 1.0

    def measure(self, image: NDArray[np.uint8], next_in_s: float) -> None:
        """Update the gain from an (H, W, 3) uint8 image and the time to the next."""
        if self._time_constant_s is None:
            return
        levels = (np.arange(256) / 255.0) ** 2.2
        counts = np.bincount(image.ravel(), minlength=256)
        mean = max(float(counts @ levels) / image.size, _MIN_LIGHT)
        if self._setpoint is None:
            self._setpoint = mean
        step = 1.0 - math.exp(-next_in_s / self._time_constant_s)
        gain = self.gain * (self._setpoint / mean) ** step
        self.gain = min(max(gain, _MIN_GAIN), _MAX_GAIN)
