"""Meshes of a scenario's occluders: gantries, trees, signs, lamp posts and poles."""

from __future__ import annotations

import math

import numpy as np

from simbench.core.errors import RenderError
from simbench.render.world.mesh import Mesh, box, cylinder, merge
from simbench.render.world.street_furniture import gantry, lamp_post, pole, sign
from simbench.render.world.vegetation import tree
from simbench.scenarios.geometry.line import Line
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.occluders import PlacedOccluder

__all__ = ["gantry_at", "occluder_mesh"]

_GIRDER = (0.5, 0.52, 0.53)


def occluder_mesh(
    occluder: PlacedOccluder, line: Line, season: str, rng: np.random.Generator
) -> Mesh:
    """Return the mesh of an occluder in the road frame.

    Parameters
    ----------
    occluder : PlacedOccluder
    line : Line
    season : str
        Of the leaves of a tree.
    rng : numpy.random.Generator
        For the shape of a tree; not shared with other objects.
    """
    width, height, sight = occluder.width, occluder.height, occluder.sight_height
    if occluder.kind == "gantry":
        if not isinstance(line, RoadLine):
            raise RenderError("gantry: expected a dual carriageway, got another road")
        along, lateral = map(float, line.locate(occluder.base[None])[0])
        if sight is None:
            return gantry_at(line, along, width)
        return _girder(line, (along, lateral), sight, width)
    if occluder.kind == "tree":
        # The crown covers the line of sight with a margin below and above it.
        crown = None if sight is None else max(0.2, sight - width)
        tall = height if sight is None else max(height, sight + width)
        mesh = tree(width, tall, season, rng, leaves=220, crown_from_m=crown)
    elif occluder.kind == "sign":
        mesh = _sign(occluder)
    elif occluder.kind == "lamp":
        mesh = lamp_post(height)
    else:
        mesh = pole(width, height if sight is None else max(height, sight + 2.0))
    return mesh.moved(occluder.base, occluder.heading)


def _sign(occluder: PlacedOccluder) -> Mesh:
    if occluder.sight_height is None:
        middle = 0.0, max(occluder.height - occluder.panel / 2.0, 0.5)
    else:  # raised perpendicular to its long side
        tilt, rise = occluder.tilt, occluder.rise
        middle = -math.sin(tilt) * rise, math.cos(tilt) * rise + occluder.sight_height
    return sign(occluder.width, occluder.panel, middle, occluder.tilt)


def gantry_at(line: RoadLine, along_m: float, beam_m: float = 0.9) -> Mesh:
    """Return a gantry over the near carriageway, from outer edge to median."""
    right, left = -(line.edge_m + 1.0), -0.2
    foot = line.point(along_m, right)
    mesh = gantry(left - right, beam_m=beam_m)
    return mesh.moved(foot, float(line.heading_at(along_m)))


def _girder(
    line: RoadLine, position: tuple[float, float], middle_m: float, depth_m: float
) -> Mesh:
    """Return a box girder over the road and a position beside it, at a given height."""
    along_m, lateral_m = position
    right, left = min(-line.edge_m, lateral_m) - 3.0, max(line.edge_m, lateral_m) + 3.0
    low, high = middle_m - depth_m / 2.0, middle_m + depth_m / 2.0
    beam = box((-0.15, 0.0, low), (0.15, left - right, high), _GIRDER)
    posts = [
        cylinder((0.0, y, -0.5), (0.0, y, high), 0.25, _GIRDER, sides=12)
        for y in (0.0, left - right)
    ]
    foot = line.point(along_m, right)
    return merge([beam, *posts]).moved(foot, float(line.heading_at(along_m)))
