"""The road's centre line: from road coordinates to the plane, smooth to the metre.

Curvature and slope of the sections are blended over `_BLEND_M`, as clothoids and
vertical curves do on real roads, and integrated numerically.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from simbench.scenarios.schema import Road

__all__ = ["RoadLine"]

_STEP_M = 1.0
_BLEND_M = 60.0


@dataclass(frozen=True, slots=True)
class RoadLine:
    """The middle of the median, sampled every metre.

    Attributes
    ----------
    road : Road
        What it was made from.
    along : (S,) float, m
        Arc length, 0 at the scenario's origin.
    x, y, z : (S,) float, m
        The line in the road frame; the origin is at 0, 0, 0 with heading 0.
    heading, pitch : (S,) float, rad
        Direction of travel, counter-clockwise from x, and slope upwards.
    """

    road: Road
    along: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    heading: NDArray[np.float64]
    pitch: NDArray[np.float64]

    @classmethod
    def from_road(cls, road: Road) -> RoadLine:
        """Integrate the sections of a road, extended straight at both ends."""
        margin = 600.0  # scenery goes on where the traffic does not
        end = road.length_m - road.before_m
        along = np.arange(-road.before_m - margin, end + margin + _STEP_M, _STEP_M)
        curvature = np.zeros(len(along))
        slope = np.zeros(len(along))
        start = 0.0
        for section in road.sections:
            inside = (along >= start) & (along < start + section.length_m)
            curvature[inside] = 1.0 / (section.curve_radius_m or np.inf)
            slope[inside] = section.slope_percent / 100.0
            start += section.length_m
        kernel = np.full(int(_BLEND_M / _STEP_M), _STEP_M / _BLEND_M)
        curvature = np.convolve(curvature, kernel, mode="same")
        slope = np.convolve(slope, kernel, mode="same")
        heading = _integral(curvature, along)
        pitch = np.arctan(slope)
        return cls(
            road,
            along,
            _integral(np.cos(heading), along),
            _integral(np.sin(heading), along),
            _integral(slope, along),
            heading,
            pitch,
        )

    def point(
        self, along_m: ArrayLike, lateral_m: ArrayLike, height_m: ArrayLike = 0.0
    ) -> NDArray[np.float64]:
        """Map road coordinates to the road frame.

        Parameters
        ----------
        along_m, lateral_m, height_m : (...) float, m
            Broadcast against each other; NaN gives NaN.

        Returns
        -------
        (..., 3) float, m
        """
        s, d, h = np.broadcast_arrays(
            np.asarray(along_m, np.float64),
            np.asarray(lateral_m, np.float64),
            np.asarray(height_m, np.float64),
        )
        heading = self.heading_at(s)
        return np.stack(
            [
                np.interp(s, self.along, self.x) - d * np.sin(heading),
                np.interp(s, self.along, self.y) + d * np.cos(heading),
                np.interp(s, self.along, self.z) + h,
            ],
            axis=-1,
        )

    def locate(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the road coordinates of points: the inverse of `point`.

        Parameters
        ----------
        points : (N, 3) float, m

        Returns
        -------
        (N, 2) float, m
            ``along, lateral``, exact to millimetres within 60 m of the line.
        """
        tree = cKDTree(np.stack([self.x, self.y], axis=-1))
        along = self.along[tree.query(points[:, :2])[1]]
        for _ in range(3):  # Newton steps along the tangent
            heading = self.heading_at(along)
            offset = points[:, :2] - self.point(along, 0.0)[:, :2]
            ahead = offset[:, 0] * np.cos(heading) + offset[:, 1] * np.sin(heading)
            along = along + ahead
        lateral = offset[:, 1] * np.cos(heading) - offset[:, 0] * np.sin(heading)
        return np.stack([along, lateral], axis=-1)

    def heading_at(self, along_m: ArrayLike) -> NDArray[np.float64]:
        """Return the heading [rad] at arc lengths [m]."""
        return np.interp(np.asarray(along_m, np.float64), self.along, self.heading)

    def pitch_at(self, along_m: ArrayLike) -> NDArray[np.float64]:
        """Return the slope angle [rad], up positive, at arc lengths [m]."""
        return np.interp(np.asarray(along_m, np.float64), self.along, self.pitch)

    def lane_lateral(self, lane: ArrayLike) -> NDArray[np.float64]:
        """Return the lateral place [m] of a (fractional) lane of the near side.

        Lane 0 is the right-most; the opposite carriageway is the mirror image.
        """
        road = self.road
        inner = road.median_m / 2.0 + 0.5  # half a metre of paved margin
        count = np.asarray(lane, np.float64)
        return -(inner + (road.lanes - count - 0.5) * road.lane_width_m)

    @property
    def edge_m(self) -> float:
        """Distance from the median's middle to the outer edge of the shoulder in m."""
        road = self.road
        paved = road.median_m / 2.0 + 0.5 + road.lanes * road.lane_width_m
        return paved + road.shoulder_m


def _integral(
    rate: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Integrate by trapezoids, with value 0 at arc length 0."""
    steps = np.diff(along) * (rate[1:] + rate[:-1]) / 2.0
    total = np.concatenate([[0.0], np.cumsum(steps)])
    value: NDArray[np.float64] = total - np.interp(0.0, along, total)
    return value
