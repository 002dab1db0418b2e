"""Road surface of a dual carriageway with markings, verges and fields."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import (
    Colour,
    Mesh,
    Surface,
    merge,
    quad_strip,
    quads,
    shaded,
    triangle_mesh,
)
from simbench.scenarios.geometry.road import RoadLine

__all__ = [
    "ASPHALT",
    "GRASS",
    "MARKING",
    "MARKING_M",
    "SHOULDER",
    "TRACK_EDGES_M",
    "TRACK_SHADES",
    "VERGE",
    "highway_ground",
]

GRASS: dict[str, Colour] = {"summer": (0.33, 0.38, 0.22), "autumn": (0.47, 0.42, 0.27)}
"""Colour of the fields in each season."""
ASPHALT: Colour = (0.36, 0.36, 0.365)
SHOULDER: Colour = (0.4, 0.395, 0.385)
MARKING: Colour = (0.88, 0.88, 0.85)
VERGE: Colour = (0.42, 0.4, 0.32)
MARKING_M = 0.15
"""Width of a marking."""
TRACK_EDGES_M = (-1.15, -0.6, 0.6, 1.15)
"""Edges of the two wheel tracks, from the middle of a lane."""
TRACK_SHADES = (1.0, 0.95, 0.98, 0.95, 1.0)
"""Brightness of the asphalt between them: tracks are darker."""

_YELLOW: Colour = (0.85, 0.68, 0.22)
_DASH_M = 4.0
_SAG_M, _LONGEST_M = 0.012, 20.0
"""Most that a bend is beside its straight parts, and longest of these."""


def highway_ground(line: RoadLine, start_m: float, end_m: float, season: str) -> Mesh:
    """Make asphalt with markings, verges and fields between two arc lengths [m].

    Markings are bands of the surface itself, not decals, which avoids z-fighting.
    """
    road = line.road
    is_bent = np.ptp(line.heading) > 1e-6 or np.ptp(line.pitch) > 1e-6
    fine = np.arange(start_m, end_m + _DASH_M, _DASH_M)
    bent = fine[_nodes(line, fine)]
    coarse = bent if is_bent else np.linspace(start_m, end_m, 40)
    grass = GRASS[season]
    inner, lane_m = road.median_m / 2.0, road.lane_width_m
    first, last = inner + 0.5, inner + 0.5 + road.lanes * lane_m
    parts = [_band(line, coarse, 1.0, (-inner, inner), grass, Surface.GRASS)]
    for side in (-1.0, 1.0):
        for low, high, colour in (
            (inner, first - MARKING_M, SHOULDER),
            (first - MARKING_M, first, _YELLOW),
            (last, last + MARKING_M, MARKING),
            (last + MARKING_M, line.edge_m, SHOULDER),
        ):
            parts.append(_band(line, coarse, side, (low, high), colour))
        for lane in range(road.lanes):
            low = first + lane * lane_m + (MARKING_M / 2 if lane else 0.0)
            high = first + (lane + 1) * lane_m
            high -= MARKING_M / 2 if lane < road.lanes - 1 else 0.0
            edges = [low, *((low + high) / 2.0 + np.array(TRACK_EDGES_M)), high]
            for ends, shade in zip(pairwise(edges), TRACK_SHADES, strict=True):
                parts.append(_band(line, coarse, side, ends, shaded(ASPHALT, shade)))
            if not lane:
                continue
            parts += _dashes(line, coarse, fine, side, (low - MARKING_M, low))
        parts += _verge(line, coarse, side, grass)
    return merge(parts)


def _nodes(line: RoadLine, along: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return indices of arc lengths, (N,) m, between which a line is straight enough.

    To `_SAG_M`; where its slope changes all are kept, so that no wheel loses its road.
    """
    heading, pitch = line.heading_at(along), line.pitch_at(along)
    kept = [0]
    for last in range(2, len(along)):
        first = kept[-1]
        length = along[last] - along[first]
        turn = np.ptp(heading[first : last + 1])
        is_even = np.ptp(pitch[first : last + 1]) < 1e-6
        if not is_even or length * turn / 8.0 > _SAG_M or length > _LONGEST_M:
            kept.append(last - 1)
    return np.array([*kept, len(along) - 1])


def _band(
    line: RoadLine,
    along: NDArray[np.float64],
    side: float,
    ends: tuple[float, float],
    colour: Colour,
    surface: Surface = Surface.ASPHALT,
    drop: tuple[float, float] = (0.0, 0.0),
) -> Mesh:
    """Make a ribbon between two distances from the middle, lowered by ``drop`` [m].

    ``side`` is 1 for the left of the line and -1 for its mirror image on the right.
    """
    (low, high), (low_drop, high_drop) = ends, drop
    if side < 0.0:
        low, high, low_drop, high_drop = -high, -low, high_drop, low_drop
    left, right = line.point(along, high, -high_drop), line.point(along, low, -low_drop)
    return quad_strip(left, right, colour, surface)


def _dashes(
    line: RoadLine,
    nodes: NDArray[np.float64],
    along: NDArray[np.float64],
    side: float,
    ends: tuple[float, float],
) -> list[Mesh]:
    """Make 4 m of marking and 8 m of asphalt in turn, of `_DASH_M` a step.

    They lie on straight lines between ``nodes``, as the bands beside them: no gaps.
    """
    low, high = ends if side > 0.0 else (-ends[1], -ends[0])
    left, right = (
        np.stack([np.interp(along, nodes, values) for values in points.T], axis=-1)
        for points in (line.point(nodes, high), line.point(nodes, low))
    )
    corners = np.stack([left[:-1], right[:-1], right[1:], left[1:]])
    is_marked = np.arange(len(along) - 1) % 3 == 0
    return [
        triangle_mesh(quads(*corners[:, chosen]), colour, Surface.ASPHALT)
        for chosen, colour in ((is_marked, MARKING), (~is_marked, ASPHALT))
    ]


def _verge(
    line: RoadLine, along: NDArray[np.float64], side: float, grass: Colour
) -> list[Mesh]:
    """Make the ditch beside the shoulder and the field beyond it."""
    edge = line.edge_m
    profile = [(edge, 0.0), (edge + 1.5, 0.12), (edge + 5, 0.7), (edge + 12, 0.35)]
    profile += [(edge + 60, 0.8), (edge + 500, 3.0)]
    dark = shaded(grass, 0.9)
    colours = [VERGE, grass, dark, grass, dark]
    return [
        _band(line, along, side, (a, b), colour, Surface.GRASS, (a_drop, b_drop))
        for ((a, a_drop), (b, b_drop)), colour in zip(
            pairwise(profile), colours, strict=True
        )
    ]
