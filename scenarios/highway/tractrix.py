"""Smooth body poses from a vehicle's front: the tractrix of its rear axle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from simbench.scenarios.time_step import STEP_S

__all__ = ["body_poses"]

_WHEELBASE = 0.8
"""Distance from the front bumper to the rear axle, as a share of the length."""
_SHORTEST_M = 1.2
_JUMP_M = 15.0


def body_poses(
    front: NDArray[np.float64],
    heading: NDArray[np.float64],
    slope: NDArray[np.float64],
    lengths: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return smooth poses of vehicles from SUMO's fronts, headings and slopes.

    SUMO's lanes are polylines, and its headings jump at their corners. The rear axle
    of a real car does not slide sideways: it follows the front along a tractrix, so
    the body turns smoothly whatever the front does.

    Parameters
    ----------
    front : (T, V, 3) float, m
        Front bumpers; NaN while a vehicle is absent.
    heading : (T, V) float, rad
        Used where a body appears, or has jumped.
    slope : (T, V) float, rad
    lengths : (V,) float, m

    Returns
    -------
    centre : (T, V, 3) float, m
        Middle of the footprint, half a length behind the front.
    heading : (T, V) float, rad
        Continuous across +-pi; NaN where ``front`` is.
    pitch : (T, V) float, rad
        The slope, averaged over a second.
    """
    heading = _tractrix_headings(front, heading, lengths)
    pitch = _smooth_slope(slope)
    ahead = np.stack(
        [
            np.cos(pitch) * np.cos(heading),
            np.cos(pitch) * np.sin(heading),
            np.sin(pitch),
        ],
        axis=-1,
    )
    return front - ahead * (lengths / 2.0)[:, None], heading, pitch


def _tractrix_headings(
    front: NDArray[np.float64],
    heading: NDArray[np.float64],
    lengths: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the headings of bodies whose rear axles are towed by their fronts."""
    base = np.maximum(lengths * _WHEELBASE, _SHORTEST_M)
    headings = np.full(heading.shape, np.nan)
    rear = np.full((front.shape[1], 2), np.nan)
    now = np.full(front.shape[1], np.nan)
    for step, (places, initial) in enumerate(zip(front[..., :2], heading, strict=True)):
        present = ~np.isnan(places[:, 0])
        pull = places - rear
        distance = np.hypot(pull[:, 0], pull[:, 1])
        follows = present & (np.abs(distance - base) < _JUMP_M)
        towards = np.arctan2(pull[:, 1], pull[:, 0])
        change = (towards - now + np.pi) % (2.0 * np.pi) - np.pi
        now = np.where(follows, now + change, np.where(present, initial, np.nan))
        rear = places - base[:, None] * np.stack([np.cos(now), np.sin(now)], axis=-1)
        headings[step] = now
    return headings


def _smooth_slope(slope: NDArray[np.float64]) -> NDArray[np.float64]:
    """Average a slope over a second; SUMO's jumps from one piece to the next."""
    known = ~np.isnan(slope)
    kernel = np.ones(round(1.0 / STEP_S))
    total = convolve1d(np.where(known, slope, 0.0), kernel, axis=0, mode="constant")
    count = convolve1d(known.astype(np.float64), kernel, axis=0, mode="constant")
    return np.where(known, total / np.maximum(count, 1.0), np.nan)
