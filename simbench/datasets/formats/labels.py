"""The truth about the target as columns of text, one line a frame.

What GOT-10k and the VOT toolkit ask for beside the boxes: how much of the target is to
be seen, where it is absent or cut, and where trackers may be started.
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
_PLAIN_VIEW: Final = 0.7
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
        To a ten-thousandth of a pixel. Absent is ``0,0,0,0``: a box without area is
        what the VOT toolkit takes for known to be absent, and what trackers' loaders
        call invalid; NaN would end in their sums.
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
    """Return GOT-10k's cover label: how much of the target is to be seen, in eighths.

    Parameters
    ----------
    truth : Truth

    Returns
    -------
    (T,) int, in [0, 8]
        The visible fraction in eighths, rounded up: 0 only where nothing is visible,
        8 above seven eighths, so that hair-thin covers do not count. 8 where the
        fraction is unknown and the target is there.

    References
    ----------
    Huang, Zhao, Huang (2021), "GOT-10k: a large high-diversity benchmark for generic
    object tracking in the wild", IEEE TPAMI 43(5), which names the levels but not
    where they end.
    """
    share = np.where(np.isnan(truth.visible_fraction), 1.0, truth.visible_fraction)
    levels = np.ceil(_LEVELS * share).astype(np.int64)
    return np.where(truth.absent, 0, levels)


def occluded(truth: Truth) -> NDArray[np.bool_]:
    """Return where the target is there, but covered by an eighth or more, (T,) bool."""
    return ~truth.absent & (cover(truth) < _LEVELS)


def anchors(truth: Truth) -> NDArray[np.int64]:
    """Return where the multi-start experiment of VOT may start a tracker, and whither.

    Parameters
    ----------
    truth : Truth

    Returns
    -------
    (T,) int
        0 for no anchor, 1 for one from which more frames follow than went before, -1
        for the others, from which the sequence is run backwards. Anchors are the first
        frame, the last, and every 50th between, where the target is whole in the
        picture and in plain view; the first always is.

    References
    ----------
    Kristan et al. (2020), "The eighth visual object tracking VOT2020 challenge
    results", ECCV workshops, which also moves anchors by hand to where a target shows.
    """
    count = len(truth.absent)
    share = np.where(np.isnan(truth.visible_fraction), 1.0, truth.visible_fraction)
    fit = ~truth.absent & ~truth.cut_by_image & (share >= _PLAIN_VIEW)
    fit[:1] = True
    chosen = np.zeros(count, np.int64)
    for frame in {*range(0, count, _ANCHOR_SPACING), count - 1}:
        if fit[frame]:
            chosen[frame] = 1 if 2 * frame < count else -1
    return chosen
