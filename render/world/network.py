"""A SUMO network to look at: asphalt, junctions, marks, grass and trees.

Marks lie a finger's breadth above the asphalt, the shoulders and the grass a little
below it: surfaces at one height would flicker through each other.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simbench.core.errors import RenderError
from simbench.render.world.mesh import (
    Colour,
    Mesh,
    Surface,
    merge,
    quad_strip,
    shaded,
    soup,
)
from simbench.render.world.network_sides import lamps_along, trees_along
from simbench.render.world.polygons import dashes, dotted, offset, triangulated
from simbench.render.world.projection import SHADOW_RADIUS_M
from simbench.render.world.setting import Setting
from simbench.render.world.surroundings import GRASS
from simbench.scenarios.network.shapes import Lane, Network
from simbench.scenarios.stage import Stage

__all__ = ["network_setting"]

Shape = NDArray[np.float64]

_ASPHALT: Colour = (0.36, 0.36, 0.365)
_SHOULDER: Colour = (0.4, 0.395, 0.385)
_PATH: Colour = (0.55, 0.54, 0.52)
_MARK: Colour = (0.88, 0.88, 0.85)
_VERGE: Colour = (0.42, 0.4, 0.32)
_MARK_UP_M, _SHOULDER_DOWN_M, _VERGE_DOWN_M, _GRASS_DOWN_M = 0.015, 0.02, 0.06, 0.14
_MARK_M, _STOP_M = 0.15, 0.45
_JOIN_M, _MARK_JOIN_M = 6.0, 1.5
_FAST_MPS = 19.0  # faster roads have shoulders and longer dashes
_SEEN_M, _GROWN_M, _FINE_M = 700.0, 450.0, 250.0
_FIELD_M = 1500.0
_CELL_M = 20.0
_TRACKS = ((-1.15, 0.95), (-0.6, 0.98), (0.6, 0.95), (1.15, 1.0))


def network_setting(
    stage: Stage, network: Network, eyes: NDArray[np.float64], rng: np.random.Generator
) -> Setting:
    """Build the part of a network about the cameras, at ``eyes``, and the target."""
    wanted = stage.scenario.surroundings
    way = stage.trajectories.positions[:, stage.trajectories.target]
    way = way[~np.isnan(way[:, 0])]
    seen = np.concatenate([eyes, way])
    low, high = seen.min(axis=0)[:2] - _SEEN_M, seen.max(axis=0)[:2] + _SEEN_M

    def is_seen(shape: Shape) -> bool:
        return bool(np.all(shape.max(0)[:2] > low) and np.all(shape.min(0)[:2] < high))

    origin = np.array(stage.line.map_origin)
    lanes = {
        lane.name: shape
        for lane in network.lanes.values()
        if lane.kind != "other" and is_seen(shape := _clean(lane.shape - origin))
    }
    if not lanes:
        raise RenderError(
            f"{stage.scenario.name}: wanted a road within {_SEEN_M:g} m of the target, "
            "found none that cars use"
        )
    edges = {
        name: [lane for lane in group if lane.name in lanes]
        for name, group in network.edges.items()
    }
    edges = {name: group for name, group in edges.items() if group}
    watched = cKDTree(seen[:, :2])

    def is_near(shape: Shape, reach_m: float) -> bool:
        return bool(watched.query(dotted(shape, 40.0)[:, :2])[0].min() < reach_m)

    parts = [
        _surface(network.lanes[name], shape, is_near(shape, _FINE_M))
        for name, shape in lanes.items()
    ]
    for junction in network.junctions:
        outline = junction.shape - origin
        if is_seen(outline):
            parts.append(soup(triangulated(outline), _ASPHALT, Surface.ASPHALT))
    for name, group in edges.items():
        ends_at = network.ends_at.get(name, "")
        parts += _edge(group, [lanes[lane.name] for lane in group], ends_at)
    roads = np.concatenate([dotted(shape) for shape in lanes.values()])
    near = cKDTree(roads[:, :2])
    parts.append(_grass(roads, near, seen.mean(axis=0), wanted.season))
    standing = lamps_along(edges, lanes, near, wanted)
    green = {
        name: group
        for name, group in edges.items()
        if is_near(lanes[group[0].name], _GROWN_M)
    }
    standing += trees_along(green, lanes, near, wanted, eyes, way, rng)
    return Setting(merge(parts), standing, seen.mean(axis=0), SHADOW_RADIUS_M)


def _clean(shape: Shape) -> Shape:
    """Leave out points that repeat their neighbour."""
    step = np.linalg.norm(np.diff(shape[:, :2], axis=0), axis=1)
    kept: Shape = shape[np.concatenate([[True], step > 1e-3])]
    if len(kept) < 2:  # a lane of no length still lies somewhere
        kept = np.stack([kept[0], kept[0] + [0.01, 0.0, 0.0]])
    return kept


def _ribbon(
    shape: Shape,
    low: float,
    high: float,
    colour: Colour,
    up: float = 0.0,
    surface: Surface = Surface.ASPHALT,
) -> Mesh:
    """Make a ribbon between two distances to the left of a polyline [m]."""
    raised = np.array([0.0, 0.0, up])
    left, right = offset(shape, high) + raised, offset(shape, low) + raised
    return quad_strip(left, right, colour, surface)


def _surface(lane: Lane, shape: Shape, is_fine: bool) -> Mesh:
    """Make one lane's asphalt, near by darker where the wheels roll."""
    half = lane.width / 2.0
    if lane.kind == "path":
        return _ribbon(shape, -half, half, _PATH)
    if not is_fine or half < 1.3 or lane.kind == "inside":
        return _ribbon(shape, -half, half, _ASPHALT)
    places = [-half, *(place for place, _ in _TRACKS), half]
    shades = [1.0, *(shade for _, shade in _TRACKS)]
    return merge(
        _ribbon(shape, low, high, shaded(_ASPHALT, shade))
        for (low, high), shade in zip(pairwise(places), shades, strict=True)
    )


def _edge(group: list[Lane], shapes: list[Shape], ends_at: str) -> list[Mesh]:
    """Make an edge's shoulders, verges and marks, and its stop line at lights."""
    driven = [
        (lane, shape)
        for lane, shape in zip(group, shapes, strict=True)
        if lane.kind == "road"
    ]
    if not driven:
        return []
    (right, right_shape), (left, left_shape) = driven[0], driven[-1]
    is_fast = right.speed > _FAST_MPS
    out, inn = (2.0, 0.8) if is_fast else (0.4, 0.4)
    parts = []
    for lane, shape, side, paved in (
        (right, right_shape, -1.0, out),
        (left, left_shape, 1.0, inn),
    ):
        edge = lane.width / 2.0
        for reach, colour, down, surface in (
            (paved, _SHOULDER, _SHOULDER_DOWN_M, Surface.ASPHALT),
            (paved + 1.5, _VERGE, _VERGE_DOWN_M, Surface.GRASS),
        ):
            low, high = sorted((0.0, side * (edge + reach)))
            beyond = _lengthened(shape, _JOIN_M if is_fast else 0.0)
            parts.append(_ribbon(beyond, low, high, colour, -down, surface))
        a, b = sorted((side * (edge - _MARK_M), side * edge))
        drawn = _lengthened(shape, _MARK_JOIN_M if is_fast else 0.0)
        parts.append(_ribbon(drawn, a, b, _MARK, _MARK_UP_M))
    for (lane, shape), (next_lane, _) in pairwise(driven):
        parts += _divider(lane, next_lane, shape, is_fast)
    if ends_at.startswith("traffic_light"):
        parts += [_stop_line(lane, shape) for lane, shape in driven]
    return parts


def _lengthened(shape: Shape, by_m: float) -> Shape:
    """Draw a polyline out straight at both ends, over the joint to the next edge."""
    if by_m == 0.0:
        return shape
    first, last = shape[0] - shape[1], shape[-1] - shape[-2]
    before = shape[0] + by_m * first / np.linalg.norm(first)
    after = shape[-1] + by_m * last / np.linalg.norm(last)
    return np.concatenate([before[None], shape, after[None]])


def _divider(lane: Lane, left: Lane, shape: Shape, is_fast: bool) -> list[Mesh]:
    """Make the dashes between two lanes: short and broad where their ways part."""
    dash, gap, width = (4.0, 8.0, _MARK_M) if is_fast else (3.0, 4.5, _MARK_M)
    if lane.leads_to != left.leads_to:
        dash, gap, width = 3.0, 3.0, 2.0 * _MARK_M
    middle = lane.width / 2.0
    return [
        _ribbon(part, middle - width / 2.0, middle + width / 2.0, _MARK, _MARK_UP_M)
        for part in dashes(shape, dash, gap)
    ]


def _stop_line(lane: Lane, shape: Shape) -> Mesh:
    end, before = shape[-1], shape[-2]
    back = (before - end) / np.linalg.norm(before - end)
    line = np.stack([end + back * (_STOP_M + 0.2), end + back * 0.2])
    half = lane.width / 2.0 - _MARK_M
    return _ribbon(line, -half, half, _MARK, _MARK_UP_M)


def _grass(
    roads: Shape, near: cKDTree, middle: NDArray[np.float64], season: str
) -> Mesh:
    """Lay fields below the roads: flat, or following them where they rise."""
    low, high = middle[:2] - _FIELD_M, middle[:2] + _FIELD_M
    level = float(roads[:, 2].min()) - _GRASS_DOWN_M
    if np.ptp(roads[:, 2]) < 0.05:
        xs, ys = np.array([low[0], high[0]]), np.array([low[1], high[1]])
        height = np.full((2, 2), level)
    else:
        inner = np.maximum(roads[:, :2].min(axis=0) - 100.0, low)
        outer = np.minimum(roads[:, :2].max(axis=0) + 100.0, high)
        xs, ys = (
            np.concatenate(
                [
                    [min(low[axis], inner[axis] - 1.0)],
                    np.arange(inner[axis], outer[axis], _CELL_M),
                    [max(high[axis], outer[axis] + 1.0)],
                ]
            )
            for axis in (0, 1)
        )
        spots = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
        # The lowest of the roads near by: a bridge does not drag the meadow up.
        beside = near.query(spots, k=12)[1]
        height = roads[beside, 2].min(axis=1).reshape(len(xs), len(ys)) - 0.4
    x, y = np.meshgrid(xs, ys, indexing="ij")
    nodes = np.stack([x, y, height], axis=-1)
    a, b, c, d = nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]
    corners = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)])
    return soup(corners.reshape(-1, 3, 3), GRASS[season], Surface.GRASS)
