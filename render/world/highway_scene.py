"""Static scene of a dual carriageway with its roadside, as far as the camera sees."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.world.mesh import Mesh
from simbench.render.world.occluder_meshes import gantry_at
from simbench.render.world.road_surface import highway_ground
from simbench.render.world.static_scene import StaticScene
from simbench.render.world.street_furniture import guard_rails, lamp_post
from simbench.render.world.tunnel import build_tunnel, is_in_tunnel, require_clear
from simbench.render.world.vegetation import plant
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Surroundings
from simbench.scenarios.schema.seeds import child_generator
from simbench.scenarios.stage import Stage

__all__ = ["highway_scene"]

_AHEAD_M, _BEHIND_M = 700.0, 60.0
_GOLDEN_RATIO = 0.618034


def highway_scene(
    stage: Stage, line: RoadLine, eyes: NDArray[np.float64], rng: np.random.Generator
) -> StaticScene:
    """Build the part of a carriageway that its cameras, at ``eyes`` (T, 3) m, see."""
    surroundings = stage.scenario.surroundings
    settings = (stage.scenario.camera, *stage.scenario.cameras)
    ranges = [
        _seen_range(path, view.motion == "pan", line)
        for path, view in zip(stage.all_paths, settings, strict=True)
    ]
    first, last = ranges[0][:2]
    start, end = min(one[2] for one in ranges), max(one[3] for one in ranges)
    redraws = stage.trajectories.traffic_redraws
    objects = _roadside(line, surroundings, start, end, eyes, rng, redraws)
    tunnel = None
    if surroundings.tunnel is not None:
        tunnel = build_tunnel(surroundings.tunnel, line, surroundings.season)
        require_clear(tunnel, line, eyes, stage.scenario.name)
        objects = [
            (kind, mesh)
            for kind, mesh in objects
            if kind == "rail" or not is_in_tunnel(mesh, tunnel, line)
        ]
        objects.append(("tunnel", tunnel.mesh))
    return StaticScene(
        highway_ground(line, start, end, surroundings.season),
        objects,
        # rounded to 100 m: the hills do not move with the number of frames
        line.point(round((first + last) / 2.0, -2), 0.0),
        tunnel,
    )


def _seen_range(
    path: tuple[Camera, ...], pans: bool, line: RoadLine
) -> tuple[float, float, float, float]:
    """Return the arc lengths [m] of a camera's track, and of the road that it sees."""
    eyes = np.stack([one.position for one in path])
    some = np.unique(np.linspace(0, len(eyes) - 1, 50).astype(np.int64))
    track = line.locate(eyes[some])[:, 0]
    first, last = float(track.min()), float(track.max())
    heading = float(line.heading_at(first))
    forward = np.array([math.cos(heading), math.sin(heading), 0.0])
    looks_back = path[0].rotation[2] @ forward < 0.0
    behind, ahead = (_AHEAD_M, _BEHIND_M) if looks_back else (_BEHIND_M, _AHEAD_M)
    if pans:  # looks both ways in turn
        behind = ahead = _AHEAD_M
    return first, last, first - behind, last + ahead


def _roadside(
    line: RoadLine,
    surroundings: Surroundings,
    start: float,
    end: float,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
    redraws: int,
) -> list[tuple[str, Mesh]]:
    """Make rails, lamp posts, gantries and plants between two arc lengths [m]."""
    phase = redraws * _GOLDEN_RATIO % 1.0  # other places in every attempt

    def multiples(spacing_m: float) -> range:
        # multiples of the spacing: they do not move as the view changes
        return range(math.ceil(start / spacing_m), math.floor(end / spacing_m) + 1)

    parts = []
    if surroundings.guard_rails:
        parts.append(("rail", guard_rails(line, start, end)))
    if (spacing_m := surroundings.lamp_spacing_m) is not None:
        for along in ((n + phase) * spacing_m for n in multiples(spacing_m)):
            heading = float(line.heading_at(along))
            for turn in (0.0, math.pi):
                post = lamp_post().moved(line.point(along, 0.0), heading + turn)
                parts.append(("lamp", post))
    if (spacing_m := surroundings.gantry_spacing_m) is not None:
        for number in multiples(spacing_m):
            parts.append(("gantry", gantry_at(line, (number + phase) * spacing_m)))
    if (spacing_m := surroundings.tree_spacing_m) is not None:
        root = int(rng.integers(2**63))
        for number in multiples(spacing_m):
            for side in (-1.0, 1.0):
                # a random stream for each position: it does not depend on the others
                own = child_generator(root, number, int(side))
                along = number * spacing_m + own.uniform(-0.4, 0.4) * spacing_m
                for kind in ("tree", "bush"):
                    out = line.edge_m + surroundings.tree_lateral_m
                    out += own.exponential(7.0)
                    shift = own.uniform(-3.0, 3.0)
                    base = line.point(along + shift, side * out, -0.5)
                    mesh = plant(kind, base, surroundings.season, eyes, own)
                    parts.append(("tree", mesh))
    return parts
