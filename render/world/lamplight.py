"""Lamps of a scene, and a light map of the ground that they illuminate.

Shading every sample by every lamp would cost more than the rest of the image. The light
of all lamps is added up in a map of the ground around the camera instead, and the
shader samples that map once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.world.mesh import Mesh, Surface

__all__ = ["LampMap", "Lamps", "VehicleLamps", "gather_lamps", "vehicle_lamps"]

POST_DEPTH_M = 0.5
"""Depth of the foot of a lamp post below the ground."""
_TEXEL_M = 0.5
_BEHIND_M, _AHEAD_M, _ASIDE_M = 40.0, 360.0, 48.0
_SNAP_M, _SNAP_RAD = 4.0, 1.0 / 64.0
_BEAM_M, _SPREAD_M, _TAIL_M = 70.0, 16.0, 9.0
_MOST_THIN = 7.0
"""Light below exp(-7), a thousandth of a beam, is none."""
_STREET_M, _STRETCH = 40.0, 1.4
_ROOM_M = 3.5
"""Farthest that a camera is from its place in the map, and a texel."""


@dataclass(frozen=True, slots=True)
class VehicleLamps:
    """The L lamps of one vehicle body, in its own frame.

    Attributes
    ----------
    positions : (L, 3) float, m
    colours : (L, 3) float, in [0, 1]
        Linear RGB.
    ahead : (L,) float
        1 for a lamp that shines forward, -1 for one that shines backward.
    """

    positions: NDArray[np.float64]
    colours: NDArray[np.float64]
    ahead: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Lamps:
    """Every lamp of a scene except those of a tunnel; P street lamps.

    Attributes
    ----------
    by_body : tuple of VehicleLamps
        Those of each vehicle body in the scene.
    street : (P, 3) float, m
        Street lamps in the road frame.
    heights : (P,) float, m
        Above the road.
    headings : (P,) float, rad
        Of the roads below: the arms of the posts point to the left of them.
    ids : (P,) int
        Instance ids of the posts.
    on_camera : bool
        The camera is mounted on a car with head lamps of its own.
    """

    by_body: tuple[VehicleLamps, ...]
    street: NDArray[np.float64]
    heights: NDArray[np.float64]
    headings: NDArray[np.float64]
    ids: NDArray[np.int64]
    on_camera: bool


def gather_lamps(
    bodies: Iterable[Mesh], posts: Sequence[Mesh], *, on_camera: bool
) -> Lamps:
    """Find all lamps: those of the vehicle bodies, and one on each lamp post."""
    heads, feet = np.zeros((len(posts), 3)), np.zeros((len(posts), 3))
    for index, post in enumerate(posts):
        is_lamp = post.surface[:, 1] == Surface.LAMP
        heads[index] = post.positions[is_lamp].mean(axis=0, dtype=float)
        z = post.positions[:, 2]
        foot = post.positions[z <= z.min() + 0.01].mean(axis=0, dtype=float)
        feet[index] = foot + [0.0, 0.0, POST_DEPTH_M]
    arms = heads - feet
    return Lamps(
        tuple(vehicle_lamps(body) for body in bodies),
        heads,
        heights=arms[:, 2],
        headings=np.arctan2(-arms[:, 0], arms[:, 1]),
        ids=np.array([int(post.surface[0, 0]) for post in posts], dtype=np.int64),
        on_camera=on_camera,
    )


def vehicle_lamps(body: Mesh) -> VehicleLamps:
    """Find the lamps of a body: front and rear, left and right."""
    is_lamp = body.surface[:, 1] == Surface.LAMP
    points = body.positions[is_lamp].astype(np.float64)
    colours = body.colours[is_lamp, :3].astype(np.float64) ** 2
    rows = [np.zeros((0, 7))]
    for ahead in (1.0, -1.0):
        for is_left in (True, False):
            chosen = ((points[:, 0] > 0) == (ahead > 0)) & (
                (points[:, 1] > 0) == is_left
            )
            if chosen.any():
                means = points[chosen].mean(axis=0), colours[chosen].mean(axis=0)
                rows.append(np.array([[*means[0], *means[1], ahead]]))
    lamps = np.concatenate(rows)
    return VehicleLamps(lamps[:, :3], lamps[:, 3:6], lamps[:, 6])


class LampMap:
    """Light map of the ground around the camera: the light of lamps, from above.

    Parameters
    ----------
    lamps : Lamps
        Only the street lamps; head lamps are arguments of `update`.

    Attributes
    ----------
    texels : (R, C, 4) float32
        Light of street lamps, of head lamps and of tail lamps, 1 being full strength,
        and the part of the head lamps' light that travels along the map's axis
        (negative: against it). Rows run to the left of the axis.
    to_map : (4, 4) float
        Road frame to texture coordinates: the first two, in [0, 1] on the map.
    axis : (3,) float
        Direction of the map's columns in the road frame.
    """

    def __init__(self, lamps: Lamps) -> None:
        self._lamps = lamps
        columns = round((_BEHIND_M + _AHEAD_M) / _TEXEL_M)
        rows = round(2.0 * _ASIDE_M / _TEXEL_M)
        self._unmoved = np.zeros((rows, columns, 4), np.float32)  # street lamps only
        self._pose = (math.nan, math.nan, math.nan)
        self.texels = np.zeros((rows, columns, 4), np.float32)
        self.to_map = np.eye(4)
        self.axis = np.array([1.0, 0.0, 0.0])

    def update(self, camera: Camera, beams: NDArray[np.float64]) -> None:
        """Recompute the map for a camera and the vehicles around it.

        Parameters
        ----------
        camera : Camera
        beams : (N, 4) float, m, m, rad, m
            A row for each vehicle: position, heading, and half its length.
        """
        self._move_to(camera)
        np.copyto(self.texels, self._unmoved)
        local = self._to_map_frame(beams[:, :2], beams[:, 2])
        slope = self._half_view(camera)
        _add_beams(self.texels, np.column_stack([local, beams[:, 3]]), slope)

    def _half_view(self, camera: Camera) -> float:
        """Return how far aside of the axis a camera sees, per metre ahead.

        Infinite where it looks down so steeply that it sees what is behind.
        """
        x, y = camera.width, camera.height
        corners = np.array([[0, 0, 1], [x, 0, 1], [0, y, 1], [x, y, 1]])
        rays = np.linalg.solve(camera.matrix, corners.T).T @ camera.rotation
        ahead = rays @ self.axis
        aside = rays[:, 1] * self.axis[0] - rays[:, 0] * self.axis[1]
        if ahead.min() <= 0.0:
            return math.inf
        return float(np.max(np.abs(aside) / ahead))

    def _move_to(self, camera: Camera) -> None:
        """Move the map with the camera, in steps: street lamps are drawn rarely."""
        look = camera.rotation[2]
        heading = math.atan2(look[1], look[0])
        x, y, _ = camera.position
        pose = (
            round(x / _SNAP_M) * _SNAP_M,
            round(y / _SNAP_M) * _SNAP_M,
            round(heading / _SNAP_RAD) * _SNAP_RAD,
        )
        if pose == self._pose:
            return
        self._pose = x, y, heading = pose
        cos, sin = math.cos(heading), math.sin(heading)
        length, width = _BEHIND_M + _AHEAD_M, 2.0 * _ASIDE_M
        self.axis = np.array([cos, sin, 0.0])
        self.to_map[0] = np.array([cos, sin, 0, _BEHIND_M - x * cos - y * sin]) / length
        self.to_map[1] = np.array([-sin, cos, 0, _ASIDE_M + x * sin - y * cos]) / width
        street = self._unmoved[..., 0]
        street[:] = 0.0
        lamps = self._lamps
        local = self._to_map_frame(lamps.street[:, :2], lamps.headings)
        _add_street_lamps(street, np.column_stack([local, lamps.heights]))

    def _to_map_frame(
        self, positions: NDArray[np.float64], headings: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return column [m], row [m], and cosine and sine of the heading, (N, 4)."""
        ones = np.ones(len(positions))
        flat = np.column_stack([positions, np.zeros(len(positions)), ones])
        size = np.array([_BEHIND_M + _AHEAD_M, 2.0 * _ASIDE_M])
        turned = headings - math.atan2(self.axis[1], self.axis[0])
        local = (flat @ self.to_map[:2].T) * size
        return np.column_stack([local, np.cos(turned), np.sin(turned)])


@numba.njit(cache=True)
def _add_beams(texels, beams, slope):  # type: ignore[no-untyped-def]  # compiled
    """Add low beams and tail lamps; beams: column [m], row [m], cos, sin, half [m].

    Nothing is added where a view, of ``slope`` metres aside per metre ahead, ends.
    """
    rows, columns = texels.shape[:2]
    for number in range(len(beams)):
        u, v, cos, sin, half = beams[number]
        # the beam and the light of the tail lamps, about the middle of their length
        middle, reach = (_BEAM_M - _TAIL_M) / 2.0, (_BEAM_M + _TAIL_M) / 2.0 + half
        x, y = u + cos * middle, v + sin * middle
        wide = abs(cos) * _SPREAD_M + abs(sin) * reach
        long = abs(sin) * _SPREAD_M + abs(cos) * reach
        first, last = int((x - long) / _TEXEL_M), int((x + long) / _TEXEL_M) + 1
        low, high = int((y - wide) / _TEXEL_M), int((y + wide) / _TEXEL_M) + 1
        for row in range(max(low, 0), min(high, rows)):
            dy = (row + 0.5) * _TEXEL_M - v
            begin = first
            if slope < math.inf:
                off = max(abs((row + 0.5) * _TEXEL_M - _ASIDE_M) - _ROOM_M, 0.0)
                sees = int((_BEHIND_M + off / slope - _ROOM_M) / _TEXEL_M)
                begin = max(first, sees)
            for column in range(max(begin, 0), min(last, columns)):
                dx = (column + 0.5) * _TEXEL_M - u
                ahead = cos * dx + sin * dy - half
                aside = cos * dy - sin * dx
                if 0.0 < ahead < _BEAM_M and abs(aside) < _SPREAD_M:
                    # Aimed at the road some 20 m ahead, widening, with a soft end.
                    across = aside / (1.3 + 0.1 * ahead)
                    thin = 0.5 * across * across + ahead / 20.0
                    if thin > _MOST_THIN:
                        continue
                    light = math.exp(-thin)
                    light *= ahead * ahead / (ahead * ahead + 12.0)
                    light *= 1.0 - ahead / _BEAM_M
                    texels[row, column, 1] += light
                    texels[row, column, 3] += light * cos
                behind = -ahead - 2.0 * half
                if 0.0 < behind < _TAIL_M and abs(aside) < 5.0:
                    across = aside / (1.0 + 0.15 * behind)
                    light = math.exp(-0.5 * across * across - behind / 2.5)
                    texels[row, column, 2] += light


@numba.njit(cache=True)
def _add_street_lamps(texels, lamps):  # type: ignore[no-untyped-def]  # compiled by numba
    """Add street lamps, each with column [m], row [m], cos, sin, height [m].

    The inverse square law with the cosine of the angle of incidence, 1 below the lamp,
    stretched along the road as by the reflectors of street lamps.
    """
    rows, columns = texels.shape
    for number in range(len(lamps)):
        u, v, cos, sin, height = lamps[number]
        long = _STREET_M * math.hypot(_STRETCH * cos, sin)
        wide = _STREET_M * math.hypot(_STRETCH * sin, cos)
        first, last = int((u - long) / _TEXEL_M), int((u + long) / _TEXEL_M)
        low, high = int((v - wide) / _TEXEL_M), int((v + wide) / _TEXEL_M)
        for row in range(max(low, 0), min(high + 1, rows)):
            dy = (row + 0.5) * _TEXEL_M - v
            for column in range(max(first, 0), min(last + 1, columns)):
                dx = (column + 0.5) * _TEXEL_M - u
                along = (cos * dx + sin * dy) / _STRETCH
                across = cos * dy - sin * dx
                square = along * along + across * across
                fade = 1.0 - square / (_STREET_M * _STREET_M)
                if fade > 0.0:
                    off = 1.0 + square / (height * height)
                    texels[row, column] += fade / (off * math.sqrt(off))
