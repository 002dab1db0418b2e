"""Street furniture: guard rails, lamp posts, poles, signs and gantries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import (
    Colour,
    Mesh,
    Surface,
    box,
    cylinder,
    merge,
    triangle_mesh,
    wall_strip,
)
from simbench.scenarios.geometry.road import RoadLine

__all__ = ["gantry", "guard_rails", "lamp_post", "pole", "sign"]

_STEEL: Colour = (0.62, 0.64, 0.66)
_SIGN_GREEN: Colour = (0.02, 0.33, 0.2)
_SIGN_WHITE: Colour = (0.92, 0.93, 0.92)


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
            parts.append(wall_strip(bottom, top, _STEEL))
        bases = line.point(along, lateral + face)
        parts.append(_posts(bases - [0.05, 0.05, 0], bases + [0.05, 0.05, 0.7]))
    return merge(parts)


def _posts(low: NDArray[np.float64], high: NDArray[np.float64]) -> Mesh:
    """Make the two visible planes of thin posts: four triangles instead of twelve.

    ``low`` and ``high`` are opposite corners of the N posts, (N, 3) m.
    """
    picks = [  # of each corner of the triangles: x, y and z of low (0) or high (1)
        [[0, 0, 0], [1, 1, 0], [1, 1, 1]],
        [[0, 0, 0], [1, 1, 1], [0, 0, 1]],
        [[1, 0, 0], [0, 1, 0], [0, 1, 1]],
        [[1, 0, 0], [0, 1, 1], [1, 0, 1]],
    ]
    ends = np.stack([low, high], axis=1)
    return triangle_mesh(ends[:, np.array(picks), np.arange(3)], (0.45, 0.46, 0.47))


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
    """Make a green panel with a white border and white bars instead of lettering."""
    half, tall = width / 2.0, height / 2.0
    rim, face = x - 0.025, x - 0.03
    parts = [
        box((x - 0.02, y - half, z - tall), (x + 0.04, y + half, z + tall), _STEEL),
        box((rim, y - half, z - tall), (x, y + half, z + tall), _SIGN_WHITE),
    ]
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
