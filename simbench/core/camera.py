"""Pinhole camera in the OpenCV convention."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Camera"]


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera at one instant.

    A world point ``X`` has camera coordinates ``R @ X + t`` (x right, y down, z
    forward, metres) and image position ``K @ (R @ X + t)`` divided by its third part,
    in continuous pixels from the outer corner of the top-left pixel.

    Attributes
    ----------
    matrix : (3, 3) float, px
        Intrinsics ``K``, without skew.
    rotation : (3, 3) float
        ``R``, road frame to camera frame; orthonormal, determinant 1.
    translation : (3,) float, m
        ``t``.
    width, height : int, px
        Image size.
    """

    matrix: NDArray[np.float64]
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    width: int
    height: int

    @classmethod
    def look_at(
        cls,
        position: ArrayLike,
        target: ArrayLike,
        *,
        fov_rad: float,
        width: int,
        height: int,
        roll_rad: float = 0.0,
    ) -> Camera:
        """Make a camera at ``position`` whose optical axis passes through ``target``.

        Parameters
        ----------
        position, target : (3,) float, m
            Points in the road frame (z up).
        fov_rad : float, rad
            Horizontal field of view, in (0, pi).
        width, height : int, px
            Image size; pixels are square and the principal point is the image centre.
        roll_rad : float, rad
            Rotation about the optical axis, counter-clockwise as seen in the image.

        Raises
        ------
        ValueError
            If position and target coincide.
        """
        eye = np.asarray(position, dtype=np.float64)
        forward = np.asarray(target, dtype=np.float64) - eye
        if (distance := float(np.linalg.norm(forward))) == 0.0:
            raise ValueError(f"camera position and target must differ, both are {eye}")
        forward = forward / distance
        right = np.cross(forward, [0.0, 0.0, 1.0])
        if float(np.linalg.norm(right)) < 1e-9:
            right = np.array([0.0, -1.0, 0.0])  # straight down: image up is road x
        right = right / np.linalg.norm(right)
        down = np.cross(forward, right)
        cos, sin = math.cos(roll_rad), math.sin(roll_rad)
        rotation = np.stack(
            [cos * right + sin * down, cos * down - sin * right, forward]
        )
        focal = width / 2.0 / math.tan(fov_rad / 2.0)
        matrix = np.array(
            [[focal, 0.0, width / 2.0], [0.0, focal, height / 2.0], [0.0, 0.0, 1.0]]
        )
        return cls(matrix, rotation, -rotation @ eye, width, height)

    @property
    def position(self) -> NDArray[np.float64]:
        """Optical centre in the road frame, (3,) m."""
        return np.asarray(-self.rotation.T @ self.translation)

    @property
    def focal_px(self) -> float:
        """Focal length in px."""
        return float(self.matrix[0, 0])

    def to_camera(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (..., 3) road-frame points [m] in camera coordinates [m]."""
        return np.asarray(points @ self.rotation.T + self.translation)

    def project(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Project points of the road frame into the image.

        Parameters
        ----------
        points : (..., 3) float, m

        Returns
        -------
        pixels : (..., 2) float, px
            NaN for points at or behind the camera.
        depth : (...,) float, m
            Distance along the optical axis; negative behind the camera.
        """
        local = self.to_camera(points)
        depth = local[..., 2]
        ahead = np.where(depth > 0.0, depth, np.nan)
        pixels = self.focal_px * local[..., :2] / ahead[..., None] + self.matrix[:2, 2]
        return pixels, depth
