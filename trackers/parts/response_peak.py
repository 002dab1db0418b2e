"""The peak of a response of a Siamese network, with a preference for small motions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.siamese_network import RESPONSE_SIDE, STRIDE

__all__ = ["ResponsePeak", "finer_response"]

FINER: Final = 8  # responses are interpolated to so many times as many


@dataclass(frozen=True, slots=True)
class ResponsePeak:
    """Finds the peak of a response.

    Parameters
    ----------
    window : float, in [0, 1]
        Weight of a cosine window in the response.

    References
    ----------
    Bertinetto et al., "Fully-convolutional Siamese networks for object tracking", ECCV
    workshops 2016, section 3.1; the sum of response and window is that of the
    authors' code.
    """

    window: float
    _cosine: NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Compute the window."""
        cosine = np.hanning(FINER * RESPONSE_SIDE)
        window = np.outer(cosine, cosine) / cosine.sum() ** 2
        object.__setattr__(self, "_cosine", window)

    def __call__(self, response: NDArray[np.float32]) -> tuple[float, float]:
        """Return how far right and down of the middle the peak is, in samples.

        Parameters
        ----------
        response : (17, 17) float32
        """
        finer = finer_response(response).astype(np.float64)
        finer -= finer.min()
        finer /= max(float(finer.sum()), 1e-9)
        finer = (1.0 - self.window) * finer + self.window * self._cosine
        row, column = divmod(int(finer.argmax()), finer.shape[1])
        middle = (FINER * RESPONSE_SIDE - 1) / 2.0
        step = STRIDE / FINER
        return step * (column - middle), step * (row - middle)


def finer_response(response: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a response, interpolated to 8 times as many places along each side."""
    side = FINER * RESPONSE_SIDE
    finer = cv2.resize(response, (side, side), interpolation=cv2.INTER_CUBIC)
    return np.asarray(finer, np.float32)
