"""Extents, pixel ids and masks of the objects in an image of instance ids."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from simbench.core.mask import Mask

__all__ = ["extents", "pixel_ids", "vehicle_masks"]


@numba.njit(cache=True)
def extents(ids, first, count):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return sample count and extent of the ids ``first`` to ``first + count - 1``.

    They are (count, 5) int64: samples, low x, low y, high x, high y (inclusive).
    """
    found = np.zeros((count, 5), np.int64)
    found[:, 1] = ids.shape[1]
    found[:, 2] = ids.shape[0]
    found[:, 3:] = -1
    for y in range(ids.shape[0]):
        for x in range(ids.shape[1]):
            index = np.int64(ids[y, x]) - first
            if 0 <= index < count:
                row = found[index]
                row[0] += 1
                row[1] = min(row[1], x)
                row[2] = min(row[2], y)
                row[3] = max(row[3], x)
                row[4] = max(row[4], y)
    return found


@numba.njit(cache=True)
def _majority(ids, samples):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return the most frequent id of each block; of a tie, the first."""
    height, width = ids.shape[0] // samples, ids.shape[1] // samples
    chosen = np.empty((height, width), ids.dtype)
    for y in range(height):
        for x in range(width):
            best, most = ids[y * samples, x * samples], 0
            is_uniform = True  # of nearly all blocks
            for v in range(samples):
                for u in range(samples):
                    is_uniform &= ids[y * samples + v, x * samples + u] == best
            if is_uniform:
                chosen[y, x] = best
                continue
            for v in range(samples * samples):
                one = ids[y * samples + v // samples, x * samples + v % samples]
                same = 0
                for w in range(samples * samples):
                    other = ids[y * samples + w // samples, x * samples + w % samples]
                    same += one == other
                if same > most:
                    best, most = one, same
            chosen[y, x] = best
    return chosen


@numba.njit(cache=True)
def _majority_of_four(ids, samples):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return the same for blocks of two by two, faster."""
    height, width = ids.shape[0] // samples, ids.shape[1] // samples
    chosen = np.empty((height, width), ids.dtype)
    for y in range(height):
        upper, lower = ids[2 * y], ids[2 * y + 1]
        for x in range(width):
            a, b, c, d = upper[2 * x], upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]
            if a == b or a == c or a == d:
                chosen[y, x] = a
            elif b == c or b == d:
                chosen[y, x] = b
            else:
                chosen[y, x] = c if c == d else a
    return chosen


def pixel_ids(ids: NDArray[np.uint16], samples: int) -> NDArray[np.uint16]:
    """Reduce ids at the samples to one id for each pixel, the most frequent one.

    Parameters
    ----------
    ids : (S H, S W) uint16
    samples : int
        S, samples a pixel along each axis.

    Returns
    -------
    (H, W) uint16
        Every value occurs among the samples of the pixel.
    """
    if samples == 1:
        return ids
    find = _majority_of_four if samples == 2 else _majority
    chosen: NDArray[np.uint16] = find(ids, samples)
    return chosen


@numba.njit(cache=True)
def _run_starts(flat):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return where the runs of equal values begin."""
    starts = np.empty(len(flat), np.int64)
    starts[0] = 0
    count = 1
    for index in range(1, len(flat)):
        if flat[index] != flat[index - 1]:
            starts[count] = index
            count += 1
    return starts[:count].copy()


def vehicle_masks(ids: NDArray[np.uint16], first: int, count: int) -> dict[int, Mask]:
    """Encode the masks of the ids ``first`` to ``first + count - 1`` in an image.

    One pass over the runs of the image serves all of them.

    Parameters
    ----------
    ids : (H, W) uint16
    first, count : int

    Returns
    -------
    dict from int to Mask
        By id, for those that occur.
    """
    height, width = ids.shape
    flat = ids.ravel()
    starts = np.asarray(_run_starts(flat))
    ends = np.concatenate([starts[1:], [flat.size]])
    owner = flat[starts].astype(np.int64)
    masks = {}
    for identity in np.unique(owner[(owner >= first) & (owner < first + count)]):
        chosen = owner == identity
        edges = np.stack([starts[chosen], ends[chosen]], axis=1).ravel()
        counts = np.diff(np.concatenate([[0], edges, [flat.size]]))
        if counts[-1] == 0:
            counts = counts[:-1]
        masks[int(identity)] = Mask(counts.astype(np.int64), height, width)
    return masks
