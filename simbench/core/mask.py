"""Run-length encoded instance masks, compact enough for every vehicle and frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Mask"]


@dataclass(frozen=True, slots=True)
class Mask:
    """A binary mask over an image, run-length encoded row by row.

    Attributes
    ----------
    counts : (R,) int64
        Lengths of alternating runs in row-major order, the first of zeros (possibly
        of length 0).
    height, width : int, px
        Size of the image.
    """

    counts: NDArray[np.int64]
    height: int
    width: int

    @classmethod
    def from_array(cls, pixels: NDArray[np.bool_]) -> Mask:
        """Encode an (H, W) bool array.

        Examples
        --------
        >>> Mask.from_array(np.array([[False, True], [True, False]])).counts.tolist()
        [1, 2, 1]
        """
        height, width = pixels.shape
        flat = pixels.ravel()
        edges = np.flatnonzero(np.diff(flat)) + 1
        bounds = np.concatenate([[0], edges, [flat.size]])
        counts = np.diff(bounds).astype(np.int64)
        if flat.size and flat[0]:
            counts = np.concatenate([np.zeros(1, np.int64), counts])
        return cls(counts, height, width)

    def to_array(self) -> NDArray[np.bool_]:
        """Decode to an (H, W) bool array."""
        values = np.arange(len(self.counts)) % 2 == 1
        return np.repeat(values, self.counts).reshape(self.height, self.width)

    @property
    def pixel_count(self) -> int:
        """Number of pixels set."""
        return int(self.counts[1::2].sum())
