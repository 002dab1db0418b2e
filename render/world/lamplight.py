"""The light that lamps throw: where the lamps are, and their pools on the road.

Shading every sample by every lamp would cost more than the rest of the picture. The
pools are stamped on a map of the ground around the camera instead, and the shader
looks a place up once.
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
"""How far lamp posts reach into the ground."""
_TEXEL_M = 0.5
_BEHIND_M, _AHEAD_M, _ASIDE_M = 40.0, 360.0, 48.0
_SNAP_M, _SNAP_RAD = 4.0, 1.0 / 64.0
_BEAM_M, _SPREAD_M = 70.0, 16.0
_STREET_M, _STRETCH = 40.0, 1.4


@dataclass(frozen=True, slots=True)
class VehicleLamps:
    """The lamps of one kind of vehicle, in its own frame; L of them.

    Attributes
    ----------
    places : (L, 3) float, m
    colours : (L, 3) float, in [0, 1]
        Linear RGB.
    ahead : (L,) float
        1 for a lamp that shines forward, -1 for one that shines back.
    """

    places: NDArray[np.float64]
    colours: NDArray[np.float64]
    ahead: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Lamps:
    """Every lamp of a scene but a tunnel's; P street lamps.

    Attributes
    ----------
    of_bodies : tuple of VehicleLamps
        One for each kind of vehicle in the scene.
    street : (P, 3) float, m
        Street lamps in the road frame.
    heights : (P,) float, m
        Their heights above the road.
    headings : (P,) float, rad
        Of the roads they light: their arms reach to the left across them.
    ids : (P,) int
        Instance ids of their posts.
    on_camera : bool
        The camera rides in a car with head lamps of its own.
    """

    of_bodies: tuple[VehicleLamps, ...]
    street: NDArray[np.float64]
    heights: NDArray[np.float64]
    headings: NDArray[np.float64]
    ids: NDArray[np.int64]
    on_camera: bool


def gather_lamps(
    bodies: Iterable[Mesh], posts: Sequence[Mesh], *, on_camera: bool
) -> Lamps:
    """Find all lamps: on the vehicles' bodies, and one on each lamp post."""
    street = [
        post.positions[post.surface[:, 1] == Surface.LAMP].mean(axis=0, dtype=float)
        for post in posts
    ]
    places = np.array(street).reshape(-1, 3)
    feet = np.array([_foot(post) for post in posts]).reshape(-1, 3)
    arms = places - feet
    return Lamps(
        tuple(vehicle_lamps(body) for body in bodies),
        places,
        heights=arms[:, 2],
        headings=np.arctan2(-arms[:, 0], arms[:, 1]),
        ids=np.array([int(post.surface[0, 0]) for post in posts], dtype=np.int64),
        on_camera=on_camera,
    )


def _foot(post: Mesh) -> NDArray[np.float64]:
    """Return where a post comes out of the ground, (3,) m."""
    heights = post.positions[:, 2]
    lowest = post.positions[heights <= heights.min() + 0.01]
    foot: NDArray[np.float64] = lowest.mean(axis=0, dtype=float)
    return foot + [0.0, 0.0, POST_DEPTH_M]


def vehicle_lamps(body: Mesh) -> VehicleLamps:
    """Find the lamps of a body: front and rear, left and right."""
    shines = body.surface[:, 1] == Surface.LAMP
    points = body.positions[shines].astype(np.float64)
    colours = body.colours[shines, :3].astype(np.float64) ** 2
    places, tints, ahead = [], [], []
    for forward in (True, False):
        for left in (True, False):
            here = ((points[:, 0] > 0) == forward) & ((points[:, 1] > 0) == left)
            if here.any():
                places.append(points[here].mean(axis=0))
                tints.append(colours[here].mean(axis=0))
                ahead.append(1.0 if forward else -1.0)
    return VehicleLamps(
        np.array(places).reshape(-1, 3),
        np.array(tints).reshape(-1, 3),
        np.array(ahead),
    )


class LampMap:
    """Lamplight on the ground around the camera, seen from above.

    Parameters
    ----------
    lamps : Lamps
        The street lamps among them stay; `light` is told about the others.

    Attributes
    ----------
    texels : (R, C, 4) float32
        At each place: light of street lamps, of head lamps and of tail lamps, 1 being
        full strength, and the part of the head lamps' light that travels along the
        map's axis (negative: against it). Rows run to the left of the axis.
    to_map : (4, 4) float
        Road frame to texture coordinates: the first two parts, in [0, 1] on the map.
    axis : (3,) float
        Direction of the map's columns in the road frame.
    """

    def __init__(self, lamps: Lamps) -> None:
        self._lamps = lamps
        columns = round((_BEHIND_M + _AHEAD_M) / _TEXEL_M)
        rows = round(2.0 * _ASIDE_M / _TEXEL_M)
        self._still = np.zeros((rows, columns), np.float32)
        self._frame = (math.nan, math.nan, math.nan)
        self.texels = np.zeros((rows, columns, 4), np.float32)
        self.to_map = np.eye(4)
        self.axis = np.array([1.0, 0.0, 0.0])

    def light(self, camera: Camera, beams: NDArray[np.float64]) -> None:
        """Draw the map anew for a camera and the vehicles around it.

        Parameters
        ----------
        camera : Camera
        beams : (N, 4) float, m, m, rad, m
            A row a vehicle: place, heading, and half its length.
        """
        self._move_to(camera)
        self.texels[..., 0] = self._still
        self.texels[..., 1:] = 0.0
        local = self._local(beams[:, :2])
        ways = self._directions(beams[:, 2])
        _stamp_beams(self.texels, np.column_stack([local, ways, beams[:, 3]]))

    def _move_to(self, camera: Camera) -> None:
        """Put the map under the camera, in steps: then street lamps seldom change."""
        look = camera.rotation[2]
        heading = math.atan2(look[1], look[0])
        x, y, _ = camera.position
        frame = (
            round(x / _SNAP_M) * _SNAP_M,
            round(y / _SNAP_M) * _SNAP_M,
            round(heading / _SNAP_RAD) * _SNAP_RAD,
        )
        if frame == self._frame:
            return
        self._frame = frame
        x, y, heading = frame
        cos, sin = math.cos(heading), math.sin(heading)
        length, width = _BEHIND_M + _AHEAD_M, 2.0 * _ASIDE_M
        self.axis = np.array([cos, sin, 0.0])
        self.to_map[0] = np.array([cos, sin, 0, _BEHIND_M - x * cos - y * sin]) / length
        self.to_map[1] = np.array([-sin, cos, 0, _ASIDE_M + x * sin - y * cos]) / width
        self._still[:] = 0.0
        lamps = self._lamps
        local, ways = self._local(lamps.street[:, :2]), self._directions(lamps.headings)
        _stamp_street(self._still, np.column_stack([local, ways, lamps.heights]))

    def _local(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 2) places [m] on the map: column and row."""
        flat = np.column_stack([places, np.zeros(len(places)), np.ones(len(places))])
        size = np.array([_BEHIND_M + _AHEAD_M, 2.0 * _ASIDE_M])
        local: NDArray[np.float64] = (flat @ self.to_map[:2].T) * size
        return local

    def _directions(self, headings: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (N, 2) cosines and sines of headings [rad] against the map's axis."""
        turned = headings - math.atan2(self.axis[1], self.axis[0])
        return np.column_stack([np.cos(turned), np.sin(turned)])


@numba.njit(cache=True)
def _stamp_beams(texels, beams):  # type: ignore[no-untyped-def]  # compiled by numba
    """Add low beams ahead and a red glow behind; (column m, row m, cos, sin, half)."""
    rows, columns = texels.shape[:2]
    for number in range(len(beams)):
        u, v, cos, sin, half = beams[number]
        reach = _BEAM_M + half
        wide = abs(cos) * _SPREAD_M + abs(sin) * reach
        long = abs(sin) * _SPREAD_M + abs(cos) * reach
        first, last = int((u - long) / _TEXEL_M), int((u + long) / _TEXEL_M)
        low, high = int((v - wide) / _TEXEL_M), int((v + wide) / _TEXEL_M)
        for row in range(max(low, 0), min(high, rows)):
            dy = (row + 0.5) * _TEXEL_M - v
            for column in range(max(first, 0), min(last, columns)):
                dx = (column + 0.5) * _TEXEL_M - u
                ahead = cos * dx + sin * dy - half
                aside = cos * dy - sin * dx
                if 0.0 < ahead < _BEAM_M and abs(aside) < _SPREAD_M:
                    # Aimed at the road some 20 m ahead, widening; ends softly.
                    across = aside / (1.3 + 0.1 * ahead)
                    light = math.exp(-0.5 * across * across - ahead / 20.0)
                    light *= ahead * ahead / (ahead * ahead + 12.0)
                    light *= 1.0 - ahead / _BEAM_M
                    texels[row, column, 1] += light
                    texels[row, column, 3] += light * cos
                behind = -ahead - 2.0 * half
                if 0.0 < behind < 9.0 and abs(aside) < 5.0:
                    across = aside / (1.0 + 0.15 * behind)
                    light = math.exp(-0.5 * across * across - behind / 2.5)
                    texels[row, column, 2] += light


@numba.njit(cache=True)
def _stamp_street(texels, lamps):  # type: ignore[no-untyped-def]  # compiled by numba
    """Add the pools of lamps that shine down; (column m, row m, cos, sin, height m).

    The inverse square law with the cosine of the angle of incidence, 1 below the lamp,
    stretched along the road as reflectors of street lamps do.
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
