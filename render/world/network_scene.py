"""Static scene of a SUMO network: asphalt, junctions, markings, grass, roadside.

Markings lie slightly above the asphalt, shoulders and grass slightly below it, which
avoids z-fighting.
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
    quads,
    shaded,
    triangle_mesh,
)
from simbench.render.world.network_roadside import lamps_along, plants_along
from simbench.render.world.polygons import dashes, offset, resample, triangulate
from simbench.render.world.road_surface import (
    ASPHALT,
    GRASS,
    MARKING,
    MARKING_M,
    SHOULDER,
    TRACK_EDGES_M,
    TRACK_SHADES,
    VERGE,
)
from simbench.render.world.static_scene import StaticScene
from simbench.scenarios.network.shapes import Lane, Network
from simbench.scenarios.stage import Stage

__all__ = ["network_scene"]

_PATH: Colour = (0.55, 0.54, 0.52)
_MARKING_UP_M, _SHOULDER_DOWN_M, _VERGE_DOWN_M, _GRASS_DOWN_M = 0.015, 0.02, 0.06, 0.14
_STOP_LINE_M = 0.45
_JOIN_M, _MARKING_JOIN_M = 6.0, 1.5
_FAST_MPS = 19.0  # faster roads have shoulders and longer dashes
_SEEN_M, _PLANTED_M, _FINE_M = 700.0, 450.0, 250.0
_FIELD_M = 1500.0
_CELL_M = 20.0


def network_scene(
    stage: Stage, network: Network, eyes: NDArray[np.float64], rng: np.random.Generator
) -> StaticScene:
    """Build the part of a network near the cameras, at ``eyes``, and the target."""
    surroundings = stage.scenario.surroundings
    path = stage.trajectories.positions[:, stage.trajectories.target]
    path = path[~np.isnan(path[:, 0])]
    seen = np.concatenate([eyes, path])
    middle = seen.mean(axis=0)
    low, high = seen.min(axis=0)[:2] - _SEEN_M, seen.max(axis=0)[:2] + _SEEN_M

    def is_seen(shape: NDArray[np.float64]) -> bool:
        return bool(np.all(shape.max(0)[:2] > low) and np.all(shape.min(0)[:2] < high))

    origin = np.array(stage.line.map_origin)
    lanes = {
        lane.name: shape
        for lane in network.lanes.values()
        if lane.kind != "other" and is_seen(shape := _clean(lane.shape - origin))
    }
    if not lanes:
        raise RenderError(
            f"{stage.scenario.name}: expected a road within {_SEEN_M:g} m of the "
            "target, got none that cars use"
        )
    edges = {
        name: visible
        for name, group in network.edges.items()
        if (visible := [lane for lane in group if lane.name in lanes])
    }
    watched = cKDTree(seen[:, :2])

    def is_near(shape: NDArray[np.float64], reach_m: float) -> bool:
        return bool(watched.query(resample(shape, 40.0)[:, :2])[0].min() < reach_m)

    parts = [
        _asphalt(network.lanes[name], shape, is_near(shape, _FINE_M))
        for name, shape in lanes.items()
    ]
    for junction in network.junctions:
        outline = junction.shape - origin
        if is_seen(outline):
            parts.append(triangle_mesh(triangulate(outline), ASPHALT, Surface.ASPHALT))
    for name, group in edges.items():
        ends_at = network.ends_at.get(name, "")
        parts += _edge(group, [lanes[lane.name] for lane in group], ends_at)
    points = np.concatenate([resample(shape) for shape in lanes.values()])
    roads = cKDTree(points[:, :2])
    parts.append(_grass(points, roads, middle, surroundings.season))
    objects = lamps_along(edges, lanes, roads, surroundings)
    planted = {
        name: group
        for name, group in edges.items()
        if is_near(lanes[group[0].name], _PLANTED_M)
    }
    objects += plants_along(planted, lanes, roads, surroundings, eyes, path, rng)
    return StaticScene(merge(parts), objects, middle)


def _clean(shape: NDArray[np.float64]) -> NDArray[np.float64]:
    """Drop points that repeat their predecessor; at least two points remain."""
    step = np.linalg.norm(np.diff(shape[:, :2], axis=0), axis=1)
    kept: NDArray[np.float64] = shape[np.concatenate([[True], step > 1e-3])]
    if len(kept) < 2:
        kept = np.stack([kept[0], kept[0] + [0.01, 0.0, 0.0]])
    return kept


def _ribbon(
    shape: NDArray[np.float64],
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


def _asphalt(lane: Lane, shape: NDArray[np.float64], is_fine: bool) -> Mesh:
    """Make the surface of one lane, near the camera with darker wheel tracks."""
    half = lane.width / 2.0
    if lane.kind == "path":
        return _ribbon(shape, -half, half, _PATH)
    if not is_fine or half < 1.3 or lane.kind == "inside":
        return _ribbon(shape, -half, half, ASPHALT)
    ends = pairwise([-half, *TRACK_EDGES_M, half])
    return merge(
        _ribbon(shape, low, high, shaded(ASPHALT, shade))
        for (low, high), shade in zip(ends, TRACK_SHADES, strict=True)
    )


def _edge(
    group: list[Lane], shapes: list[NDArray[np.float64]], ends_at: str
) -> list[Mesh]:
    """Make an edge's shoulders, verges and markings, with stop lines at lights."""
    driven = [
        (lane, shape)
        for lane, shape in zip(group, shapes, strict=True)
        if lane.kind == "road"
    ]
    if not driven:
        return []
    is_fast = driven[0][0].speed > _FAST_MPS
    outer_m, inner_m = (2.0, 0.8) if is_fast else (0.4, 0.4)
    parts = []
    for (lane, shape), side, paved in (
        (driven[0], -1.0, outer_m),
        (driven[-1], 1.0, inner_m),
    ):
        edge = lane.width / 2.0
        joined = _extended(shape, _JOIN_M if is_fast else 0.0)
        for reach, colour, down, surface in (
            (paved, SHOULDER, _SHOULDER_DOWN_M, Surface.ASPHALT),
            (paved + 1.5, VERGE, _VERGE_DOWN_M, Surface.GRASS),
        ):
            low, high = sorted((0.0, side * (edge + reach)))
            parts.append(_ribbon(joined, low, high, colour, -down, surface))
        low, high = sorted((side * (edge - MARKING_M), side * edge))
        joined = _extended(shape, _MARKING_JOIN_M if is_fast else 0.0)
        parts.append(_ribbon(joined, low, high, MARKING, _MARKING_UP_M))
    for (lane, shape), (next_lane, _) in pairwise(driven):
        parts += _divider(lane, next_lane, shape, is_fast)
    if ends_at.startswith("traffic_light"):
        parts += [_stop_line(lane, shape) for lane, shape in driven]
    return parts


def _extended(shape: NDArray[np.float64], by_m: float) -> NDArray[np.float64]:
    """Extend a polyline straight at both ends, over the joint to the next edge."""
    if by_m == 0.0:
        return shape
    first, last = shape[0] - shape[1], shape[-1] - shape[-2]
    before = shape[0] + by_m * first / np.linalg.norm(first)
    after = shape[-1] + by_m * last / np.linalg.norm(last)
    return np.concatenate([before[None], shape, after[None]])


def _divider(
    lane: Lane, left: Lane, shape: NDArray[np.float64], is_fast: bool
) -> list[Mesh]:
    """Make the dashes between two lanes: short and broad where their routes part."""
    dash, gap, width = (4.0, 8.0, MARKING_M) if is_fast else (3.0, 4.5, MARKING_M)
    if lane.leads_to != left.leads_to:
        dash, gap, width = 3.0, 3.0, 2.0 * MARKING_M
    low, high = lane.width / 2.0 - width / 2.0, lane.width / 2.0 + width / 2.0
    return [
        _ribbon(part, low, high, MARKING, _MARKING_UP_M)
        for part in dashes(shape, dash, gap)
    ]


def _stop_line(lane: Lane, shape: NDArray[np.float64]) -> Mesh:
    end, before = shape[-1], shape[-2]
    back = (before - end) / np.linalg.norm(before - end)
    line = np.stack([end + back * (_STOP_LINE_M + 0.2), end + back * 0.2])
    half = lane.width / 2.0 - MARKING_M
    return _ribbon(line, -half, half, MARKING, _MARKING_UP_M)


def _grass(
    points: NDArray[np.float64],
    roads: cKDTree,
    middle: NDArray[np.float64],
    season: str,
) -> Mesh:
    """Make fields below the points (N, 3) of the roads: flat, or following them."""
    low, high = middle[:2] - _FIELD_M, middle[:2] + _FIELD_M
    if np.ptp(points[:, 2]) < 0.05:
        xs, ys = np.array([low[0], high[0]]), np.array([low[1], high[1]])
        height = np.full((2, 2), float(points[:, 2].min()) - _GRASS_DOWN_M)
    else:
        inner = np.maximum(points[:, :2].min(axis=0) - 100.0, low)
        outer = np.minimum(points[:, :2].max(axis=0) + 100.0, high)
        first, last = np.minimum(low, inner - 1.0), np.maximum(high, outer + 1.0)
        xs, ys = (
            np.array([first[n], *np.arange(inner[n], outer[n], _CELL_M), last[n]])
            for n in (0, 1)
        )
        nodes = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2)
        # The lowest of the nearest road points: a bridge does not raise the field.
        nearest = roads.query(nodes, k=12)[1]
        height = points[nearest, 2].min(axis=1).reshape(len(xs), len(ys)) - 0.4
    x, y = np.meshgrid(xs, ys, indexing="ij")
    grid = np.stack([x, y, height], axis=-1)
    triangles = quads(grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:])
    return triangle_mesh(triangles, GRASS[season], Surface.GRASS)
