"""Windows, rectangles of samples or texels, merged where that saves work."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["Window", "merged_windows"]

Window = tuple[int, int, int, int]
"""Left, top, right and bottom of a part of the samples, the last two exclusive."""


def merged_windows(windows: NDArray[np.int64], extra: int) -> list[Window]:
    """Merge windows in pairs while that covers less than ``extra`` samples more.

    Parameters
    ----------
    windows : (N, 4) int
        None of them empty.
    extra : int
        Samples that cost as much as a window of their own.
    """
    merged = _merged(windows, extra)
    return [(left, top, right, low) for left, top, right, low in merged.tolist()]


@numba.njit(cache=True)
def _merged(windows, extra):  # type: ignore[no-untyped-def]  # compiled by numba
    kept = windows.copy()
    count = len(kept)
    while count > 1:
        best, first, second = extra, -1, -1
        for one in range(count):
            for other in range(one):
                a, b = kept[one], kept[other]
                wide = max(a[2], b[2]) - min(a[0], b[0])
                high = max(a[3], b[3]) - min(a[1], b[1])
                more = wide * high - (a[2] - a[0]) * (a[3] - a[1])
                more -= (b[2] - b[0]) * (b[3] - b[1])
                if more < best:
                    best, first, second = more, one, other
        if first < 0:
            break
        a, b = kept[first].copy(), kept[second]
        b[0], b[1] = min(a[0], b[0]), min(a[1], b[1])
        b[2], b[3] = max(a[2], b[2]), max(a[3], b[3])
        count -= 1
        kept[first] = kept[count]
    return kept[:count]
