"""One picture of a sequence, as a tracker gets it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Frame"]


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture and when it was taken.

    Attributes
    ----------
    image : (H, W, 3) uint8, RGB
        Read-only.
    time_s : float, s
        Time since the first frame of the sequence; frame dropping shows here.
    index : int
        0-based position in the sequence.
    """

    image: NDArray[np.uint8]
    time_s: float
    index: int
