"""Ground truth of the target as columns of text, one line a frame.

GOT-10k and the VOT toolkit require these beside the boxes: visibility, absence, and
where a tracker may be started.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Truth

__all__ = ["anchors", "box_lines", "column", "cover", "occluded"]

_LEVELS: Final = 8
"""Levels of GOT-10k's cover label above 0."""
_ANCHOR_SPACING: Final = 50
"""Frames between anchors, as in VOT2020."""
_MIN_VISIBLE: Final = 0.7
"""Least visible fraction where a tracker may be started."""


def box_lines(boxes: NDArray[np.float64]) -> str:
    """Return boxes as lines ``left,top,width,height``.

    Parameters
    ----------
    boxes : (T, 4) float, px
        NaN where the target is absent.

    Returns
    -------
    str
        To a ten-thousandth of a pixel. Absent is ``0,0,0,0``: the VOT toolkit takes a
        box without area as known to be absent and trackers' loaders as invalid, whereas
        NaN would spread into their sums.
    """
    rows = np.nan_to_num(boxes, nan=0.0).tolist()
    # 0.0 added: a box at -0.00001 must not read -0.0000
    return "".join(
        ",".join(f"{round(value, 4) + 0.0:.4f}" for value in row) + "\n" for row in rows
    )


def column(values: Iterable[object]) -> str:
    """Return values as text, one a line."""
    return "".join(f"{value}\n" for value in values)


def cover(truth: Truth) -> NDArray[np.int64]:
    """Return GOT-10k's cover label: the visible fraction of the target in eighths.

    Parameters
    ----------
    truth : Truth

    Returns
    -------
    (T,) int, in [0, 8]
        Rounded up: 0 only where nothing is visible, 8 above seven eighths, so that
        hair-thin occluders do not count. 8 where the fraction is unknown and the target
        is not absent.

    References
    ----------
    Huang, Zhao, Huang (2021), "GOT-10k: a large high-diversity benchmark for generic
    object tracking in the wild", IEEE TPAMI 43(5), which names the levels but not
    their bounds.
    """
    levels = np.ceil(_LEVELS * _visible_fraction(truth)).astype(np.int64)
    return np.where(truth.absent, 0, levels)


def occluded(truth: Truth) -> NDArray[np.bool_]:
    """Return where an eighth or more of a target that is not absent is hidden, (T,)."""
    return ~truth.absent & (cover(truth) < _LEVELS)


def anchors(truth: Truth) -> NDArray[np.int64]:
    """Return in which frames, and directions, VOT's multi-start may start a tracker.

    Parameters
    ----------
    truth : Truth

    Returns
    -------
    (T,) int
        0 for no anchor, 1 for an anchor in the first half of the sequence, -1 for one
        in the second, from which the sequence is run backwards. Anchors are the first
        frame, the last, and every 50th between, where the image does not cut the target
        and at least 70 % of it is visible; the first frame always is one.

    References
    ----------
    Kristan et al. (2020), "The eighth visual object tracking VOT2020 challenge
    results", ECCV workshops, which also moves anchors by hand to visible targets.
    """
    count = len(truth.absent)
    is_visible = _visible_fraction(truth) >= _MIN_VISIBLE
    fit = ~truth.absent & ~truth.cut_by_image & is_visible
    fit[:1] = True
    chosen = np.zeros(count, np.int64)
    for frame in {*range(0, count, _ANCHOR_SPACING), count - 1}:
        if fit[frame]:
            chosen[frame] = 1 if 2 * frame < count else -1
    return chosen


def _visible_fraction(truth: Truth) -> NDArray[np.float64]:
    """Return the visible fraction, 1 where it is unknown."""
    return np.where(np.isnan(truth.visible_fraction), 1.0, truth.visible_fraction)
