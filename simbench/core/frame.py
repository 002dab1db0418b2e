"""One image of a sequence, as a tracker receives it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Frame"]


@dataclass(frozen=True, slots=True)
class Frame:
    """One image with its time and index.

    Attributes
    ----------
    image : (H, W, 3) uint8, RGB
        Read-only.
    time_s : float, s
        Time since the first frame of the sequence; uneven where frames were dropped.
    index : int
        0-based position in the sequence.

    Examples
    --------
    >>> import numpy as np
    >>> from simbench import Frame
    >>> image = np.zeros((120, 160, 3), dtype=np.uint8)
    >>> Frame(image, time_s=0.04, index=1).index
    1
    """

    image: NDArray[np.uint8]
    time_s: float
    index: int
