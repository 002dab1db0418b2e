"""The automatic exposure: a gain that follows the light, late, as a camera's does."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["AutoExposure"]

_LEAST, _MOST = 1.0 / 64.0, 64.0
_DARK = 1e-5


class AutoExposure:
    """Keeps the mean light of the pictures at that of the first.

    Each picture is measured as it was taken; the next is taken with a gain that has
    gone a share ``1 - exp(-t / time constant)`` of the way, on a logarithmic scale,
    to what would have given this one the first one's mean. So pictures brighten and
    darken after the light has changed, and nothing depends on what is still to come.

    Parameters
    ----------
    time_constant_s : float or None, s
        None keeps the gain at 1.

    Attributes
    ----------
    gain : float
        Factor on the light of the next picture; 1 for the first.
    """

    def __init__(self, time_constant_s: float | None) -> None:
        self._time_constant_s = time_constant_s
        self._wanted: float | None = None
        self.gain = 1.0

    def measure(self, image: NDArray[np.uint8], next_in_s: float) -> None:
        """Take in a picture, (H, W, 3) uint8, and the time to the next one [s]."""
        if self._time_constant_s is None:
            return
        levels = (np.arange(256) / 255.0) ** 2.2
        counts = np.bincount(image.ravel(), minlength=256)
        mean = max(float(counts @ levels) / image.size, _DARK)
        if self._wanted is None:
            self._wanted = mean
        step = 1.0 - math.exp(-next_in_s / self._time_constant_s)
        gain = self.gain * (self._wanted / mean) ** step
        self.gain = min(max(gain, _LEAST), _MOST)
