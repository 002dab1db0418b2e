"""Search for the size of an occluder: the share it hides, and for how many frames."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simbench.generation.dials.occlusion_timing import OcclusionEvent
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.achieved_dials import occlusions_of

__all__ = ["metres_per_pixel", "occluded_frames", "peak_hidden", "smallest_sufficient"]

_BLOCK = 6  # frames rendered at a time


def smallest_sufficient(
    measure: Callable[[float], float],
    expected: float,
    low: float,
    high: float,
    *,
    doublings: int = 3,
    halvings: int = 9,
) -> float | None:
    """Find by bisection the smallest size whose measure reaches a value.

    Parameters
    ----------
    measure : callable of size
        Grows with the size.
    expected : float
    low, high : float
        Range of the search; ``high`` is doubled up to ``doublings`` times.
    halvings : int
        The result is exact to the range over 2 to this power.

    Returns
    -------
    float or None
        None where the greatest size is not enough.
    """
    for _ in range(doublings + 1):
        if measure(high) >= expected:
            break
        low, high = high, 2.0 * high
    else:
        return None
    for _ in range(halvings):
        middle = (low + high) / 2.0
        if measure(middle) >= expected:
            high = middle
        else:
            low = middle
    return high


def peak_hidden(probe: OcclusionProbe, event: OcclusionEvent, reach: int = 1) -> float:
    """Return the greatest hidden share within ``reach`` frames of an event's middle.

    Of a long reach only some frames are rendered: the first, the last and a few
    between.
    """
    first = max(0, event.frame - reach)
    last = min(len(probe.boxes) - 1, event.frame + reach)
    frames = sorted(
        {round(float(f)) for f in np.linspace(first, last, 7)} | {event.frame}
    )
    return float(np.nanmax(probe.hidden([event.occluder], frames, first=event.number)))


def occluded_frames(probe: OcclusionProbe, event: OcclusionEvent, peak: float) -> float:
    """Return for how many frames more than half of a peak share is hidden."""
    count = len(probe.boxes)
    shares = np.full(count, np.nan)
    for step, start in ((-1, event.frame - 1), (1, event.frame)):
        while 0 <= start < count:
            block = [
                f for f in range(start, start + _BLOCK * step, step) if 0 <= f < count
            ]
            shares[block] = probe.hidden([event.occluder], block, first=event.number)
            if not shares[block[-1]] > peak / 2.0:
                break
            start += _BLOCK * step
    return occlusions_of(np.where(shares > peak / 2.0, shares, 0.0)).frames


def metres_per_pixel(probe: OcclusionProbe, event: OcclusionEvent) -> float:
    """Return the length [m] that one pixel of the picture has at an occluder."""
    camera = probe.stage.cameras[event.frame]
    (placed,) = probe.placed([event.occluder])
    middle = placed.base + np.array([0.0, 0.0, placed.sight_height or 0.0])
    return float(camera.to_camera(middle[None])[0, 2]) / camera.focal_px
