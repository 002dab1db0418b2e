"""What lines the roads of a SUMO network: lamps and trees."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simbench.render.world.mesh import Mesh
from simbench.render.world.polygons import offset
from simbench.render.world.setting import grown
from simbench.render.world.surroundings import lamp_post
from simbench.scenarios.network.shapes import Lane
from simbench.scenarios.schema import Surroundings
from simbench.scenarios.schema.seeds import offspring

__all__ = ["lamps_along", "trees_along"]

Shape = NDArray[np.float64]


def _spots(shape: Shape, spacing_m: float) -> list[tuple[NDArray[np.float64], float]]:
    """Return places along a polyline and its heading there [rad]."""
    arc = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(shape, axis=0), axis=1))]
    )
    found = []
    for at in np.arange(spacing_m / 2.0, arc[-1], spacing_m):
        n = min(int(np.searchsorted(arc, at, side="right")) - 1, len(shape) - 2)
        step = shape[n + 1] - shape[n]
        place = shape[n] + step * (at - arc[n]) / (arc[n + 1] - arc[n])
        found.append((place, math.atan2(step[1], step[0])))
    return found


def lamps_along(
    edges: dict[str, list[Lane]],
    lanes: dict[str, Shape],
    near: cKDTree,
    wanted: Surroundings,
) -> list[tuple[str, Mesh]]:
    """Set lamps on the right of the roads, but not on a road that joins them.

    ``near`` finds the nearest of all roads, here as for `trees_along`.
    """
    parts: list[tuple[str, Mesh]] = []
    if wanted.lamp_spacing_m is None:
        return parts
    for group in edges.values():
        lane = group[0]
        if lane.kind == "inside":
            continue
        clear = lane.width / 2.0 + 1.0
        kerb = offset(lanes[lane.name], -lane.width / 2.0 - 2.5)
        for place, heading in _spots(kerb, wanted.lamp_spacing_m):
            if near.query(place[:2])[0] > clear:
                parts.append(("lamp", lamp_post().moved(place, heading)))
    return parts


def trees_along(
    edges: dict[str, list[Lane]],
    lanes: dict[str, Shape],
    near: cKDTree,
    wanted: Surroundings,
    eyes: NDArray[np.float64],
    way: NDArray[np.float64],
    rng: np.random.Generator,
) -> list[tuple[str, Mesh]]:
    """Plant trees beside the roads, off every road and out of the camera's sight."""
    parts: list[tuple[str, Mesh]] = []
    if wanted.tree_spacing_m is None:
        return parts
    clear = max(6.0, 0.7 * wanted.tree_lateral_m)
    root = int(rng.integers(2**63))
    for group in edges.values():
        if group[0].kind == "inside":
            continue
        for lane, side in ((group[0], -1.0), (group[-1], 1.0)):
            spots = _spots(lanes[lane.name], wanted.tree_spacing_m)
            for number, (place, heading) in enumerate(spots):
                # by its place: one more or less, as the camera moves, changes no other
                own = offspring(root, lane.name, int(side), number)
                out = lane.width / 2.0 + wanted.tree_lateral_m + own.exponential(7.0)
                out *= side
                shift = own.uniform(-0.4, 0.4) * wanted.tree_spacing_m
                cos, sin = math.cos(heading), math.sin(heading)
                move = [shift * cos - out * sin, shift * sin + out * cos, -0.5]
                base = place + np.array(move)
                is_free = near.query(base[:2])[0] > clear
                if is_free and not _is_in_sight(base, eyes, way):
                    kind = "tree" if own.random() < 0.6 else "bush"
                    parts.append(("tree", grown(kind, base, wanted.season, eyes, own)))
    return parts


def _is_in_sight(
    base: NDArray[np.float64], eyes: NDArray[np.float64], way: NDArray[np.float64]
) -> bool:
    """Tell whether something at a place might stand before the target."""
    count = min(len(eyes), len(way))
    picks = np.unique(np.linspace(0, count - 1, 40).astype(np.int64))
    start, sight = eyes[picks, :2], way[picks, :2] - eyes[picks, :2]
    length = np.maximum(np.linalg.norm(sight, axis=1), 1e-6)
    to = base[:2] - start
    ahead = np.sum(to * sight, axis=1) / length
    aside = np.abs(to[:, 0] * sight[:, 1] - to[:, 1] * sight[:, 0]) / length
    return bool(np.any((ahead > -8.0) & (ahead < length) & (aside < 7.0)))
