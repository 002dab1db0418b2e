"""Position in metres and speed in km/h of a target from its boxes and the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core import box
from simbench.core.sequence import Sequence

__all__ = ["RoadMotion", "road_motion", "road_points"]

_WINDOW_S: Final = 0.4  # time over which a speed is measured
_KMH: Final = 3.6
_Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RoadMotion:
    """Motion of the target on the road over T frames; NaN where it is not known.

    Attributes
    ----------
    position_error_m : (T,) float, m
        Distance on the road between the estimated and the true centre of the target.
    speed_kmh : (T,) float, km/h
        From the estimated boxes, over 0.4 s around each frame.
    truth_speed_kmh : (T,) float, km/h
    """

    position_error_m: _Floats
    speed_kmh: _Floats
    truth_speed_kmh: _Floats


def road_motion(boxes: _Floats, sequence: Sequence, times_s: _Floats) -> RoadMotion:
    """Return where boxes put the target on the road, and how fast, against the truth.

    Parameters
    ----------
    boxes : (T, 4) float, px
        Estimates; NaN where there is none.
    sequence : Sequence
        NaN is returned where it lacks cameras or vehicles.
    times_s : (T,) float, s

    Notes
    -----
    The ray through the centre of the box meets the horizontal plane at half the height
    of the target above the road; that of the true position, since a map of the road is
    assumed. The centre of a box is not quite the image of the centre of a vehicle, .6
    to 1.4 m away on the road in five scenarios of the library: that of the first frame,
    whose box is given, is subtracted everywhere. What is left, with the true boxes, is
    up to .2 m and .6 km/h there.
    """
    count = len(boxes)
    vehicles, nothing = sequence.truth.vehicles, np.full(count, np.nan)
    names = [one.name for one in vehicles.vehicles] if vehicles is not None else []
    if vehicles is None or not sequence.cameras or "target" not in names:
        return RoadMotion(nothing, nothing, nothing)
    index = names.index("target")
    true = vehicles.positions[:, index]
    level = true[:, 2] + vehicles.vehicles[index].height / 2.0
    found = road_points(boxes, sequence, level)
    found += true[0, :2] - found[0]
    error = np.hypot(*(found - true[:, :2]).T)
    if vehicles.speeds is None:
        speed = _speed(true, times_s)
    else:
        speed = vehicles.speeds[:, index]
    return RoadMotion(error, _KMH * _speed(found, times_s), _KMH * speed)


def road_points(boxes: _Floats, sequence: Sequence, level_m: _Floats) -> _Floats:
    """Return where the rays through the centres of boxes meet a horizontal plane.

    Parameters
    ----------
    boxes : (T, 4) float, px
    sequence : Sequence
        With its T cameras.
    level_m : (T,) float, m
        Height of the plane in the road frame.

    Returns
    -------
    (T, 2) float, m
        ``x, y`` in the road frame. NaN without a box, and for a ray that does not meet
        the plane in front of the camera.
    """
    cameras = sequence.cameras
    pixels = np.append(box.centers(boxes), np.ones((len(boxes), 1)), axis=1)
    matrices = np.stack([camera.matrix for camera in cameras])
    rotations = np.stack([camera.rotation for camera in cameras])
    eyes = np.stack([camera.position for camera in cameras])
    # a row times R is the transpose of R times it as a column
    rays = np.linalg.solve(matrices, pixels[..., None])[:, None, :, 0] @ rotations
    rays = rays[:, 0]
    drop = level_m - eyes[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        length = np.where(rays[:, 2] * drop > 0.0, drop / rays[:, 2], np.nan)
    return eyes[:, :2] + length[:, None] * rays[:, :2]


def _speed(points: _Floats, times_s: _Floats) -> _Floats:
    """Return the speed over a window around each time, (T,) m/s."""
    speeds = np.full(len(points), np.nan)
    known = np.flatnonzero(np.isfinite(points).all(axis=1))
    places, times = points[known], times_s[known]
    half = _WINDOW_S / 2.0 + 1e-9
    first = np.searchsorted(times, times - half)
    last = np.searchsorted(times, times + half, side="right") - 1
    way = np.linalg.norm(places[last] - places[first], axis=1)
    passed = times[last] - times[first]
    speeds[known] = np.divide(
        way, passed, out=np.full(len(known), np.nan), where=passed > 0.0
    )
    return speeds
