"""How a vehicle's body follows its front: smoothly, whatever the front does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from simbench.scenarios.highway.bending import STEP_S

__all__ = ["body_centre", "calm_slope", "towed"]

_WHEELBASE = 0.8
"""Distance from the front bumper to the rear axle, as a share of the length."""
_LEAST_M = 1.2
_JUMP_M = 15.0


def towed(
    front: NDArray[np.float64],
    heading: NDArray[np.float64],
    lengths: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the headings of bodies whose rear axles are towed by their fronts.

    SUMO's lanes are polylines, and its headings jump at their corners. The rear axle
    of a real car does not slide sideways: it follows the front along a tractrix, and
    turns the body gently whatever the front does.

    Parameters
    ----------
    front : (T, V, 3) float, m
        Front bumpers; NaN while a vehicle is not there.
    heading : (T, V) float, rad
        Where a body points when it appears, or has jumped.
    lengths : (V,) float, m

    Returns
    -------
    (T, V) float, rad
        Without jumps at the turn of the circle; NaN where ``front`` is.
    """
    base = np.maximum(lengths * _WHEELBASE, _LEAST_M)
    turned = np.full(heading.shape, np.nan)
    rear = np.full((front.shape[1], 2), np.nan)
    now = np.full(front.shape[1], np.nan)
    for step, (places, told) in enumerate(zip(front[..., :2], heading, strict=True)):
        here = ~np.isnan(places[:, 0])
        pull = places - rear
        distance = np.hypot(pull[:, 0], pull[:, 1])
        known = here & (np.abs(distance - base) < _JUMP_M)
        towards = np.arctan2(pull[:, 1], pull[:, 0])
        change = (towards - now + np.pi) % (2.0 * np.pi) - np.pi
        now = np.where(known, now + change, np.where(here, told, np.nan))
        back = base[:, None] * np.stack([np.cos(now), np.sin(now)], axis=-1)
        rear = places - back
        turned[step] = now
    return turned


def calm_slope(slope: NDArray[np.float64]) -> NDArray[np.float64]:
    """Average a slope over a second; SUMO's changes at once from piece to piece."""
    known = ~np.isnan(slope)
    kernel = np.ones(round(1.0 / STEP_S))
    total = convolve1d(np.where(known, slope, 0.0), kernel, axis=0, mode="constant")
    count = convolve1d(known.astype(np.float64), kernel, axis=0, mode="constant")
    calm: NDArray[np.float64] = np.where(known, total / np.maximum(count, 1.0), np.nan)
    return calm


def body_centre(
    front: NDArray[np.float64],
    heading: NDArray[np.float64],
    pitch: NDArray[np.float64],
    lengths: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the middles of the footprints, half a length behind the fronts."""
    ahead = np.stack(
        [
            np.cos(pitch) * np.cos(heading),
            np.cos(pitch) * np.sin(heading),
            np.sin(pitch),
        ],
        axis=-1,
    )
    middle: NDArray[np.float64] = front - ahead * (lengths / 2.0)[:, None]
    return middle
