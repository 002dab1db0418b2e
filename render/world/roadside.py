"""A dual carriageway and what lines it, as far as the camera sees."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import Mesh
from simbench.render.world.occluders import gantry_at
from simbench.render.world.projection import SHADOW_RADIUS_M
from simbench.render.world.setting import Setting, grown
from simbench.render.world.surroundings import ground, guard_rails, lamp_post
from simbench.render.world.tunnel import bore, is_in_bore, require_clear
from simbench.scenarios.geometry.line import Line
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Surroundings
from simbench.scenarios.schema.seeds import offspring
from simbench.scenarios.stage import Stage

__all__ = ["road_setting"]

_AHEAD_M, _BEHIND_M = 700.0, 60.0


def road_setting(
    stage: Stage, line: RoadLine, eyes: NDArray[np.float64], rng: np.random.Generator
) -> Setting:
    """Build the carriageway of a stage as far as its cameras, at ``eyes``, see it."""
    wanted = stage.scenario.surroundings
    some = np.unique(np.linspace(0, len(eyes) - 1, 50).astype(np.int64))
    track = line.locate(eyes[some])[:, 0]
    first, last = float(track.min()), float(track.max())
    looks_back = stage.cameras[0].rotation[2] @ _forward(line, first) < 0.0
    behind, ahead = (_AHEAD_M, _BEHIND_M) if looks_back else (_BEHIND_M, _AHEAD_M)
    if stage.scenario.camera.motion == "pan":  # it turns: both ways are ahead
        behind = ahead = _AHEAD_M
    start, end = first - behind, last + ahead
    standing = _surroundings(line, wanted, start, end, eyes, rng)
    tunnel = None
    if wanted.tunnel is not None:
        tunnel = bore(wanted.tunnel, line, wanted.season)
        require_clear(tunnel, line, eyes, stage.scenario.name)
        standing = [
            (kind, mesh)
            for kind, mesh in standing
            if kind == "rail" or not is_in_bore(mesh, tunnel, line)
        ]
        standing.append(("tunnel", tunnel.mesh))
    return Setting(
        ground(line, start, end, wanted.season),
        standing,
        # to 100 m: the hills must not shift by the last frame's place
        line.point(round((first + last) / 2.0, -2), 0.0),
        SHADOW_RADIUS_M,
        tunnel,
    )


def _forward(line: Line, along_m: float) -> NDArray[np.float64]:
    heading = float(line.heading_at(along_m))
    return np.array([math.cos(heading), math.sin(heading), 0.0])


def _surroundings(
    line: RoadLine,
    wanted: Surroundings,
    start: float,
    end: float,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> list[tuple[str, Mesh]]:
    parts = []
    if wanted.guard_rails:
        parts.append(("rail", guard_rails(line, start, end)))
    if wanted.lamp_spacing_m is not None:
        for along in _spots(start, end, wanted.lamp_spacing_m):
            heading = float(line.heading_at(along))
            for turn in (0.0, math.pi):
                post = lamp_post().moved(line.point(along, 0.0), heading + turn)
                parts.append(("lamp", post))
    if wanted.gantry_spacing_m is not None:
        for along in _spots(start, end, wanted.gantry_spacing_m):
            parts.append(("gantry", gantry_at(line, along)))
    if wanted.tree_spacing_m is not None:
        root = int(rng.integers(2**63))
        for along in _spots(start, end, wanted.tree_spacing_m):
            for side in (-1.0, 1.0):
                # by its place: as the camera's way changes, no other tree does
                own = offspring(root, round(along / wanted.tree_spacing_m), int(side))
                place = along + own.uniform(-0.4, 0.4) * wanted.tree_spacing_m
                parts += _growth(line, wanted, place, side, eyes, own)
    return parts


def _growth(
    line: RoadLine,
    wanted: Surroundings,
    along_m: float,
    side: float,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> list[tuple[str, Mesh]]:
    """Plant a tree and, before it or behind, a bush."""
    parts = []
    for kind in ("tree", "bush"):
        out = line.edge_m + wanted.tree_lateral_m + rng.exponential(7.0)
        base = line.point(along_m + rng.uniform(-3.0, 3.0), side * out, -0.5)
        parts.append(("tree", grown(kind, base, wanted.season, eyes, rng)))
    return parts


def _spots(start: float, end: float, spacing: float) -> NDArray[np.float64]:
    """Return multiples of the spacing, so that they stay put as the view changes."""
    numbers = np.arange(math.ceil(start / spacing), math.floor(end / spacing) + 1)
    return numbers.astype(np.float64) * spacing
