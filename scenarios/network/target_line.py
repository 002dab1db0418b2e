"""The way of a target through a network, as a line along which places are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from simbench.scenarios.geometry.line import Line
from simbench.scenarios.highway.tractrix import body_centre, calm_slope, towed
from simbench.scenarios.network.recording import Drive

__all__ = ["target_line"]

_STEP_M = 1.0
_SMOOTH_M = 8.0
_MARGIN_M = 600.0  # as far as places may lie before its way begins and after its end


def target_line(drive: Drive, origin: NDArray[np.float64]) -> Line:
    """Return the way of a vehicle as a line, drawn out straight at both ends.

    Parameters
    ----------
    drive : Drive
    origin : (3,) float, m
        Of the road frame on the network, where the line's ``along`` is 0.
    """
    lengths = np.array([drive.look.length])
    front = drive.eased_front[:, None]
    heading = towed(front, drive.heading[:, None], lengths)
    pitch = calm_slope(drive.slope[:, None])
    way = body_centre(front, heading, pitch, lengths)[:, 0] - origin
    moved = np.concatenate(
        [[True], np.linalg.norm(np.diff(way, axis=0), axis=1) > 1e-3]
    )
    way = _drawn_out(way[moved], float(heading[0, 0]), float(heading[-1, 0]))
    arc = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))]
    )
    along = np.arange(0.0, arc[-1], _STEP_M)
    points = np.stack(
        [np.interp(along, arc, way[:, axis]) for axis in range(3)], axis=1
    )
    points = uniform_filter1d(points, round(_SMOOTH_M / _STEP_M), axis=0)
    step = np.gradient(points, _STEP_M, axis=0)
    line = Line(
        along=along,
        x=points[:, 0],
        y=points[:, 1],
        z=points[:, 2],
        heading=np.unwrap(np.arctan2(step[:, 1], step[:, 0])),
        pitch=np.arctan2(step[:, 2], np.hypot(step[:, 0], step[:, 1])),
        map_origin=(float(origin[0]), float(origin[1]), float(origin[2])),
    )
    return replace(line, along=along - line.locate(np.zeros((1, 3)))[0, 0])


def _drawn_out(
    way: NDArray[np.float64], first_rad: float, last_rad: float
) -> NDArray[np.float64]:
    """Lengthen a way straight at both ends."""
    out = _MARGIN_M
    before = way[0] - out * np.array([np.cos(first_rad), np.sin(first_rad), 0.0])
    after = way[-1] + out * np.array([np.cos(last_rad), np.sin(last_rad), 0.0])
    return np.concatenate([before[None], way, after[None]])
