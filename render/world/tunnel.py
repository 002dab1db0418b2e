"""A tunnel: mesh of its tubes, portals and hill, and a map of the light inside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError
from simbench.render.world.mesh import (
    Colour,
    Mesh,
    Surface,
    box,
    merge,
    triangle_mesh,
    wall_strip,
)
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Tunnel

__all__ = ["TunnelModel", "build_tunnel", "is_in_tunnel", "require_clear"]

_CEILING_M, _CROWN_M, _ROOF_M = 6.0, 8.4, 10.0
_HILL_M = 14.0
"""Width of each slope of the hill."""
_WALL_GAP_M = 0.6
"""From the road's edge to the wall."""
_PORTAL_M = 0.3
"""Distance of the portals in front of the dark part."""
_STEP_M = 4.0
_LAMP_STEP_M = 8.0
_MARGIN_M = 30.0
_TEXEL_M = 0.5
_MAX_TEXELS = 2000
_PORTAL_DAYLIGHT, _DAYLIGHT_DEPTH_M = 0.55, 9.0

_TILE: Colour = (0.72, 0.72, 0.68)
_WALL: Colour = (0.5, 0.5, 0.49)
_CEILING: Colour = (0.36, 0.36, 0.37)
_CONCRETE: Colour = (0.58, 0.57, 0.54)
_LAMP: Colour = (0.98, 0.95, 0.86)
_GRASS: dict[str, Colour] = {"summer": (0.33, 0.38, 0.2), "autumn": (0.46, 0.41, 0.26)}


@dataclass(frozen=True, slots=True)
class TunnelModel:
    """A tunnel in the road frame.

    Attributes
    ----------
    mesh : Mesh
        Walls, ceilings, lamps, portals, hill.
    from_m, to_m : float, m
        Portals along the road.
    cover : (R, C, 4) float32
        Map of the ground: arc length along the road [m], height of the road [m], share
        of daylight (1 in the open), light of the tunnel's lamps (0 in the open, about
        1 inside). Valid for points lower than `roof_m` above the road.
    to_map : (4, 4) float
        Road frame to texture coordinates of the map, in [0, 1] on it.
    roof_m : float, m
        Height above the road from which a point is above the tunnel, not inside.
    """

    mesh: Mesh
    from_m: float
    to_m: float
    cover: NDArray[np.float32]
    to_map: NDArray[np.float64]
    roof_m: float

    def sample(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return arc length [m] and share of daylight, (N, 2), at (N, 3) points [m]."""
        rows, columns = self.cover.shape[:2]
        uv = points @ self.to_map[:2, :3].T + self.to_map[:2, 3]
        column = np.clip(uv[:, 0] * columns, 0, columns - 1).astype(np.int64)
        row = np.clip(uv[:, 1] * rows, 0, rows - 1).astype(np.int64)
        found = self.cover[row, column].astype(np.float64)
        is_below = points[:, 2] < found[:, 1] + self.roof_m
        return np.column_stack([found[:, 0], np.where(is_below, found[:, 2], 1.0)])


def build_tunnel(tunnel: Tunnel, line: RoadLine, season: str) -> TunnelModel:
    """Build the tunnel of a scenario.

    Raises
    ------
    RenderError
        If it reaches beyond the road.
    """
    low, high = float(line.along[0]), float(line.along[-1])
    if tunnel.from_m < low or tunnel.to_m > high:
        raise RenderError(
            f"surroundings.tunnel: expected a tunnel on the road, within {low:g} to "
            f"{high:g} m, got {tunnel.from_m:g} to {tunnel.to_m:g}"
        )
    steps = max(2, math.ceil((tunnel.to_m - tunnel.from_m) / _STEP_M))
    first, last = tunnel.from_m - _PORTAL_M, tunnel.to_m + _PORTAL_M
    along = np.linspace(first, last, steps + 1)
    cover, to_map = _cover(tunnel, line)
    inner, outer = _walls(line)
    parts = [_hill(line, along, season)]
    for side in (-1.0, 1.0):
        parts += _tube(line, along, side * inner, side * outer)
        parts += _lamp_rows(line, tunnel, side * inner, side * outer)
    parts += [_portal(line, first), _portal(line, last)]
    roof_m = (_CEILING_M + _CROWN_M) / 2.0
    return TunnelModel(merge(parts), tunnel.from_m, tunnel.to_m, cover, to_map, roof_m)


def is_in_tunnel(mesh: Mesh, tunnel: TunnelModel, line: RoadLine) -> bool:
    """Return whether a roadside object would intersect the tunnel."""
    middle = mesh.positions.mean(axis=0, dtype=np.float64)
    along, lateral = line.locate(middle[None])[0]
    _, outer = _walls(line)
    near = tunnel.from_m - 4.0 < along < tunnel.to_m + 4.0
    return bool(near and abs(lateral) < outer + 6.0)


def require_clear(
    tunnel: TunnelModel, line: RoadLine, eyes: NDArray[np.float64], name: str
) -> None:
    """Require camera positions ``eyes``, (T, 3) m, outside the tunnel's hill.

    Raises
    ------
    RenderError
    """
    along, lateral = line.locate(eyes).T
    height = eyes[:, 2] - line.point(along, lateral)[:, 2]
    inner, outer = _walls(line)
    within = (along > tunnel.from_m - 0.5) & (along < tunnel.to_m + 0.5)
    aside = np.abs(lateral)
    slope = np.clip((outer + _HILL_M - aside) / _HILL_M, 0.0, 1.0) * _CROWN_M
    top = np.where(aside < outer, _ROOF_M, slope)
    in_tube = (aside > inner) & (aside < outer) & (height < _CEILING_M)
    buried = within & (aside < outer + _HILL_M) & (height < top) & ~in_tube
    if buried.any():
        frame = int(np.argmax(buried))
        raise RenderError(
            f"{name}: the camera must not be inside the hill of surroundings.tunnel; "
            f"in frame {frame} it is at {along[frame]:.0f} m along, "
            f"{lateral[frame]:.1f} m lateral, {height[frame]:.1f} m high"
        )


def _walls(line: RoadLine) -> tuple[float, float]:
    """Return the distances [m] of a tube's walls from the middle of the median."""
    return max(0.12, line.road.median_m / 2.0 - 0.5), line.edge_m + _WALL_GAP_M


def _cover(
    tunnel: Tunnel, line: RoadLine
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Compute the map of the light in and around the tunnel, aligned with its chord."""
    path = line.point(np.linspace(tunnel.from_m, tunnel.to_m, 50), 0.0)
    chord = path[-1] - path[0]
    heading = math.atan2(chord[1], chord[0])
    cos, sin = math.cos(heading), math.sin(heading)
    turn = np.array([[cos, sin], [-sin, cos]])
    inner, outer = _walls(line)
    local = path[:, :2] @ turn.T
    low = local.min(axis=0) - [_MARGIN_M, outer + 3.0]
    size = local.max(axis=0) + [_MARGIN_M, outer + 3.0] - low
    counts = np.maximum(2, np.ceil(size / max(_TEXEL_M, size.max() / _MAX_TEXELS)))
    columns, rows = counts.astype(np.int64)
    u, v = np.meshgrid(
        low[0] + (np.arange(columns) + 0.5) * size[0] / columns,
        low[1] + (np.arange(rows) + 0.5) * size[1] / rows,
    )
    points = np.stack([u.ravel(), v.ravel()], axis=-1) @ turn
    along, lateral = line.locate(points).T
    inside = (along > tunnel.from_m) & (along < tunnel.to_m)
    inside &= (np.abs(lateral) > inner - 0.4) & (np.abs(lateral) < outer + 0.4)
    depth = np.minimum(along - tunnel.from_m, tunnel.to_m - along)
    deep = _PORTAL_DAYLIGHT / (1.0 + (np.maximum(depth, 0.0) / _DAYLIGHT_DEPTH_M) ** 2)
    lamp_light = 1.0 + 0.15 * np.cos(2.0 * math.pi * along / _LAMP_STEP_M)
    cover = np.stack(
        [
            along,
            line.point(along, 0.0)[:, 2],
            np.where(inside, deep, 1.0),
            np.where(inside, lamp_light, 0.0),
        ],
        axis=-1,
    )
    to_map = np.eye(4)
    to_map[0] = np.array([cos, sin, 0.0, -low[0]]) / size[0]
    to_map[1] = np.array([-sin, cos, 0.0, -low[1]]) / size[1]
    return cover.reshape(rows, columns, 4).astype(np.float32), to_map


def _strip(
    line: RoadLine,
    along: NDArray[np.float64],
    first: tuple[float, float],
    second: tuple[float, float],
    colour: Colour,
) -> Mesh:
    """Make a ribbon along the road between two points (lateral, height) [m]."""
    return wall_strip(line.point(along, *first), line.point(along, *second), colour)


def _tube(
    line: RoadLine, along: NDArray[np.float64], inner: float, outer: float
) -> list[Mesh]:
    """Make walls, tiled up to 3 m, and the ceiling of one tube."""
    bands = [(-0.3, 0.9, _WALL), (0.9, 3.2, _TILE), (3.2, _CEILING_M, _WALL)]
    parts = [
        _strip(line, along, (wall, low), (wall, high), colour)
        for wall in (inner, outer)
        for low, high, colour in bands
    ]
    ends = (inner, _CEILING_M), (outer, _CEILING_M)
    parts.append(_strip(line, along, *ends, _CEILING))
    kerb = outer - math.copysign(0.25, outer)
    parts.append(_strip(line, along, (kerb, 0.25), (outer, 0.25), _WALL))
    return parts


def _lamp_rows(
    line: RoadLine, tunnel: Tunnel, inner: float, outer: float
) -> list[Mesh]:
    """Make two rows of lamps below the ceiling of one tube."""
    first = math.ceil((tunnel.from_m + 1.0) / _LAMP_STEP_M) * _LAMP_STEP_M
    low, high = (-1.0, -0.14, -0.12), (1.0, 0.14, 0.0)
    lamp = box(low, high, _LAMP, Surface.LAMP)
    parts = []
    for along in np.arange(first, tunnel.to_m - 1.0, _LAMP_STEP_M):
        heading = float(line.heading_at(along))
        for share in (0.3, 0.7):
            lateral = inner + share * (outer - inner)
            point = line.point(along, lateral, _CEILING_M - 0.02)
            parts.append(lamp.moved(point, heading))
    return parts


def _portal(line: RoadLine, along_m: float) -> Mesh:
    """Make the concrete wall around both openings."""
    inner, outer = _walls(line)
    top, deep = _CROWN_M + 0.5, -1.2
    outlines = [
        [(-inner, deep), (inner, deep), (inner, _CEILING_M), (-inner, _CEILING_M)],
        [(-outer, _CEILING_M), (outer, _CEILING_M), (outer, top), (-outer, top)],
    ]
    slope = np.array([outer, outer + _HILL_M, outer + 0.8, outer])
    for side in (-1.0, 1.0):
        outlines.append(list(zip(side * slope, (deep, deep, top, top), strict=True)))
    triangles = []
    for outline in outlines:
        lateral, height = np.array(outline).T
        triangles.append(line.point(along_m, lateral, height)[[0, 1, 2, 0, 2, 3]])
    return triangle_mesh(np.array(triangles), _CONCRETE)


def _hill(line: RoadLine, along: NDArray[np.float64], season: str) -> Mesh:
    """Make the grass-covered roof and slopes."""
    _, outer = _walls(line)
    profile = [
        (-outer - _HILL_M - 2.0, -1.3),
        (-outer - 1.0, _CROWN_M),
        (0.0, _ROOF_M),
        (outer + 1.0, _CROWN_M),
        (outer + _HILL_M + 2.0, -1.3),
    ]
    return merge(
        _strip(line, along, first, second, _GRASS[season])
        for first, second in pairwise(profile)
    )
