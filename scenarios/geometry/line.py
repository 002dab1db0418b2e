"""Reference line: from road coordinates to the road frame and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Line"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """Reference line of a scenario's road coordinates, sampled about every metre.

    It is the middle of a road, of a floor, or the target's path through a network.

    Attributes
    ----------
    along : (S,) float, m
        Arc length, 0 at the scenario's origin.
    x, y, z : (S,) float, m
        The line in the road frame.
    heading, pitch : (S,) float, rad
        Direction of travel, counter-clockwise from x, without jumps, and slope upwards.
    map_origin : (3,) float, m
        Origin of the road frame in the coordinates of the SUMO network.
    """

    along: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    heading: NDArray[np.float64]
    pitch: NDArray[np.float64]
    map_origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def straight(cls, reach_m: float) -> Self:
        """Return the x axis from ``-reach_m`` to ``reach_m``."""
        along = np.linspace(-reach_m, reach_m, 3)
        flat = np.zeros(3)
        return cls(along=along, x=along, y=flat, z=flat, heading=flat, pitch=flat)

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
        s, d, h = np.broadcast_arrays(along_m, lateral_m, height_m)
        heading = self.heading_at(s)
        x = np.interp(s, self.along, self.x) - d * np.sin(heading)
        y = np.interp(s, self.along, self.y) + d * np.cos(heading)
        z = np.interp(s, self.along, self.z) + h
        return np.stack([x, y, z], axis=-1)

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
        # imported here: the SUMO process loads this module but needs no tree
        from scipy.spatial import cKDTree

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

    def map_point(self, x_m: float, y_m: float, z_m: float) -> NDArray[np.float64]:
        """Return a point of the SUMO network in the road frame, (3,) m."""
        point: NDArray[np.float64] = np.array([x_m, y_m, z_m]) - self.map_origin
        return point
