"""A line through the world: from along, lateral and height to the plane and back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Line"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A curve without corners, sampled about every metre.

    Along it the scenario's places are told: along a road's middle, the edge of a
    floor, or the path of a target through a network.

    Attributes
    ----------
    along : (S,) float, m
        Arc length, 0 at the scenario's origin.
    x, y, z : (S,) float, m
        The line in the road frame.
    heading, pitch : (S,) float, rad
        Direction of travel, counter-clockwise from x, without jumps, and slope upwards.
    map_origin : (3,) float, m
        Where the road frame's origin lies on the map that it was taken from.
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
        """Return the x axis as far as ``reach_m`` either way."""
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
        # here: the process that drives SUMO loads this module, but places no points
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
        """Return where a point of the map lies in the road frame, (3,) m."""
        there = np.array([x_m, y_m, z_m], dtype=np.float64)
        placed: NDArray[np.float64] = there - np.array(self.map_origin)
        return placed
