"""The road and what lines it: surface and marks, rails, lamps, gantries, trees, hills.

Every function returns meshes in the road frame; `Ground` lies flat and casts no shadow,
everything else stands.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import (
    Colour,
    Mesh,
    Surface,
    box,
    cylinder,
    merge,
    quad_strip,
    shaded,
    soup,
)
from simbench.scenarios.geometry.road import RoadLine

__all__ = [
    "GRASS",
    "gantry",
    "ground",
    "guard_rails",
    "hills",
    "lamp_post",
    "pole",
    "sign",
]

GRASS: dict[str, Colour] = {"summer": (0.33, 0.38, 0.22), "autumn": (0.47, 0.42, 0.27)}
"""The fields' green of each season."""

_ASPHALT: Colour = (0.36, 0.36, 0.365)
_SHOULDER: Colour = (0.4, 0.395, 0.385)
_MARK: Colour = (0.88, 0.88, 0.85)
_YELLOW_MARK: Colour = (0.85, 0.68, 0.22)
_STEEL: Colour = (0.62, 0.64, 0.66)
_SIGN_GREEN: Colour = (0.02, 0.33, 0.2)
_SIGN_WHITE: Colour = (0.92, 0.93, 0.92)
_DASH_M = 4.0
_MARK_M = 0.15


def ground(line: RoadLine, start_m: float, end_m: float, season: str) -> Mesh:
    """Make asphalt with marks, verges and fields between two arc lengths [m].

    Marks are bands of the surface itself, not decals: nothing can flicker through.
    """
    road = line.road
    bent = np.ptp(line.heading) > 1e-6 or np.ptp(line.pitch) > 1e-6
    fine = np.arange(start_m, end_m + _DASH_M, _DASH_M)
    coarse = fine if bent else np.linspace(start_m, end_m, 40)
    grass = GRASS[season]
    inner, lane_m = road.median_m / 2.0, road.lane_width_m
    first, last = inner + 0.5, inner + 0.5 + road.lanes * lane_m
    parts = [_band(line, coarse, -inner, inner, grass, Surface.GRASS)]
    for side in (-1.0, 1.0):
        edges = [
            (inner, first - _MARK_M, _SHOULDER),
            (first - _MARK_M, first, _YELLOW_MARK),
            (last, last + _MARK_M, _MARK),
            (last + _MARK_M, line.edge_m, _SHOULDER),
        ]
        for low, high, colour in edges:
            parts.append(_side_band(line, coarse, side, low, high, colour))
        for lane in range(road.lanes):
            low = first + lane * lane_m + (_MARK_M / 2 if lane else 0.0)
            high = first + (lane + 1) * lane_m
            high -= _MARK_M / 2 if lane < road.lanes - 1 else 0.0
            parts += _lane_surface(line, coarse, side, low, high)
            if lane:
                parts += _dashes(line, fine, side, low - _MARK_M, low)
        parts.append(_verge(line, coarse, side, grass))
    return merge(parts)


def _band(
    line: RoadLine,
    along: NDArray[np.float64],
    low: float,
    high: float,
    colour: Colour,
    surface: Surface,
    drop: tuple[float, float] = (0.0, 0.0),
) -> Mesh:
    """Make a ribbon between two lateral places, lowered by ``drop`` at each [m]."""
    left = line.point(along, high, -drop[1])
    right = line.point(along, low, -drop[0])
    return quad_strip(left, right, colour, surface)


def _side_band(
    line: RoadLine,
    along: NDArray[np.float64],
    side: float,
    low: float,
    high: float,
    colour: Colour,
) -> Mesh:
    a, b = sorted((side * low, side * high))
    return _band(line, along, a, b, colour, Surface.ASPHALT)


def _lane_surface(
    line: RoadLine, along: NDArray[np.float64], side: float, low: float, high: float
) -> list[Mesh]:
    """Make one lane's asphalt, darker where the wheels roll."""
    middle = (low + high) / 2.0
    places = [low, *(middle + np.array([-1.15, -0.6, 0.6, 1.15])), high]
    shades = [1.0, 0.95, 0.98, 0.95, 1.0]
    return [
        _side_band(
            line,
            along,
            side,
            places[n],
            places[n + 1],
            (_ASPHALT[0] * shade, _ASPHALT[1] * shade, _ASPHALT[2] * shade),
        )
        for n, shade in enumerate(shades)
    ]


def _dashes(
    line: RoadLine, along: NDArray[np.float64], side: float, low: float, high: float
) -> list[Mesh]:
    """Make one dash in three steps: 4 m of mark, 8 m of asphalt."""
    parts = []
    for index in range(len(along) - 1):
        colour = _MARK if index % 3 == 0 else _ASPHALT
        parts.append(
            _side_band(line, along[index : index + 2], side, low, high, colour)
        )
    return parts


def _verge(
    line: RoadLine, along: NDArray[np.float64], side: float, grass: Colour
) -> Mesh:
    """Make the ditch beside the shoulder and the field beyond it."""
    edge = line.edge_m
    profile = [(edge, 0.0), (edge + 1.5, 0.12), (edge + 5, 0.7), (edge + 12, 0.35)]
    profile += [(edge + 60, 0.8), (edge + 500, 3.0)]
    dark = shaded(grass, 0.9)
    colours = [(0.42, 0.4, 0.32), grass, dark, grass, dark]
    parts = []
    for (a, high), (b, low), colour in zip(
        profile[:-1], profile[1:], colours, strict=True
    ):
        ends, drop = (side * a, side * b), (high, low)
        if side < 0:
            ends, drop = ends[::-1], drop[::-1]
        surface = Surface.GRASS
        parts.append(_band(line, along, ends[0], ends[1], colour, surface, drop))
    return merge(parts)


def guard_rails(line: RoadLine, start_m: float, end_m: float) -> Mesh:
    """Make steel rails on posts along the median and both outer edges."""
    along = np.arange(start_m, end_m, 8.0)
    parts = []
    inner, outer = line.road.median_m / 2.0 - 0.1, line.edge_m + 0.3
    for lateral in (-outer, -inner, inner, outer):
        face = 0.04 if lateral in (-inner, outer) else -0.04
        for low, high, bulge in ((0.5, 0.6, 0.0), (0.6, 0.7, face), (0.7, 0.8, 0.0)):
            bottom = line.point(along, lateral + bulge, low)
            top = line.point(along, lateral, high)
            parts.append(_wall(bottom, top, _STEEL))
        for base in line.point(along, lateral + face)[:, :]:
            low_corner, high_corner = base - [0.05, 0.05, 0], base + [0.05, 0.05, 0.7]
            parts.append(_post(low_corner, high_corner))
    return merge(parts)


def _wall(
    bottom: NDArray[np.float64], top: NDArray[np.float64], colour: Colour
) -> Mesh:
    a, b, c, d = bottom[:-1], bottom[1:], top[1:], top[:-1]
    triangles = np.concatenate(
        [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    )
    return soup(triangles, colour)


def _post(low: NDArray[np.float64], high: NDArray[np.float64]) -> Mesh:
    """Make the two visible planes of a thin post: four triangles instead of twelve."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = np.array(
        [
            [[x0, y0, z0], [x1, y1, z0], [x1, y1, z1]],
            [[x0, y0, z0], [x1, y1, z1], [x0, y0, z1]],
            [[x1, y0, z0], [x0, y1, z0], [x0, y1, z1]],
            [[x1, y0, z0], [x0, y1, z1], [x1, y0, z1]],
        ]
    )
    return soup(corners, (0.45, 0.46, 0.47))


def pole(width_m: float, height_m: float) -> Mesh:
    """Make a round steel pole of the given diameter, foot at the origin."""
    radius = width_m / 2.0
    shaft = cylinder((0, 0, -0.5), (0, 0, height_m), radius, _STEEL, sides=32)
    foot = cylinder(
        (0, 0, -0.5), (0, 0, 0.12), radius * 1.6, (0.5, 0.5, 0.49), sides=12
    )
    return merge([shaft, foot])


def sign(
    width_m: float, panel_m: float, middle: tuple[float, float], tilt_rad: float = 0.0
) -> Mesh:
    """Make a sign on a post, facing against x; its panel's middle is at y, z [m]."""
    y, z = middle
    post = cylinder((0.06, y, -0.5), (0.06, y, z), 0.06, _STEEL, sides=10)
    panel = _panel(0.0, 0.0, 0.0, width_m, panel_m).tilted(tilt_rad)
    return merge([post, panel.moved((0.0, y, z))])


def _panel(x: float, y: float, z: float, width: float, height: float) -> Mesh:
    """Make a green panel with a white border and bars where the lettering would be."""
    half, tall = width / 2.0, height / 2.0
    board = box((x - 0.02, y - half, z - tall), (x + 0.04, y + half, z + tall), _STEEL)
    parts = [board]
    rim, face = x - 0.025, x - 0.03
    white_low, white_high = (rim, y - half, z - tall), (x, y + half, z + tall)
    parts.append(box(white_low, white_high, _SIGN_WHITE))
    edge = min(half, tall) * 0.07
    green_low = (face, y - half + edge, z - tall + edge)
    parts.append(box(green_low, (x, y + half - edge, z + tall - edge), _SIGN_GREEN))
    for row, share in ((0.35, 0.7), (-0.05, 0.5), (-0.45, 0.6)):
        bar = (face - 0.005, y - half * share, z + tall * row)
        bar_high = (x, y + half * share * 0.8, z + tall * (row + 0.22))
        parts.append(box(bar, bar_high, _SIGN_WHITE))
    return merge(parts)


def gantry(span_m: float, clearance_m: float = 6.0, beam_m: float = 0.9) -> Mesh:
    """Make a sign gantry across one carriageway, its beam running from y = 0 left.

    Parameters
    ----------
    span_m : float, m
        Distance between its two posts.
    clearance_m, beam_m : float, m
        Height of the beam's underside, and of the beam.
    """
    top = clearance_m + beam_m
    parts = [
        cylinder((0, y, -0.5), (0, y, top), 0.2, _STEEL, sides=12)
        for y in (0.0, span_m)
    ]
    for z in (clearance_m, top):
        for x in (-0.3, 0.3):
            parts.append(
                box((x - 0.06, 0, z - 0.06), (x + 0.06, span_m, z + 0.06), _STEEL)
            )
    bays = max(2, round(span_m / 1.5))
    for bay in range(bays):
        a, b = span_m * bay / bays, span_m * (bay + 1) / bays
        low, high = (clearance_m, top) if bay % 2 else (top, clearance_m)
        for x in (-0.3, 0.3):
            parts.append(cylinder((x, a, low), (x, b, high), 0.04, _STEEL, sides=5))
    count = max(1, round(span_m / 5.5))
    for number in range(count):
        y = span_m * (number + 0.5) / count
        parts.append(_panel(-0.42, y, clearance_m + 0.6, 3.6, 2.2))
    return merge(parts)


def lamp_post(height_m: float = 10.0, arm_m: float = 2.2) -> Mesh:
    """Make a street lamp, its arm towards +y."""
    tip = (0.0, arm_m, height_m)
    return merge(
        [
            cylinder(
                (0, 0, -0.5), (0, 0, height_m - 0.3), 0.1, _STEEL, end_radius=0.06
            ),
            cylinder((0, 0, height_m - 0.35), tip, 0.05, _STEEL, sides=7),
            box(
                (-0.14, arm_m - 0.2, height_m - 0.06),
                (0.14, arm_m + 0.5, height_m + 0.06),
                (0.8, 0.8, 0.76),
                Surface.LAMP,
            ),
        ]
    )


def hills(center: NDArray[np.float64], season: str, rng: np.random.Generator) -> Mesh:
    """Make a ring of wooded hills far away."""
    count = 96
    angle = 2.0 * math.pi * np.arange(count + 1) / count
    height = np.zeros(count + 1)
    for wave in range(2, 14):
        phase, size = rng.uniform(0, 2 * math.pi), rng.uniform(4, 26) / wave**0.6
        height += size * np.sin(wave * angle + phase)
    height = 24.0 + np.abs(height)
    height[-1] = height[0]
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    foot = np.column_stack([ring * 760.0 + center[:2], np.full(count + 1, -25.0)])
    crest = np.column_stack([ring * 1000.0 + center[:2], height])
    colour = (0.36, 0.3, 0.17) if season == "autumn" else (0.2, 0.29, 0.15)
    return _wall(foot + [0, 0, center[2]], crest + [0, 0, center[2]], colour)
