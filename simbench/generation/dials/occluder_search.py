"""Trying an occluder out: how much of the target it hides, and for how long."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.achieved_dials import occlusions_of
from simbench.scenarios.schema import Occluder

__all__ = ["lasts_of", "least", "peak_of", "scale_m"]

_STRETCH = 6  # frames tried at a time


def least(
    measure: Callable[[float], float],
    wanted: float,
    low: float,
    high: float,
    *,
    widen: int = 3,
    halvings: int = 9,
) -> float | None:
    """Return the least size whose measure, which grows with it, is as wanted.

    Parameters
    ----------
    measure : callable of size
    wanted : float
    low, high : float
        Where to look; ``high`` is doubled up to ``widen`` times.
    halvings : int
        The answer is exact to the range over 2 to this power.

    Returns
    -------
    float or None
        None where the greatest size is not enough.
    """
    enough = measure(high) >= wanted
    for _ in range(widen):
        if enough:
            break
        low, high = high, 2.0 * high
        enough = measure(high) >= wanted
    if not enough:
        return None
    for _ in range(halvings):
        middle = (low + high) / 2.0
        if measure(middle) >= wanted:
            high = middle
        else:
            low = middle
    return high


def peak_of(
    rehearsal: OcclusionProbe,
    occluder: Occluder,
    number: int,
    frame: int,
    reach: int = 1,
) -> float:
    """Return the greatest hidden share within ``reach`` frames of a middle.

    Of a long reach only some frames are tried: the first, the last and a few between.
    The ``number`` of the occluder, from 0, is its place in the story.
    """
    last = len(rehearsal.boxes) - 1
    around = np.linspace(max(0, frame - reach), min(last, frame + reach), 7)
    frames = sorted({round(float(f)) for f in around} | {frame})
    return float(np.nanmax(rehearsal.hidden([occluder], frames, first=number)))


def lasts_of(
    rehearsal: OcclusionProbe, occluder: Occluder, number: int, frame: int, peak: float
) -> float:
    """Return for how many frames more than half of a peak share is hidden."""
    count = len(rehearsal.boxes)
    shares = np.full(count, np.nan)
    for step in (-1, 1):
        start = frame if step == 1 else frame - 1
        while 0 <= start < count:
            run = [f for f in range(start, start + _STRETCH * step, step)]
            run = [f for f in run if 0 <= f < count]
            shares[run] = rehearsal.hidden([occluder], run, first=number)
            if not shares[run[-1]] > peak / 2.0:
                break
            start += _STRETCH * step
    shares = np.where(shares > peak / 2.0, shares, 0.0)
    return occlusions_of(shares).frames


def scale_m(rehearsal: OcclusionProbe, occluder: Occluder, frame: int) -> float:
    """Return how many metres at an occluder's place one pixel of the picture is."""
    camera = rehearsal.stage.cameras[frame]
    placed = rehearsal.placed([occluder])[0]
    middle = placed.base + np.array([0.0, 0.0, placed.sight_height or 0.0])
    return float(camera.to_camera(middle[None])[0, 2]) / camera.focal_px
