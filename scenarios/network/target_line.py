"""The path of a target through a network, as the line that road coordinates use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from simbench.scenarios.geometry.line import Line
from simbench.scenarios.highway.tractrix import body_poses
from simbench.scenarios.network.recording import RecordedVehicle

__all__ = ["target_line"]

_STEP_M = 1.0
_SMOOTH_M = 8.0
_MARGIN_M = 600.0  # extension before the start and after the end of the path


def target_line(vehicle: RecordedVehicle, origin: NDArray[np.float64]) -> Line:
    """Return the path of a vehicle as a line, extended straight at both ends.

    Parameters
    ----------
    vehicle : RecordedVehicle
    origin : (3,) float, m
        Of the road frame on the network, where the line's ``along`` is 0.
    """
    centre, headings, _ = body_poses(
        vehicle.smooth_front[:, None],
        vehicle.heading[:, None],
        vehicle.slope[:, None],
        np.array([vehicle.length]),
    )
    path = centre[:, 0] - origin
    has_moved = np.linalg.norm(np.diff(path, axis=0), axis=1) > 1e-3
    path = path[np.concatenate([[True], has_moved])]
    first, last = (
        _MARGIN_M * np.array([np.cos(heading), np.sin(heading), 0.0])
        for heading in headings[[0, -1], 0]
    )
    path = np.concatenate([[path[0] - first], path, [path[-1] + last]])
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(lengths)])
    along = np.arange(0.0, arc[-1], _STEP_M)
    points = np.stack([np.interp(along, arc, part) for part in path.T], axis=1)
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
