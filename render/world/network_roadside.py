"""Lamp posts and plants beside the roads of a SUMO network."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simbench.render.world.mesh import Mesh
from simbench.render.world.polygons import arc_lengths, offset
from simbench.render.world.street_furniture import lamp_post
from simbench.render.world.vegetation import plant
from simbench.scenarios.network.shapes import Lane
from simbench.scenarios.schema import Surroundings
from simbench.scenarios.schema.seeds import child_generator

__all__ = ["lamps_along", "plants_along"]


def _positions(
    shape: NDArray[np.float64], spacing_m: float
) -> Iterator[tuple[NDArray[np.float64], float]]:
    """Yield points (3,) m along a polyline and its heading there [rad]."""
    arc = arc_lengths(shape)
    for at in np.arange(spacing_m / 2.0, arc[-1], spacing_m):
        n = min(int(np.searchsorted(arc, at, side="right")) - 1, len(shape) - 2)
        step = shape[n + 1] - shape[n]
        point = shape[n] + step * (at - arc[n]) / (arc[n + 1] - arc[n])
        yield point, math.atan2(step[1], step[0])


def lamps_along(
    edges: dict[str, list[Lane]],
    lanes: dict[str, NDArray[np.float64]],
    roads: cKDTree,
    surroundings: Surroundings,
) -> list[tuple[str, Mesh]]:
    """Return lamp posts on the right of the roads, but not on adjoining roads.

    ``roads`` finds the nearest point of all roads, here as for `plants_along`.
    """
    parts: list[tuple[str, Mesh]] = []
    if surroundings.lamp_spacing_m is None:
        return parts
    for lane, *_ in edges.values():
        if lane.kind == "inside":
            continue
        clear_m = lane.width / 2.0 + 1.0
        kerb = offset(lanes[lane.name], -lane.width / 2.0 - 2.5)
        for point, heading in _positions(kerb, surroundings.lamp_spacing_m):
            if roads.query(point[:2])[0] > clear_m:
                parts.append(("lamp", lamp_post().moved(point, heading)))
    return parts


def plants_along(
    edges: dict[str, list[Lane]],
    lanes: dict[str, NDArray[np.float64]],
    roads: cKDTree,
    surroundings: Surroundings,
    eyes: NDArray[np.float64],
    target_path: NDArray[np.float64],
    rng: np.random.Generator,
) -> list[tuple[str, Mesh]]:
    """Return trees and bushes off every road and out of the camera's line of sight."""
    parts: list[tuple[str, Mesh]] = []
    spacing_m = surroundings.tree_spacing_m
    if spacing_m is None:
        return parts
    clear_m = max(6.0, 0.7 * surroundings.tree_lateral_m)
    root = int(rng.integers(2**63))
    for group in edges.values():
        if group[0].kind == "inside":
            continue
        for lane, side in ((group[0], -1.0), (group[-1], 1.0)):
            positions = _positions(lanes[lane.name], spacing_m)
            for number, (point, heading) in enumerate(positions):
                # a random stream for each position: it does not depend on the others
                own = child_generator(root, lane.name, int(side), number)
                out = lane.width / 2.0 + surroundings.tree_lateral_m
                out = (out + own.exponential(7.0)) * side
                shift = own.uniform(-0.4, 0.4) * spacing_m
                cos, sin = math.cos(heading), math.sin(heading)
                move = [shift * cos - out * sin, shift * sin + out * cos, -0.5]
                base = point + np.array(move)
                is_free = roads.query(base[:2])[0] > clear_m
                if is_free and not _is_in_sight(base, eyes, target_path):
                    kind = "tree" if own.random() < 0.6 else "bush"
                    mesh = plant(kind, base, surroundings.season, eyes, own)
                    parts.append(("tree", mesh))
    return parts


def _is_in_sight(
    base: NDArray[np.float64],
    eyes: NDArray[np.float64],
    target_path: NDArray[np.float64],
) -> bool:
    """Return whether an object at a point might be between camera and target."""
    count = min(len(eyes), len(target_path))
    picks = np.unique(np.linspace(0, count - 1, 40).astype(np.int64))
    start, sight = eyes[picks, :2], target_path[picks, :2] - eyes[picks, :2]
    length = np.maximum(np.linalg.norm(sight, axis=1), 1e-6)
    to = base[:2] - start
    ahead = np.sum(to * sight, axis=1) / length
    aside = np.abs(to[:, 0] * sight[:, 1] - to[:, 1] * sight[:, 0]) / length
    return bool(np.any((ahead > -8.0) & (ahead < length) & (aside < 7.0)))
